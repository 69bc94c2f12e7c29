"""A simulation: the state and the algorithm, read aloud.

Time levels: positions, forces, torques and contacts at the full step n; velocities and angular velocities at the half step
n-1/2.
"""

import warnings
from math import sqrt

import numpy as np

from barchan import preflight, stepping
from barchan.assembly import Assembly
from barchan.bonds import travel
from barchan.deformation import Deformation, deform
from barchan.errors import Interrupted, SceneError
from barchan.faults import ALLOWED_OVERLAP, Faults
from barchan.forces import Damping, Gravity
from barchan.kernels import cells, integrate
from barchan.kernels.compiler import default_threads, use_threads
from barchan.kernels.generate import make_loops
from barchan.kernels.steps import Progress
from barchan.kernels.wire import OWN, SLOWEST, WAITING
from barchan.neighbors.classes import SizeClasses
from barchan.neighbors.contacts import Contacts, Setting
from barchan.neighbors.grid import grids_around
from barchan.neighbors.scope import Scope
from barchan.neighbors.staleness import Staleness
from barchan.parallel.balance import Balance
from barchan.parallel.ghosts import Ghosts
from barchan.parallel.guard import raise_together
from barchan.parallel.migrate import destinations, migrate, rehome
from barchan.stopwatch import Stopwatch
from barchan.walls.wall import steer


