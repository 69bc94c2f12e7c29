"""Parameters that change while the scene runs: of walls, their controls, materials and their pairs, and of the simulation."""

from barchan.errors import CheckpointError, SceneError
from barchan.triggers import trigger
from barchan.words import shown

#: Under which ``Simulation.notes``, and so a checkpoint, keeps the names of the changes that were made, in their order.
NOTE = "changes"


class Change:
    """An action: something about the scene changes, once, when it is due for the first time.

    It may set whatever may be set between runs: velocity, material and control of a wall, or the target of its control, pairs of
    materials (``sim.materials.set_pair``), gravity, damping. Forces of this step are the first that know of it, and velocities of
    walls in the next. ``sim.notes`` remembers that it was made.

    A script that resumes puts the same changes into ``sim.actions`` before ``restore``. That makes again those that were made by
    the time of the checkpoint, in their order, and then takes places, velocities and grains from it: so what is set must depend
    on nothing that changes in time. What happens to grains belongs into an action of your own.

    Args:
        name: its own.
        due: trigger, a function of the step.
        change: function of the simulation, called on all ranks.

    Raises:
        SceneError: an argument cannot be used.
    """

    def __init__(self, name, due, change):
        if not callable(change):
            raise SceneError(f"change '{name}': {shown(change)} must be a function of the simulation that sets what shall change")
        self.name, self.due, self.change = str(name), trigger(due, f"change '{name}'"), change

    def apply(self, sim):
        """Make it, unless it was made.

        Raises:
            SceneError: another change in this scene has its name.
        """
        if any(one is not self and isinstance(one, Change) and one.name == self.name for one in sim.actions):
            raise SceneError(
                f"change '{self.name}': two changes in sim.actions have this name, and of them only one would be made; give each "
                f"its own"
            )
        made = sim.notes.setdefault(NOTE, [])
        if self.name not in made:
            self.change(sim)
            made.append(self.name)


def make_again(sim, notes):
    """Make the changes that were made by the time of a checkpoint, and not yet in this scene.

    Args:
        notes: of the checkpoint.

    Raises:
        CheckpointError: the scene has none of such a name, or they are no names.
    """
    known, made = {action.name: action for action in sim.actions if isinstance(action, Change)}, notes.get(NOTE, [])
    if not (isinstance(made, list) and all(isinstance(name, str) for name in made)):
        raise CheckpointError(f"its notes of changes, {shown(made)}, are no list of names; it was not written by barchan")
    for name in made:
        if name not in known:
            there = ", ".join(map(repr, known)) or "none"
            raise CheckpointError(
                f"change {shown(name)} was made by then, and this scene has {there}; put the same changes into sim.actions "
                f"before restore()"
            )
        known[name].apply(sim)
    if made:
        sim.note_edits(sim.grains.take_edits())
