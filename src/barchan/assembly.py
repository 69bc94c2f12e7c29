"""What is simulated: box, law, materials, grains and walls, and how users put them together."""

from copy import copy
from zlib import crc32

import numpy as np

from barchan.bonds import Bonds, install
from barchan.domain import Box, numbers
from barchan.errors import SceneError
from barchan.fields import DERIVED
from barchan.grains import Grains, is_physical
from barchan.laws.bond import BondLaw, kinds_of
from barchan.laws.law import Law
from barchan.materials import Materials
from barchan.neighbors.contacts import Contacts
from barchan.neighbors.rows import ContactRows
from barchan.parallel import world
from barchan.parallel.topology import even
from barchan.shapes import shape_named
from barchan.walls.loads import Loads
from barchan.walls.wall import Wall
from barchan.words import nearest, shown

#: Fields of a new grain that follow from the others.
_OWN = ("image", "force", "torque")


class Assembly:
    """Box, law, materials, grains and walls of one scene, on one rank; ``Simulation`` moves it."""

    #: Once True, there are no new public attributes: most likely they are typos.
    _complete = False

    def __init__(self, box, law, materials, comm, shape, bonds):
        if not isinstance(box, Box):
            raise SceneError(f"box = {shown(box)} must be a barchan.Box")
        if not isinstance(law, Law):
            raise SceneError(
                f"law = {shown(law)} must be a law, such as barchan.laws.hertz_mindlin or a function decorated with @barchan.law"
            )
        if isinstance(law, BondLaw):
            raise SceneError(f"law '{law.name}' is a bond law; it goes into bonds=barchan.Bond(...), beside a contact law")
        self.box, self.law, self.materials, self.bonds = copy(box), law, Materials(materials), Bonds(kinds_of(bonds))
        self.comm = comm or world()
        self.topology = even(self.box, self.comm.size)
        self.shape = shape_named(shape, box)
        self.grains, self.walls, self.next_id, self.loads = Grains(shape=self.shape), [], 0, Loads(self)
        self.contacts = Contacts(law)
        self._rows = ContactRows.empty(0, law.history_width)
        self._listed = self._primed = self._torn = False

    def __setattr__(self, name, value):
        if self._complete and name not in self.__dict__ and not name.startswith("_") and not hasattr(type(self), name):
            public = [known for known in self.__dict__ if not known.startswith("_")]
            raise SceneError(f"a simulation has no attribute '{name}'; {nearest(name, public)}")
        if self._complete and name in ("box", "law", "materials", "shape", "bonds"):
            raise SceneError(f"{name} of a simulation cannot be replaced; make another simulation")
        super().__setattr__(name, value)

    def add_grains(self, position, radius, material=0, velocity=0.0, omega=0.0, frozen=False, **fields):
        """Add grains; every rank gives the same list and keeps its own part.

        Args:
            position: (k, 3) centres [length]; folded into the box along periodic directions.
            radius: number or (k,) [length].
            material: name or number, or (k,) of them; sets the mass by its density, as of the simulation's ``shape``.
            velocity, omega: (k, 3), three numbers or one, at the half step [length/time, 1/time].
            frozen: bool or (k,): immobile.
            fields: values of further fields by name, such as ``mass`` or one made by ``add_field``.

        Returns:
            The ids of the new grains, (k,); never used before.

        Raises:
            SceneError: shapes do not fit, or a field or a material does not exist.
        """
        values = self._values(position, radius, material, velocity, omega, frozen, fields)
        self._compare(values)
        given = np.arange(len(values["position"]))
        self._add(given, len(given), values)
        return self.next_id - len(given) + given

    def add_part(self, numbers, total, position, radius, material=0, velocity=0.0, omega=0.0, frozen=False, **fields):
        """Add grains of which no rank gives all: so many that they do not fit into the memory of one. All ranks must call this.

        Args:
            numbers: (k,) of the grains that this rank gives, ascending, from 0 to ``total`` - 1: at least those in its ``space``.
            total: how many there are in all; they get the next ids in the order of their numbers.
            position, radius, material, velocity, omega, frozen, fields: as ``add_grains`` takes them, of the given ones.

        Raises:
            SceneError: what ``add_grains`` raises; or a grain was given by no rank in whose space it is, or two have one number.
        """
        values, numbers = self._values(position, radius, material, velocity, omega, frozen, fields), np.asarray(numbers)
        count = len(values["position"])
        if not isinstance(total, (int, np.integer)) or isinstance(total, bool) or total < 0:
            raise SceneError(f"add_part: total = {shown(total)} must be a whole number >= 0, the same on all ranks")
        if numbers.shape != (count,) or numbers.dtype.kind not in "iu" or not _ascend(numbers, total):
            raise SceneError(
                f"add_part: numbers = {shown(numbers)} must be {count} ascending whole numbers from 0 to {total - 1}, one for "
                f"each position"
            )
        first = self.next_id
        added = self._add(numbers, total, values)
        own = self.grains.view("id")[self.grains.n - added :] - first
        kept, *sums = self.comm.sum([added, own.sum(), (own * own).sum()]).tolist()
        if kept != total:
            raise SceneError(
                f"add_part: of {total} grains {kept} were given by the rank in whose space they are; each rank must give at "
                f"least those in its own (Simulation.space)"
            )
        if sums != [_wrapped(total * (total - 1) // 2), _wrapped((total - 1) * total * (2 * total - 1) // 6)]:
            raise SceneError("add_part: two ranks gave different grains the same number; numbers count the grains of all ranks")

    def share_space(self, bricks):
        """Share space among the ranks before there are grains, so that each will hold as many. All ranks must call this.

        Args:
            bricks: low and high corner [length] of each part of the box that grains will fill evenly.

        Raises:
            SceneError: there are grains already, or a corner is not three numbers.
        """
        if self.next_id:
            raise SceneError("share_space must come before the first grains; from then on Simulation.balance shares space")
        corners = numbers("share_space: bricks", bricks, "length")
        if corners.ndim != 3 or corners.shape[1:] != (2, 3):
            raise SceneError(f"share_space: bricks have shape {corners.shape}; they must be (bricks, 2, 3)")
        right = (corners[:, 0] < corners[:, 1]) & (corners[:, 1] > self.box.low) & (corners[:, 0] < self.box.high)
        wrong = ~right[:, : self.box.dimension].all(axis=1)
        if wrong.any():
            raise SceneError(
                f"share_space: brick {np.flatnonzero(wrong)[0]}, {corners[wrong][0].tolist()}, must have a high corner above its "
                f"low one, and a part inside the box from {self.box.low.tolist()} to {self.box.high.tolist()}"
            )
        self.topology = even(self.box, self.comm.size, corners)

    @property
    def n_grains(self):
        """Number of grains of all ranks, which all must ask."""
        return int(self.comm.sum([self.grains.n])[0])

    @property
    def space(self):
        """Low and high corner [length] of the brick that holds this rank's part of space, with room for rounding; bricks of
        several ranks may overlap."""
        low, high = self.topology.bounds(self.comm.rank)
        return low - 1e-9 * self.box.length, high + 1e-9 * self.box.length

    def _values(self, position, radius, material, velocity, omega, frozen, fields):
        """Fields of new grains by name."""
        position = np.atleast_2d(numbers("add_grains: position", position, "length"))
        if position.ndim != 2 or position.shape[1] != 3:
            raise SceneError(f"add_grains: position has shape {position.shape}; it must be (grains, 3)")
        given = [name for name in fields if name in _OWN or name in DERIVED]
        if given:
            raise SceneError(f"add_grains: {', '.join(given)} cannot be given; barchan sets it")
        folded, image = self.box.wrap(position)
        numbers_of_materials = self._column("material", self._material_numbers(material), len(position))
        values = self._shaped(len(position), radius, numbers_of_materials, fields)
        return values | {
            "position": folded,
            "image": image,
            "velocity": velocity,
            "omega": omega,
            "frozen": frozen,
            "material": numbers_of_materials,
            **fields,
        }

    def _compare(self, values):
        """Refuse lists of grains that differ between ranks."""
        if self.comm.size > 1:
            digest = float(crc32(np.ascontiguousarray(values["position"])) + len(values["position"]))
            largest, smallest = self.comm.maximum([digest, -digest]).tolist()
            if largest != -smallest:
                raise SceneError(
                    "add_grains: the ranks gave different grains; every rank must give the same list (seed random numbers), "
                    "or each its own part with add_part"
                )

    def _add(self, given, total, values):
        """Take up those of the grains with these numbers that are in this rank's part of space; returns how many are."""
        position = values["position"]
        own = self.topology.owner(position) == self.comm.rank if len(position) else np.zeros(0, dtype=bool)
        chosen = {"id": self.next_id + given[own]}
        for name, value in values.items():
            chosen[name] = self._column(name, value, len(position))[own]
        self.begin_change()
        self.grains.append(chosen)
        self._rows = ContactRows.join([self._rows, ContactRows.empty(int(own.sum()), self.law.history_width)])
        self.next_id += total
        self._primed = False
        return int(own.sum())

    def _material_numbers(self, material):
        """Number of a material, or of each in a list of names and numbers."""
        if np.ndim(material) == 0:
            return self.materials.index(material.item() if isinstance(material, np.ndarray) else material)
        given = material.tolist() if isinstance(material, np.ndarray) else list(material)
        try:
            number = {one: self.materials.index(one) for one in dict.fromkeys(given)}
        except TypeError:
            raise SceneError(
                f"add_grains: material = {shown(material)} must be a name, a number, or one for each grain"
            ) from None
        return [number[one] for one in given]

    def _shaped(self, count, radius, material, fields):
        radius = self._column("radius", radius, count)
        if "mass" in fields:
            mass = self._column("mass", fields["mass"], count)
        else:
            densities = [one.density for one in self.materials.list]
            light = [self.materials.list[number].name for number in np.unique(material) if densities[number] is None]
            if light:
                raise SceneError(f"add_grains: material '{light[0]}' has no density; give it one, or give mass")
            mass = self.shape.mass(radius, np.array(densities, dtype=np.float64)[material])
        return {"radius": radius, "mass": mass, "inertia": self.shape.inertia(mass, radius)}

    def _column(self, name, value, count):
        if name not in {field.name for field in self.grains.table}:
            raise SceneError(f"add_grains: no field '{name}'; {nearest(name, [field.name for field in self.grains.table])}")
        field = self.grains.field(name)
        shape = (count, field.width) if field.width > 1 else (count,)
        try:
            return np.array(np.broadcast_to(np.asarray(value, dtype=field.dtype), shape))
        except (ValueError, TypeError, OverflowError) as error:
            raise SceneError(f"add_grains: {name} = {shown(value)} does not fit {count} grains: {error}") from None

    def add_field(self, name, width=1, dtype=np.float64, default=0, dimension="1"):
        """Give every grain a field of your own: it migrates, is saved, and can be read and written like any other.

        Args:
            name: a Python identifier that is no field yet.
            width: numbers for each grain; more than one makes the field (n, width).
            dtype: type of numbers, such as ``numpy.float64``.
            default: value of the grains of now and of those added without one.
            dimension: such as "length" or "force/length^2".

        Raises:
            SceneError: naming what cannot be used.
        """
        self.begin_change()
        self.grains.add_field(name, width, dtype, default, dimension)

    def add_wall(self, wall):
        """Add a wall; returns it. It touches every grain that is not frozen.

        Raises:
            SceneError: it is no wall, or is in a scene already, this one or another.
        """
        if not isinstance(wall, Wall):
            raise SceneError(f"add_wall: {shown(wall)} is no wall; give a barchan.Plane, Cylinder, Sphere, Cone or Mesh")
        if wall.key:
            raise SceneError(f"add_wall: this {wall.kind} is wall {wall.number} of a scene already; make another one")
        self._admit(wall, len(self.walls))
        wall.admit(self.loads, len(self.walls), -1 - sum(other.patches for other in self.walls))
        self.begin_change()
        self.walls.append(wall)
        self._primed = False
        return wall

    def _admit(self, wall, number):
        """Check a wall that is new or was edited."""
        wall.material = self.materials.index(wall.material)
        wall.check(self.box, f"wall {number} ({wall.kind})")
        wall.settle()
        wall.edited = False

    def remove(self, ids):
        """Take grains out of the scene for good.

        Args:
            ids: of the grains; on several ranks each may name all of them or only its own.

        Raises:
            SceneError: an id belongs to no grain of the scene.
        """
        chosen = self._chosen(ids)
        staying = np.flatnonzero(~chosen)
        if self.bonds.active:  # both owners of a bond have to know
            self.bonds.forget(np.concatenate(self.comm.all_gather(self.grains.view("id")[chosen])))
        self._rows = self._rows.take(staying)
        self.grains.keep(staying)
        self._primed = False

    def install_bonds(self, overlap=0.0, among=None, kind=0, strength=1.0):
        """Bond pairs of grains that overlap by more than ``overlap`` and are not bonded yet. All ranks must call this.

        Args:
            overlap: [length]; below 0 grains are bonded that are nearer than that without touching.
            among: (k,) ids: only pairs of which both are among them; of several ranks each may name all of them or only its own.
            kind: name or number of the kind of bond.
            strength: how much stronger than their kind the bonds are: a number, or a function of the ids (k,) of both grains,
                such as ``barchan.bonds.Weibull(modulus, seed)``, that returns (k,) numbers.

        Returns:
            How many bonds were installed, on all ranks.

        Raises:
            SceneError: there is no such kind or no such grain, an argument cannot be used, or the scene cannot be run; nothing
                was bonded.
        """
        if among is not None:
            among = np.concatenate(self.comm.all_gather(self.grains.view("id")[self._chosen(among)]))
        count = install(self, overlap, among, kind, strength)
        self._primed = self._primed and not count
        return count

    def freeze(self, ids):
        """Make grains immobile: infinitely heavy in contacts, at rest. Takes and raises what ``remove`` does."""
        self._set_frozen(ids, True)

    def release(self, ids):
        """Let frozen grains move again. Takes and raises what ``remove`` does."""
        self._set_frozen(ids, False)

    def _chosen(self, ids):
        """Which owned grains are meant, once the list is put away."""
        self.begin_change()
        ids = np.atleast_1d(ids)
        if len(ids) and ids.dtype.kind not in "iu":
            raise SceneError(f"ids = {ids[:5].tolist()} ... must be whole numbers (a mask goes through grains.id[mask])")
        own, meant = self.grains.view("id"), np.unique(ids.astype(np.int64))
        of_others = np.unique(np.concatenate(self.comm.all_gather(meant[~np.isin(meant, own)])))  # none, if each names its own
        known = np.concatenate(self.comm.all_gather(own[np.isin(own, of_others)]))
        unknown = np.setdiff1d(of_others, known)
        if len(unknown):
            raise SceneError(f"no grain has id {unknown[:5].tolist()}; {len(unknown)} that were named are not in the scene")
        return np.isin(own, meant) | np.isin(own, of_others)

    def _set_frozen(self, ids, frozen):
        chosen = self._chosen(ids)
        self.grains.view("frozen")[chosen] = frozen
        if frozen:
            for name in ("velocity", "omega"):
                self.grains.view(name)[chosen] = 0.0
        self.grains.refresh_inverse()
        self._primed = False

    @property
    def reads(self):
        """Fields of a ghost that forces need fresh in every step."""
        return self.law.reads if not self.bonds.active else ("position", "velocity", "omega")

    @property
    def is_listed(self):
        """True while there is a neighbour list; otherwise contact memory lies in ``put_away_rows``."""
        return self._listed

    @property
    def is_primed(self):
        """True if forces belong to the present positions."""
        return self._primed

    @property
    def put_away_rows(self):
        """Contact memory as rows of the grains, while there is no neighbour list."""
        return self._rows

    def _refuse_if_torn(self):
        """Refuse to go on after a rebuild that was broken off: what the contacts remember is lost.

        Raises:
            SceneError: there was one.
        """
        if self._torn:
            raise SceneError(
                "finding the neighbours was broken off by an error, which lost the memory of contacts; "
                "restore a checkpoint, or make the scene anew"
            )

    def begin_change(self):
        """Take up what users wrote into fields, and put the neighbour list away; the next run makes it anew."""
        self._refuse_if_torn()
        self.note_edits(self.grains.take_edits())
        self._take_down_list()

    def note_edits(self, edited):
        """Derive what depends on edited fields and on walls that users changed; True if forces must be computed anew."""
        if "position" in edited:
            folded, image = self.box.wrap(self.grains.view("position"))
            self.grains.view("position")[...] = folded
            self.grains.view("image")[...] += image
        if is_physical(edited):
            self.grains.refresh_inverse()
        walls = [number for number, wall in enumerate(self.walls) if wall.edited]
        if is_physical(edited) or walls:
            self._primed = False  # whatever a wall's check says
        for number in walls:
            self._admit(self.walls[number], number)
        return is_physical(edited) or bool(walls)

    def _take_down_list(self):
        """Contact memory to rows of the grains, of a pair the one with the smaller id; ghosts dropped."""
        if self._listed:
            self.loads.keep()
            self._rows = self.contacts.detach(np.ones(self.grains.n, dtype=bool), on_both=False)
            self.grains.drop_ghosts()
            self._listed = False


def _wrapped(number):
    """A whole number as 64 bits hold a sum that went over."""
    return (number + 2**63) % 2**64 - 2**63


def _ascend(numbers, total):
    """Whether numbers are in order, none twice, and none outside."""
    inside = not len(numbers) or (numbers[0] >= 0 and numbers[-1] < total)
    return bool(inside and (np.diff(numbers.astype(np.int64)) > 0).all())
