"""Grains as text files that OVITO opens and LAMMPS' ``read_dump`` reads."""

from barchan.parallel.files import write_bytes
from barchan.writers.collect import grains_at_full_step
from barchan.writers.output import StepFiles

#: Columns of the fields that are vectors, as LAMMPS calls them.
_VECTORS = {
    "position": ("x", "y", "z"),
    "image": ("ix", "iy", "iz"),
    "velocity": ("vx", "vy", "vz"),
    "omega": ("omegax", "omegay", "omegaz"),
    "force": ("fx", "fy", "fz"),
}


class LammpsDump(StepFiles):
    """A writer: LAMMPS dump files, ``grains_<step>.dump``, one a step. OVITO opens them as ``grains_*.dump``.

    Atoms and types are numbered from 1, as LAMMPS demands: ``id`` is the id of the grain + 1, ``type`` its material + 1.
    Columns: id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass, velocities at the full step n.
    Numbers are written with as many digits as they have. 100,000 grains: 0.7 s, 29 MB.

    Args:
        directory: where; made if it does not exist.
        due: trigger, a function of the step.
    """

    kind, suffix = "grains", "dump"

    def collect(self, sim):
        """Column name -> values, by ascending id."""
        fields = grains_at_full_step(sim)
        columns = {"id": fields["id"] + 1, "type": fields["material"] + 1}
        for name, axes in _VECTORS.items():
            columns |= zip(axes, fields[name].T)
        return columns | {"radius": fields["radius"], "mass": fields["mass"]}

    def put(self, path, content, sim):
        """Write the file."""
        rows = zip(*(map(repr, column.tolist()) for column in content.values()))
        text = "".join(f"{line}\n" for line in map(" ".join, rows))
        count = int(sim.comm.sum([len(content["id"])])[0])
        if sim.comm.rank == 0:
            text = _head(sim, content, count) + text
        write_bytes(sim.comm, path, text.encode("ascii"))


def _head(sim, columns, count):
    thick = 0.5 * (sim.box.span - sim.box.length)  # LAMMPS wants a box of two dimensions to have a height
    low, high, periodic = (sim.box.low - thick).tolist(), (sim.box.high + thick).tolist(), sim.box.periodic
    faces = " ".join("pp" if wraps else "ff" for wraps in periodic)
    tilt, name = sim.box.tilt.tolist(), ""
    if any(tilt):  # LAMMPS gives the box around the leaning one, and then the tilts
        xy, xz, yz = tilt
        low = [low[0] + min(0.0, xy, xz, xy + xz), low[1] + min(0.0, yz), low[2]]
        high = [high[0] + max(0.0, xy, xz, xy + xz), high[1] + max(0.0, yz), high[2]]
        name = "xy xz yz "
    bounds = "".join(f"{a!r} {b!r}{f' {aside!r}' if name else ''}\n" for a, b, aside in zip(low, high, tilt))
    return (
        f"ITEM: TIME\n{sim.time!r}\nITEM: TIMESTEP\n{sim.step_number}\nITEM: NUMBER OF ATOMS\n{count}\n"
        f"ITEM: BOX BOUNDS {name}{faces}\n{bounds}ITEM: ATOMS {' '.join(columns)}\n"
    )
