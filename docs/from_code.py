"""Parts of pages that are made from the code: in a page the line ``<!-- laws -->`` is replaced by ``laws()``, and so on."""

import typer

from barchan import units
from barchan.cli import app
from barchan.experiments.avalanche.parameters import PAPER, Avalanche
from barchan.experiments.bender import Bender
from barchan.experiments.bond import BondTest
from barchan.experiments.column import Column
from barchan.experiments.compression import parameters as compression
from barchan.experiments.drum import Drum
from barchan.experiments.oedometer import Oedometer
from barchan.experiments.repose import Repose
from barchan.experiments.rock import Rock
from barchan.experiments.shear import Shear
from barchan.experiments.silo import Silo
from barchan.laws import SHIPPED

_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}


def setup(sphinx):
    """Make this module an extension of Sphinx."""
    sphinx.connect("source-read", _fill)
    sphinx.connect("autodoc-process-docstring", _keep_colons, priority=400)  # before napoleon, whose is 500
    sphinx.connect("autodoc-skip-member", _skip)
    return {"parallel_read_safe": True}


def commands():
    """Every command with its arguments and options."""
    command = typer.main.get_command(app)
    return _lines(_command(command, command.make_context("barchan", [], resilient_parsing=True)))


def parameters(scene=Avalanche, paper=PAPER):
    """The parameters of a scene as a table.

    Args:
        scene: a ``Scene`` class.
        paper: parameter -> value in the paper, in the unit of the parameter; None where there is no paper.
    """
    head, rows = ["parameter", "default", "allowed", "meaning"], []
    for name, field in scene.model_fields.items():
        rows.append([f"`{name}`", _value(field, field.default), _allowed(field), field.description])
        if paper is not None:
            rows[-1].insert(3, _value(field, paper.get(name)))
    return _table([*head[:3], "in the paper", head[3]] if paper is not None else head, rows)


def parameters_of_repose():
    """The parameters of the angle of repose as a table."""
    return parameters(Repose, None)


def parameters_of_compression():
    """The parameters of the compression test as a table."""
    return parameters(compression.Compression, compression.PAPER)


def parameters_of_oedometer():
    """The parameters of the oedometer as a table."""
    return parameters(Oedometer, None)


def parameters_of_bender():
    """The parameters of the waves through a sample as a table."""
    return parameters(Bender, None)


def parameters_of_bond():
    """The parameters of the test of a bond as a table."""
    return parameters(BondTest, None)


def parameters_of_rock():
    """The parameters of the rock as a table."""
    return parameters(Rock, None)


def parameters_of_shear():
    """The parameters of simple shear as a table."""
    return parameters(Shear, None)


def parameters_of_silo():
    """The parameters of the discharge of silos as a table."""
    return parameters(Silo, None)


def parameters_of_column():
    """The parameters of the collapse of columns as a table."""
    return parameters(Column, None)


def parameters_of_drum():
    """The parameters of a turning drum as a table."""
    return parameters(Drum, None)


def laws():
    """The laws that come with barchan as a table."""
    rows = (
        (f"`{name}`", law.__doc__.strip().splitlines()[0], ", ".join(f"`{name}`" for name in law.properties))
        for name, law in SHIPPED.items()
    )
    return _table(("law", "what it is", "properties of a material"), rows)


def _fill(sphinx, page, source):
    scenes = (parameters_of_bond, parameters_of_compression, parameters_of_oedometer, parameters_of_repose, parameters_of_rock)
    scenes += (parameters_of_silo, parameters_of_column, parameters_of_bender, parameters_of_drum, parameters_of_shear)
    parts = (commands, parameters, *scenes, laws)
    for part in parts:
        source[0] = source[0].replace(f"<!-- {part.__name__} -->", part())


def _keep_colons(sphinx, what, name, thing, options, lines):
    """napoleon takes what stands before a colon in the first line on an attribute for its type; an empty comment keeps it off."""
    if what in ("attribute", "data", "property"):
        lines[:0] = ["..", ""]


def _skip(sphinx, what, name, thing, skip, options):
    """Leave out what Python itself says about the fields of a NamedTuple."""
    return True if (getattr(thing, "__doc__", None) or "").startswith("Alias for field number") else None


def _command(command, context):
    """A command and those below it."""
    below = getattr(command, "commands", {})
    if not below:
        usage, path = context.get_usage().removeprefix("Usage: "), context.command_path
        if command.hidden:  # it is what "barchan run my.toml" means
            usage, path = "barchan run FILE.toml [OPTIONS]", "barchan run FILE.toml"
        yield from (f"## `{path}`", "", command.help, "", "```text", usage, "```", "")
        rows = [(f"`{names}`", _plain(text)) for names, text in (p.get_help_record(context) for p in command.params)]
        yield from ((_table(("argument", "meaning"), rows), "") if rows else ())
    for name, other in below.items():
        yield from _command(other, type(context)(other, info_name=name, parent=context))


def _table(head, rows):
    return _lines(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def _lines(lines):
    return "\n".join(lines)


def _plain(text):
    """Text in which Markdown sees no markup."""
    return "".join(f"\\{sign}" if sign in "|<>[]*_`" else sign for sign in text)


def _value(field, value):
    unit = (field.json_schema_extra or {}).get("unit")
    return "" if value is None else str(value) if unit is None else units.written(value, unit)


def _allowed(field):
    bounds = [f"{_SIGNS[name]} {getattr(rule, name):g}" for rule in field.metadata for name in _SIGNS if hasattr(rule, name)]
    return ", ".join(bounds or getattr(field.annotation, "__args__", ()))