class Simulation(Assembly):
    """Grains in a box.

    Args:
        box: a ``Box``.
        law: a contact law, for grains and walls alike.
        materials: a ``Material`` or a list of them.
        dt: time step [time].
        gravity: acceleration [length/time^2], or a function of time.
        threads: threads of this process; default all cores. The result has the same bits for any number.
        comm: communicator; default: whatever this program was started with.
        shape: "sphere", or in a box of two dimensions "disc": what mass and inertia follow from radius and density.
        bonds: a ``Bond`` or a list of them, of one law: the kinds that ``install_bonds`` may put between grains.

    Attributes to set before or between runs: ``max_overlap`` (0.2: allowed overlap relative to the smaller diameter),
    ``skin`` [length] (how far beyond touching pairs are listed; changes speed, never the result), ``gravity``, ``dt``,
    ``damping`` (a ``Damping``; none), ``deformation`` (a ``Deformation`` of a periodic box; none), ``size_classes`` (a
    ``SizeClasses``, which chooses by itself). At any moment, also from a signal handler: ``stop_requested`` = True ends the run
    after the step at hand. ``clock`` knows where the time goes.

    Raises:
        SceneError: an argument cannot be used.
    """

    def __init__(self, box, law, materials, dt, gravity=(0.0, 0.0, 0.0), threads=None, comm=None, shape="sphere", bonds=()):
        super().__init__(box, law, materials, comm, shape, bonds)
        self.dt, self.gravity, self.damping, self.deformation = dt, gravity, Damping(), Deformation()
        self.threads = default_threads(self.comm.ranks_on_node) if threads is None else threads
        self.max_overlap, self.skin, self.check_dt = 0.2, None, True
        preflight.check_settings(self)
        self.held = {}  # what the servos of the deformation have seen
        self._gravity, self._damping = Gravity(gravity, box.dimension), self.damping
        self.actions, self.writers = [], []
        self.step_number, self.time = 0, 0.0
        self.notes = {}
        self.touching, self.faults = 0, Faults()
        self.staleness, self.balance, self.ghosts = Staleness(), Balance(), Ghosts(self.comm)
        self.size_classes, self._scope = SizeClasses(), Scope()
        self.clock, self.stop_requested, self._stopping = Stopwatch(), False, False
        self._in_step = self._acting = False
        self.loops = self.table = self._checked_dt = self.stable_dt = None
        self._computed = 0.0
        self._complete = True

    # -- the algorithm -----------------------------------------------------------------------------------------------

    def run(self, steps):
        """Advance by ``steps`` steps, a whole number. ``run(100); run(100)`` gives the bits of ``run(200)``.

        Raises:
            SceneError: the scene cannot be run; nothing was advanced.
            RunError: the run had to stop; the state is that of the step named in the message, or moved on by one drift.
            Interrupted: ``stop_requested`` was set; the step at hand was finished.
        """
        preflight.check_count("run: steps", steps, least=0)
        self.prepare()
        end = self.step_number + steps
        while self.step_number < end:
            begun = self._leap(end)  # steps of a small scene that need nothing but motion and forces
            if begun is not None or self.step_number < end:
                self.step(begun)
            if self._stopping:
                self._break_off()
        self._agree_on_faults()

    def step(self, begun=None):
        """One step of the leap-frog, equations (1) to (12). Needs ``prepare``, which ``run`` calls.

        Args:
            begun: of a step in which grains and walls have moved already, what ``_move`` returned.
        """
        self._refuse_if_torn()
        preflight.check_prepared("step", self.loops, self._primed)
        use_threads(self.threads, self.grains.n)
        self.clock.start()
        if begun is None:
            steer(self.walls, self)  # by what grains do to them at n
        self._in_step = True
        motion = begun or self._move()
        self.step_number += 1
        self.time += self.dt
        self.clock.lap("motion")
        self._act()  # grains added, removed or changed at n+1
        self.clock.lap("actions")
        if self._is_stale(motion):
            self.rebuild()
            self.clock.lap("neighbours")
        else:
            self.clock.lap("neighbours")
            self.ghosts.start_update(self.grains, self.reads)
            self.clock.lap("ghosts")
        self.compute_forces(self.dt)  # F, T and contact memory: n -> n+1, with v at n+1/2
        self._primed, self._in_step = True, False
        self.deformation.look(self)
        self.clock.lap("forces")
        self._write()
        self.clock.lap("output")

    def rebuild(self):
        """Find the neighbours anew. Writes no physical field. Needs ``prepare``, as ``step`` does."""
        self._refuse_if_torn()
        preflight.check_prepared("rebuild", self.loops)
        self._torn = True  # until it is done: whatever interrupts it
        if not self._listed:
            self.staleness.restart()  # it is the scene that changed, not the grains that moved
        scope = self._scope
        self.topology = self.balance.shared(self, scope.sizes.widest)
        old_list = self.contacts if self._listed else None
        owner, partners = destinations(self.comm, self.topology, self.grains, scope.cutoff)
        travel.migrate(self.comm, self.bonds, self.grains.view("id"), owner, partners)
        rows, known, origin = rehome(self.comm, owner, partners, self.grains, old_list, self._rows)
        grids = grids_around(self.grains, self.topology.bounds(self.comm.rank), self.box, self.size_classes, scope.reach)
        start, order = self._sort_in_space(grids)
        bonded = travel.sends(self.comm, self.bonds, self.grains)
        self.ghosts.build(self.grains, self.topology, grids, start, scope.reach, bonded)
        wanted = travel.wanted(self.bonds, self.grains)
        self.contacts.find(self.grains, self.box, grids, start, scope.reach, wanted)
        self.ghosts.keep(self.grains, wanted)
        self.bonds.settle(self.grains)
        self.contacts.build(self.grains, self.walls, scope.reach)
        self.size_classes.note(self.contacts.search.seconds, self.grains.view("radius", ghosts=True)[self.grains.n :])
        rows = rows.take(order)
        self.contacts.carry_over(known, origin[order], rows if self._listed else self.ghosts.join_rows(rows))
        self.staleness.remember(self.step_number)
        self._walls_then = [wall.place for wall in self.walls]
        self._listed, self._rows, self._torn = True, None, False

    def compute_forces(self, dt):
        """Forces at the present positions; contact memory advances by ``dt`` (0: not at all). Needs ``prepare``."""
        preflight.check_prepared("compute_forces", self.loops, self._listed)
        self.clock.start()
        grains, contacts = self.grains, self.contacts
        setting, counts = self._setting(dt), []
        for wall, (begin, end) in zip(self.walls, contacts.wall_ranges):
            wall.measure(contacts, grains, dt, begin, end)
        inner, border = contacts.parts
        counts.append(contacts.compute_pairs(self.loops, grains, setting, inner))  # while ghosts travel
        self.clock.lap("forces")
        self.ghosts.finish_update(grains)
        self.clock.lap("ghosts")
        counts.append(contacts.compute_pairs(self.loops, grains, setting, border))
        counts.append(contacts.compute_walls(self.loops, grains, setting))
        self.touching, large, too_large = (sum(parts) for parts in zip(*counts))
        not_finite = contacts.gather(grains, self._gravity.at(self.time)) + self.bonds.act(self, dt)
        self._damping.apply(grains)
        self.loads.forget()
        self.faults.note(self, large, too_large, not_finite)
        self.faults.found = self.faults.found or preflight.out_of_plane(self)

    def prepare(self):
        """Check the scene and bring forces up to date with what was changed since the last run.

        Raises:
            SceneError: something cannot be run; the message says what, where, and what to do.
        """
        self._refuse_if_torn()
        if self._acting:
            raise SceneError(
                f"step {self.step_number}: an action cannot call run(), prepare() or install_bonds(): it is within a step"
            )
        use_threads(self.threads, self.grains.n)
        if self._in_step:
            self._warn_of_broken_step("the run")
            self._primed = self._in_step = False
        self._take_up_edits()
        if not (self._primed and self._listed):
            raise_together(self.comm, preflight.fault(self))
        self._take_up_parameters()
        if self.loops is None:
            preflight.check_energy(self.law, self.table)
            preflight.check_energy(self.bonds.law, self.bonds.table)
            self.loops = make_loops(self.law, len(self.materials) == 1)
        self._take_up_sizes()
        if not (self._primed and self._listed):
            preflight.check_box(self, self._scope.cutoff)
            preflight.check_walls(self, self._scope.sizes)
            self.rebuild()
        if not self._primed:
            self.compute_forces(0.0)
            self._agree_on_faults()
            self._primed = True
            self.deformation.look(self)

    def start_at_full_step(self):
        """Take the velocities as those of the full step n, where most codes and text books give them, and bring them to
        n-1/2, where the leap-frog needs them: v <- v - dt/2 F/m. Call it once, before the first run."""
        self.prepare()
        grains, half = self.grains, 0.5 * self.dt
        grains.view("velocity")[...] -= half * grains.view("inverse_mass")[:, None] * grains.view("force")
        grains.view("omega")[...] -= half * grains.view("inverse_inertia")[:, None] * grains.view("torque")
        if self.comm.size > 1:
            self.ghosts.update(grains, self.reads)

    def load(self, state):
        """Take up grains, contacts and counters of a ``checkpoint.State``, of which each rank gives a part by ascending id."""
        if self._torn:  # there is no list to put away, and who knows what is left of its memory
            self._listed = self._torn = False
            self.contacts = Contacts(self.law)
        self._in_step = self._stopping = False  # whatever ended the last run
        self.begin_change()
        self.grains.keep(np.zeros(0, dtype=np.int64))
        self.grains.append(state.fields)
        self._rows = state.contacts
        if self.comm.size > 1 and self.balance.when != "never":
            self.topology = self.balance.anew(self, self._largest_radius())  # they came shared evenly by their ids
        owner = self.topology.owner(self.grains.view("position"))
        travel.deal(self.comm, self.bonds, self.grains.view("id"), owner, state)
        self._rows, _ = migrate(self.comm, owner, self.grains, self._rows)
        self._primed = bool(state.about["forces_are_current"])
        self.table = self.materials.table(self.law)  # that of these forces: a change before the first run is noticed
        self.next_id, self.notes = int(state.about["next_id"]), dict(state.about["notes"])
        self.step_number, self.time, self.dt = int(state.about["step"]), float(state.about["time"]), float(state.about["dt"])
        self.loads.restore(state.about["loads"])
        self.faults.restart(int(state.about["large_overlaps"]) if self.comm.rank == 0 else 0)

    @property
    def list_skin(self):
        """How far beyond touching pairs are listed now [length]; None before the first list."""
        return self._scope.skin

    @property
    def present_gravity(self):
        """Gravity at the present time, three numbers [length/time^2]."""
        return Gravity(self.gravity, self.box.dimension).at(self.time)

    # -- its parts ---------------------------------------------------------------------------------------------------

    def _leap(self, end):
        """The next steps, up to step ``end``, in one call of compiled code: where calls of Python would take longer than all the
        rest. Returns what ``step`` needs to finish one that was begun, or None."""
        watch, gravity, wire = self.staleness, self._gravity, self.ghosts.wire
        waits = callable(gravity.value) or not self._listed or self.faults.found or self.stop_requested
        waits = (
            waits
            or self.bonds.active
            or self._deforms
            or self.clock.by_phase
            or wire is None
            or use_threads(self.threads, self.grains.n) > 1
        )
        most = self._of_all_least(0 if waits else stepping.steps_ahead(self, end))
        if most < 2:
            return None
        self.clock.start()
        self._in_step = True
        setting, then = self._setting(self.dt), (self._scope.skin, self._walls_then)
        told = np.array([0.0, 0.0, 0.0, 0.0, self.time, watch.approach, *5 * [0.0]])
        try:
            stepping.advance(self, most, self.loops, setting, (gravity.at(self.time), self._damping), *then, told)
        finally:  # also when Ctrl-C came meanwhile: what was done is known
            done = Progress.read(told)
            self.step_number, self.time = self.step_number + done.done, done.time
            watch.take(done.approach, done.quickest, self._scope.skin, self.dt)
            self.touching = done.touching if done.done else self.touching
            self._in_step = bool(done.begun)
            self.loads.forget()
            self.faults.note(self, done.large, done.too_large, done.not_finite)
            self.faults.found = self.faults.found or preflight.out_of_plane(self)
        watch_of_wire = wire.watch.tolist()
        self.balance.note(watch_of_wire[SLOWEST], watch_of_wire[OWN], done.done)
        self.clock.lap("steps")
        self.clock.move(watch_of_wire[WAITING], "steps", "ghosts")
        return (done.fastest, done.bad) if done.begun else None

    @property
    def _deforms(self):
        """Whether the box is stretched in the next step, or was in the last."""
        return self.deformation.acts or self.box.moves

    def _setting(self, dt):
        return Setting(len(self.materials), self.table, self.box.frame, dt, ALLOWED_OVERLAP, self.max_overlap)

    def _move(self):
        if self._deforms:  # box: n -> n+1, and its grains with it
            rates = self.deformation.rates(self)
            preflight.check_box(self, self._scope.cutoff, 1.0 + self.dt * rates[:3])
            self.staleness.squeeze(deform(self, rates), self._scope.cutoff)
        low, length, half, tilt, _ = self.box.frame
        blocks = [self.grains.block(name) for name in ("place", "motion", "spin", "image", "force", "torque")]
        motion = integrate.kick_drift_wrap(*blocks, low, length, half, tilt, self.dt)  # v, omega: n-1/2 -> n+1/2;  x: n -> n+1
        for wall in self.walls:
            wall.move(self.dt)  # walls: n -> n+1
        return motion

    def _is_stale(self, motion):
        """Whether to rebuild, and whether any rank has to stop: one reduction decides both for all ranks."""
        fastest, bad = motion
        if bad and self.faults.found is None:
            self.faults.found = preflight.bad_grain(self)
        speed = max([sqrt(fastest), *(wall.speed for wall in self.walls)])
        computed = self.clock.seconds.get("motion", 0.0) + self.clock.seconds.get("forces", 0.0)
        own, self._computed = computed - self._computed, computed
        wish = float(self.stop_requested)
        speed, slowest, self._stopping, *signs = self.comm.maximum([speed, own, wish, *self.faults.signs])
        self.balance.note(slowest, own, 1)
        self.faults.take_note(self, *signs, depth=4)
        self.staleness.advance(speed, self._scope.skin, self.dt)
        if not self._listed:  # an action changed the grains: nothing is known of their displacements
            return True
        if self.staleness.wants_rebuild(self.step_number):
            return True
        if self.staleness.nearer > self.staleness.allowed(self._scope.skin):
            self._measure_approach()
        return self.staleness.nearer > self.staleness.allowed(self._scope.skin)

    def _measure_approach(self):
        """The bounds on what may have approached, from the displacements of all grains and walls on all ranks."""
        frame = self.box.frame
        period = (frame.length, frame.half, frame.tilt)
        *largest, square = integrate.displacements(self.grains.block("place"), self.contacts.seen, *period)
        for wall, then in zip(self.walls, self._walls_then):
            travel, farthest = wall.travel(then)
            largest, square = np.maximum(largest, travel), max(square, farthest * farthest)
        *largest, square = self.comm.maximum([*largest, square])
        self.staleness.measure(largest, sqrt(square))

    def _agree_on_faults(self):
        self.faults.take_note(self, *self.comm.maximum(self.faults.signs), depth=3)

    def _break_off(self):
        """End the run between two steps, on all ranks."""
        self._stopping = self.stop_requested = False
        self._agree_on_faults()
        raise Interrupted(f"stopped at step {self.step_number}, t = {self.time:.6g}")

    def _act(self):
        """Actions that are due; what they wrote or added is checked, and honoured in this step."""
        due = [action for action in self.actions if action.due(self.step_number)]
        self._acting = True
        try:
            for action in due:
                action.apply(self)
        finally:
            self._acting = False
        if due:
            self._take_up_edits()
            if not self._listed:
                raise_together(self.comm, preflight.fault(self))
            self._take_up_parameters()
            self._take_up_sizes()
            if not self._listed:
                preflight.check_box(self, self._scope.cutoff)

    def _write(self):
        """Writers that are due. They read; views of the state that they took end here."""
        for writer in self.writers:
            if writer.due(self.step_number):
                writer.write(self)
        edited = self.grains.take_edits()
        if edited:
            self.faults.found = SceneError(f"step {self.step_number}: a writer changed {', '.join(edited)}; only an action may")

    def take_up_changes(self):
        """Note what users changed since the last run, so that a checkpoint knows whether its forces are current."""
        self._refuse_if_torn()
        self._take_up_edits()
        if self._in_step:  # the forces are those of the step before
            self._warn_of_broken_step("a run from what is saved now")
            self._primed = False
        if self.table is not None and not np.array_equal(self.materials.table(self.law), self.table):
            self._primed = False

    def _warn_of_broken_step(self, what):
        warnings.warn(
            f"step {self.step_number} was broken off by an error; its forces are computed anew, and {what} will not have the "
            f"bits of one that was not. An earlier checkpoint has them",
            stacklevel=4,
        )

    def _take_up_edits(self):
        """Bring in what users wrote since the last run; all ranks do if one does."""
        primed_before = self._primed
        edited = self.grains.take_edits()
        dirty = self.note_edits(edited)
        if self.comm.maximum([float(dirty or not primed_before)])[0]:
            self._take_down_list()
            self._primed = False

    def _take_up_parameters(self):
        """Check what users set on the simulation and its materials, and bring it in."""
        preflight.check_settings(self)
        self._gravity, self._damping = Gravity(self.gravity, self.box.dimension), self.damping
        before, self.table = self.table, self.materials.table(self.law)
        if before is not None and not np.array_equal(before, self.table):
            self._primed = False  # forces with the new parameters

    def _take_up_sizes(self):
        """The skin and the size classes that suit the grains there are now, and whether the time step does."""
        if self._scope.follow(self, self._listed):
            self._take_down_list()
        if self.check_dt and not (self._primed and self._checked_dt == self.dt):
            stable = preflight.stable_time_step(self.law, self.table, self.grains, len(self.materials), self.bonds)
            self.stable_dt = -float(self.comm.maximum([-stable])[0])
            preflight.check_time_step(self, self.stable_dt)
            self._checked_dt = self.dt

    def _of_all_least(self, number):
        """The least of the numbers of all ranks."""
        return -int(self.comm.maximum([-number])[0])

    def _largest_radius(self):
        return float(self.comm.maximum([cells.extents(self.grains.block("place"), -np.inf, np.inf)[6]])[0])

    def _sort_in_space(self, grids):
        place = self.box.upright.places(self.grains.block("place"))
        start, order = cells.sorted_cells(place, 0, self.grains.n, grids)
        self.grains.keep(order, but=("force", "torque") if self._in_step else ())  # which are computed next
        return start, order
