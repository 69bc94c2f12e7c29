"""Where energy came from and where it went, step by step."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure.base import Result
from barchan.measure.energy import KineticEnergy, stored, stored_in_bonds
from barchan.measure.powers import Powers, powers
from barchan.measure.touching import check_contacts
from barchan.triggers import Every
from barchan.words import shown


class EnergyAccount:
    """A writer that watches every step: work of gravity, of walls and of a stretched box, and what friction, dashpots and
    damping took, since the first step that it saw.

    Put it into ``sim.writers`` before checkpoints, which keep its sums. Each power (``powers.py``) is integrated by the
    trapezoidal rule, elastic energy is that of the present overlaps, and kinetic energy that of the full step: what is left
    over, ``residual``, is the error of the time step, O(dt^2), or O(dt) where forces jump (contacts that stick, constant couples)
    and where the speed of a wall is set anew in each step. A step takes 13 to 30 times as
    long as without, the more the smaller the scene.

    *Dashpots* are those along the normal. *Friction* is the work against tangential forces and couples that springs do not store:
    of sliding and rolling, their dashpots included, and what an incremental law loses or gains as the stiffness of a loaded
    spring changes; of laws that do not tell what they store, springs are friction. *Parting* is what contacts that outlast
    touching still store as they end; for such laws it is what is left of the normal work, and the residual does not test it.
    *Breaking* is what bonds take: what they stored as they broke, which ``bonds.cracks`` tells of each, and what laws with a
    dashpot or a softening take before; it is what is left of the work of bonds, so the residual does not test it either.

    Grains that come or go in between, or are frozen, released or pushed by hand, take energy along that nobody counts: such a run
    has no account. What contacts store more or less as materials are changed counts as if it had been so at the start.

    Args:
        name: under which ``sim.notes["energy accounts"]`` keeps the sums.

    Raises:
        SceneError: the name is no text.
    """

    kinetic = Result("energy of translation and rotation now [force length]")
    elastic = Result("energy stored in contacts now [force length]")
    bonded = Result("energy stored in bonds now [force length]")
    start = Result("sum of the three at the first step seen, and what changes of materials gave since [force length]")
    gravity = Result("work of gravity since then [force length]")
    walls = Result("work of walls, and of frozen grains that move [force length]")
    box = Result("work of a box that is stretched [force length]")
    friction = Result("taken by friction [force length]")
    dashpots = Result("taken by the dashpots of normal forces [force length]")
    damping = Result("taken by Simulation.damping [force length]")
    parting = Result("taken by the ends of contacts that outlast touching [force length]")
    breaking = Result("taken by bonds, as they broke or before [force length]")
    residual = Result("energy now - (start + works - taken) [force length]")
    largest = Result("largest of these terms, residual apart [force length]")

    due = Every(1)

    def __init__(self, name="energy"):
        if not isinstance(name, str) or not name:
            raise SceneError(f"EnergyAccount: name = {shown(name)} must be a text")
        self.name = name

    def write(self, sim):
        """Take the present step into the sums.

        Raises:
            SceneError: it has not seen the step before, or grains came or went.
        """
        accounts, now = sim.notes.setdefault("energy accounts", {}), powers(sim)
        if self.name not in accounts:
            kinetic, (elastic, springs) = KineticEnergy().compute(sim).total, stored(sim)
            begin = {"kinetic": kinetic, "normal": elastic - springs, "springs": springs, "bonds": stored_in_bonds(sim)}
            accounts[self.name] = {"grains": sim.n_grains, "start": begin, "sums": dict.fromkeys(Powers._fields, 0.0)}
        else:
            known = accounts[self.name]
            self._check(sim, known, step=sim.step_number - 1)
            self._take_change_of_materials(sim, known)
            for kind, before, after in zip(Powers._fields, known["powers"], now):
                known["sums"][kind] += 0.5 * sim.dt * (before + after)
        accounts[self.name] |= {"step": sim.step_number, "powers": list(now), "table": sim.table.tolist()}

    def compute(self, sim):
        """Draw up the account of the present step; returns self.

        Raises:
            SceneError: it has not seen the present step, or grains or walls were changed since.
        """
        known = sim.notes.get("energy accounts", {}).get(self.name)
        if known is None:
            raise SceneError(f"EnergyAccount '{self.name}' has seen no step; put it into sim.writers and run")
        self._check(sim, known, step=sim.step_number)
        check_contacts(sim)
        work, begin = Powers(**known["sums"]), known["start"]
        self.kinetic, (self.elastic, springs) = KineticEnergy().compute(sim).total, stored(sim)
        self.bonded = stored_in_bonds(sim)
        self.start = sum(begin.values())
        self.breaking = -work.bonds - (self.bonded - begin["bonds"])
        self.gravity, self.walls, self.box = work.gravity, work.walls, work.box
        self.friction = -work.tangential - (springs - begin["springs"])
        self.dashpots, self.damping = -work.dashpots, -work.damping
        in_normal = self.elastic - springs - begin["normal"]
        self.parting = -work.normal - in_normal if sim.law.reach else 0.0
        taken = (self.friction, self.dashpots, self.damping, self.parting, self.breaking)
        now, came = (self.kinetic, self.elastic, self.bonded), (self.gravity, self.walls, self.box)
        self.residual = sum(now) - (self.start + sum(came) - sum(taken))
        self.largest = max(map(abs, (*now, self.start, *came, *taken)))
        return self

    def _take_change_of_materials(self, sim, known):
        """What contacts store more or less because their materials were changed counts as if it had been there at the start."""
        now, before = sim.table, np.array(known["table"])
        if np.array_equal(now, before):
            return
        energy, springs = stored(sim)
        sim.table = before
        try:
            energy_before, springs_before = stored(sim)
        finally:
            sim.table = now
        known["start"]["normal"] += (energy - springs) - (energy_before - springs_before)
        known["start"]["springs"] += springs - springs_before

    def _check(self, sim, known, step):
        if known["step"] != step:
            raise SceneError(
                f"step {sim.step_number}: EnergyAccount '{self.name}' saw step {known['step']} last; it must see every step. "
                f"Keep it in sim.writers, before checkpoints, or begin another with a name of its own"
            )
        if known["grains"] != sim.n_grains:
            raise SceneError(
                f"step {sim.step_number}: EnergyAccount '{self.name}' began with {known['grains']} grains, there are "
                f"{sim.n_grains} now; nobody counts the energy of those that come or go. Begin another with a name of its own"
            )
