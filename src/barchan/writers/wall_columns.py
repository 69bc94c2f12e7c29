"""What walls tell, as columns of a table."""

from barchan.errors import OutputError
from barchan.walls.wall import Wall
from barchan.words import shown


def wall_columns(walls):
    """Columns for a ``Table``: where walls are, how they move, and what grains do to them.

    Args:
        walls: name -> a wall of the scene.

    Returns:
        A function of the simulation that returns, for a wall "top", ``top x [m]``, ``top velocity x [m/s]``,
        ``top force x [N]``, ``top torque x [N m]``, the same for y and z, ``top pressing [N]`` and ``top contacts``, and of a
        cylinder or sphere ``top radius [m]`` and ``top radial velocity [m/s]``: what ``Wall`` says of them. Join it with columns
        of your own by ``|``.

    Raises:
        OutputError: something else than walls with names was given.
    """
    if not (isinstance(walls, dict) and walls and all(isinstance(wall, Wall) for wall in walls.values())):
        raise OutputError(f"wall_columns: walls = {shown(walls)} must be a dict of names and walls, such as {{'top': top}}")

    def columns(sim):
        return {f"{name} {what}": value for name, wall in walls.items() for what, value in _told(wall)}

    return columns


def _told(wall):
    """Pairs of column and number."""
    load = wall.load
    vectors = (
        ("", wall.point, "m"),
        ("velocity ", wall.velocity, "m/s"),
        ("force ", load.force, "N"),
        ("torque ", load.torque, "N m"),
    )
    for what, vector, unit in vectors:
        for axis, number in zip("xyz", vector):
            yield f"{what}{axis} [{unit}]", float(number)
    yield "pressing [N]", wall.pressing
    yield "contacts", load.contacts
    for name, unit in (("radius", "m"), ("radial_velocity", "m/s")):
        if hasattr(wall, name):
            yield f"{name.replace('_', ' ')} [{unit}]", getattr(wall, name)
