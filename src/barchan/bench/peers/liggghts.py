"""LIGGGHTS, an old LAMMPS with laws of its own, from Debian: told through a pipe what to do, as it has no library to call.

It sleeps while it waits for the pipe. On several MPI ranks all but the first would wait inside MPI, and spin: it runs on one.

Its ``stiffness`` models with ``tangential history`` are the laws of the cases but for three things: grains turn about their
distance to the contact, half an overlap less than the radius; a contact that slides has no tangential damping; and Coulomb's
limit leaves that damping out.
"""

import re
import shutil
import subprocess
from itertools import repeat

import numpy as np

from barchan import atomic
from barchan.bench.peers.lammps import motion, write_data
from barchan.bench.peers.peer import Peer, driver, of_debian

#: Said by LIGGGHTS when it has done all it was told.
DONE = "barchan: done"

#: What it writes of each grain.
COLUMNS = "id x y z vx vy vz omegax omegay omegaz"


def find(threads, ranks):
    """One row."""
    if shutil.which("liggghts") is None:
        return [of_debian("liggghts", "liggghts")]
    return [Peer("liggghts", driver("liggghts", 1), same_law=False)]


class Engine:
    """Runs a case; see ``barchan.bench.serving``. Every set-up is a new process.

    Args:
        threads: it has none.
        home: folder for data files.
    """

    rank = 0

    def __init__(self, threads, home):
        self.home, self.version, self.process = home, None, None

    def set_up(self, case, skin):
        """Start anew."""
        if self.process is not None:
            self.process.communicate()  # closes the pipe, which ends it
        data = self.home / f"liggghts-{case.count}.data"
        if not data.exists():
            with atomic.writing(data) as partial:
                write_data(partial, case.low, case.high, *case.grains[:5], kind=1 + case.grains.frozen)
                partial.write_text(partial.read_text().replace("Atoms # sphere", "Atoms", 1))
        pipes = dict(stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        command = ["stdbuf", "-oL", "liggghts", "-log", "none"]  # else it would keep what it says until it has said much
        self.process, self.forced = subprocess.Popen(command, **pipes), False
        self.version = re.search(r"LIGGGHTS-PUBLIC [\d.]+", self.tell(script(case, data, skin)))[0]

    def tell(self, commands):
        """Give commands, wait until they are done; returns what LIGGGHTS said."""
        self.process.stdin.write(f'{commands}\nprint "{DONE}"\n')
        self.process.stdin.flush()
        said = []
        for line in iter(self.process.stdout.readline, ""):
            if line.strip() == DONE:
                return "".join(said)
            said.append(line)
        raise RuntimeError(f"LIGGGHTS ended: {' '.join(said[-3:])}")

    def run(self, steps, forced):
        """Advance; returns (seconds, rebuilds)."""
        if forced != self.forced:
            self.tell(f"neigh_modify every 1 delay 0 check {'no' if forced else 'yes'}\nrun 0 post no")
            self.forced = forced
        (_, before), (seconds, after) = map(self.timed, (0, steps))
        return seconds, after - before

    def timed(self, steps):
        """Advance; returns (seconds, rebuilds since the last set-up), which LIGGGHTS says after every run."""
        said = self.tell(f"run {steps} pre no")
        return float(re.search(r"Loop time of (\S+)", said)[1]), int(re.search(r"Neighbor list builds = (\d+)", said)[1])

    def observe(self):
        """The present state, at the full step."""
        path, numbers = self.home / "liggghts.dump", " ".join(["%d", *repeat("%.17g", 9)])
        self.tell(f'write_dump all custom {path} {COLUMNS} modify sort id format "{numbers}"')
        values = np.loadtxt(path, skiprows=9, ndmin=2)
        path.unlink()
        return {name: values[:, first : first + 3] for name, first in (("position", 1), ("velocity", 4), ("omega", 7))}


def script(case, data, skin):
    """LIGGGHTS' input for a case, up to its first force."""
    model = f"model {case.law}/stiffness tangential history"
    boundary = " ".join("p" if periodic else "s" for periodic in case.periodic)
    lines = [
        f"units lj\natom_style sphere\nboundary {boundary}\nnewton off\ncommunicate single vel yes\nread_data {data}",
        f"neighbor {skin * case.diameter:.17g} bin\nneigh_modify every 1 delay 0\ntimestep {case.dt:.17g}",
    ]
    kinds = 1 + int(case.grains.frozen.any())
    for name, value in zip(("kn", "kt", "gamman", "gammat", "coefficientFriction"), case.constants):
        pairs = " ".join([f"{value:.17g}"] * kinds**2)
        lines.append(f"fix {name} all property/global {name} peratomtypepair {kinds} {pairs}")
    lines.append(f"pair_style gran {model}\npair_coeff * *")
    lines += motion(case)
    if case.floor is not None:
        lines.append(f"fix floor all wall/gran {model} primitive type 1 zplane {case.floor:.17g}")
    return "\n".join([*lines, "thermo_style custom step\nthermo 0\nrun 0 post no"])
