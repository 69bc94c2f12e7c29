"""How grains have moved since they were marked, as a strain: the affine motion that fits theirs best."""

from typing import NamedTuple

import numpy as np

from barchan.errors import SceneError
from barchan.measure.base import flowing_rows
from barchan.measure.brick import Brick
from barchan.measure.sums import exact_sums

#: What a grain that ``barchan.actions.mark_places`` has marked keeps.
COLUMNS = ("x", "y", "z", "is marked")


class Strain(NamedTuple):
    """The affine motion of some grains. Strains are compression positive; H and F are not. In two dimensions tensors are (2, 2).

    ``gradient``: H, (3, 3), displacement along i by distance along j, as they were when marked: u = H X + c [1].
    ``grains``: how many it is of.
    """

    gradient: np.ndarray
    grains: int

    @property
    def deformation(self):
        """F = 1 + H, (3, 3) [1]."""
        return np.eye(len(self.gradient)) + self.gradient

    @property
    def small(self):
        """-(H + H^T) / 2, (3, 3) [1]: of small strains and small rotations only."""
        return -0.5 * (self.gradient + self.gradient.T)

    @property
    def green_lagrange(self):
        """-(F^T F - 1) / 2, (3, 3) [1]: of any size, along the axes of the reference; no rotation changes it."""
        H = self.gradient
        return -0.5 * (H + H.T + H.T @ H)

    @property
    def logarithmic(self):
        """-ln U with the stretch U of F = R U, Hencky's, (3, 3) [1]: of any size; those of steps along fixed axes add up."""
        squares, axes = np.linalg.eigh(self.deformation.T @ self.deformation)
        return -0.5 * (axes * np.log(squares)) @ axes.T

    @property
    def rotation(self):
        """R of F = R U, a rotation, (3, 3) [1]."""
        squares, axes = np.linalg.eigh(self.deformation.T @ self.deformation)
        return self.deformation @ (axes / np.sqrt(squares)) @ axes.T

    @property
    def volumetric_strain(self):
        """Trace of the logarithmic strain, -ln of the ratio of volumes [1]."""
        return float(np.trace(self.logarithmic))

    @property
    def deviatoric_strain(self):
        """sqrt(2/3 e:e) with the deviator e of the logarithmic strain, which works with q: in a triaxial test 2/3 of axial
        less radial strain; in two dimensions sqrt(1/2 e:e) [1]."""
        dimension = len(self.gradient)
        e = self.logarithmic - self.volumetric_strain / dimension * np.eye(dimension)
        return float(np.sqrt((e * e).sum() / (dimension / (dimension - 1))))


def strain(sim, reference="reference", low=None, high=None):
    """Strain of the grains since ``barchan.actions.mark_places``: the affine motion u = H X + c that fits the displacements u of
    those that are marked, there and not frozen best, by least squares, each grain counting alike.

    Displacements go on across periodic faces. Grains that came since, or left, do not count.
    Source: best fit: Falk and Langer, Phys. Rev. E 57, 7192 (1998); strains: Ogden, Non-linear Elastic Deformations (1984), 2.2.

    Args:
        reference: the name that was given to ``mark_places``.
        low, high: corners of a brick [length]: of the grains whose places were in it when marked; default: all.

    Returns:
        ``Strain``, the same bits for any number of ranks and threads.

    Raises:
        SceneError: nothing was marked under this name, the brick is no brick in the box, or the grains lie in a plane,
            in two dimensions on a line.
    """
    grains, brick = sim.grains, Brick(sim.box, low, high)
    if reference not in (field.name for field in grains.table) or not holds_places(grains.field(reference)):
        raise SceneError(
            f"strain: no places were marked under the name {reference!r}; call mark_places(sim, {reference!r}) first"
        )
    rows = flowing_rows(sim)
    rows = rows[grains.view(reference)[rows, 3] == 1.0]
    if low is not None or high is not None:
        rows = rows[brick.holds(sim.box.wrap(grains.view(reference)[rows, :3])[0])]
    place = grains.view(reference)[rows, :3]
    in_space = slice(sim.box.dimension)
    return _best_fit(sim.comm, place[:, in_space], (followed(sim)[rows] - place)[:, in_space], reference)


def holds_places(field):
    """Whether a field of the grains is one that ``barchan.actions.mark_places`` made."""
    return field.block == f"user_{field.name}" and (field.width, field.dimension) == (len(COLUMNS), "length")


def followed(sim):
    """Places of this rank's grains as if no face were periodic: all periods that each has crossed count, (n, 3) [length]."""
    return sim.box.unwrapped(sim.grains.view("position"), sim.grains.view("image"))


def _best_fit(comm, place, moved, reference):
    """The affine motion that fits displacements at places, (k, dimension) each, of all ranks."""
    dimension = place.shape[1]
    *sums, count = exact_sums([*place.T, *moved.T, np.ones(len(place))], comm)[:, 0]
    centre = np.array(sums) / max(count, 1.0)
    X, u = (place - centre[:dimension]).T, (moved - centre[dimension:]).T
    products = [a * b for one in (X, u) for a in one for b in X]
    inertia, motion = exact_sums(products, comm).reshape(2, dimension, dimension)
    extent = np.linalg.eigvalsh(inertia)
    if not extent[0] > 1e-12 * extent[-1]:
        flat, fewest = ("in a plane", "four") if dimension == 3 else ("on a line", "three")
        raise SceneError(
            f"strain: the {int(count)} grains marked as {reference!r} lie {flat}, or there are fewer than {fewest}; choose more"
        )
    return Strain(np.linalg.solve(inertia, motion.T).T, int(count))
