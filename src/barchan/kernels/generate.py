"""Makes the loops of a law: writes a module with a copy of the law and its helpers, and imports it.

A loop that closes over compiled functions is never found again in Numba's disk cache (measured: 1.0 s again in every
process, against 0.004 s for a module on disk). So the module is real text, named by the hash of that text and of the
kernels' sources, written once and atomically.
"""

import ast
import builtins
import hashlib
import importlib.util
import inspect
import math
import os
import sys
import textwrap
import types
from typing import NamedTuple

import numpy as np

from barchan.errors import LawError
from barchan.kernels.compiler import cache_root, fingerprint
from barchan.kernels.energies import ENERGIES
from barchan.kernels.lanes import LANES
from barchan.kernels.steps import COUPLES, COUPLES_IMPORT, STEPS
from barchan.kernels.template import ARMS, AT_LEAST, BLOCK, FIND, FIND_HELD, HELD, MODULE
from barchan.laws.law import MOST_CURVED

_NUMBERS = (bool, int, float, np.bool_, np.integer, np.floating)

#: Names of the generated module that a law must not bring along.
_OF_CONTACTS = {"helper", "kernel", "on_one_thread", "prange", "pair_forces", "wall_forces", "widest_lanes"}
_RESERVED = frozenset(_OF_CONTACTS | {"bond_forces", "carried", "spun"})


class Loops(NamedTuple):
    """The compiled loops of a law; ``energies`` is None if it does not tell them."""

    pair_forces: object
    wall_forces: object
    advance: object
    energies: object
    module: types.ModuleType


class Sources:
    """A function and all plain functions and constants that it uses, as text in the order of definition."""

    def __init__(self, law):
        self.law, self.names, self.imports, self.parts = law, {}, [], []
        self.root = self._add(law.function.__name__, law.function)
        self.reach = law.reach and self._add(law.reach.__name__, law.reach)
        self.energy = law.energy and self._add(law.energy.__name__, law.energy)

    def _fail(self, text):
        raise LawError(f"{self.law.kind} '{self.law.name}': {text}")

    def _add(self, name, value):
        if name in _RESERVED or name.startswith("barchan_"):
            self._fail(f"it uses the name '{name}', which the loop around it needs; rename it")
        if name in self.names:
            if self.names[name] is not value and self.names[name] != value:
                self._fail(f"two different things are called '{name}' in the files it uses; rename one")
            return name
        self.names[name] = value
        if isinstance(value, types.FunctionType):
            self._add_function(name, value)
        elif getattr(value, "__module__", None) == "math":
            self.imports.append(f"from math import {value.__name__} as {name}")
        elif value is math:
            self.imports.append(f"import math as {name}")
        elif isinstance(value, _NUMBERS) or (isinstance(value, tuple) and all(isinstance(v, _NUMBERS) for v in value)):
            self.parts.append(f"{name} = {_literal(value)}")
        else:
            self._fail(f"it uses '{name}' = {value!r}; a law may use numbers, tuples of numbers, plain functions and math")
        return name

    def _add_function(self, name, function):
        try:
            if function.__name__ == "<lambda>":
                self._fail(f"'{name}' must be a plain function (def), not a lambda")
            tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        except (OSError, TypeError, SyntaxError) as error:
            self._fail(f"the source of '{name}' cannot be read ({error}); define it in a file or a notebook cell")
        definition = tree.body[0]
        if not isinstance(definition, ast.FunctionDef):
            self._fail(f"'{name}' must be a plain function (def), not a lambda")
        definition.decorator_list, definition.name = [], name
        for used in _global_names(definition):
            found, value = _resolve(function, used)
            if found:
                self._add(used, _plain(value))
            elif not hasattr(builtins, used):
                self._fail(f"'{used}' in '{name}' is not defined")
        self.parts.append("@helper\n" + ast.unparse(definition) + "\n")


def _literal(value):
    """Source text of a number or a tuple of numbers, whatever made it."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_literal, value))},)"
    if isinstance(value, (bool, int, np.bool_, np.integer)):
        return repr(value.item() if isinstance(value, np.generic) else value)
    return repr(float(value)) if math.isfinite(value) else f'float("{float(value)}")'


def _plain(value):
    """A law or a compiled function as the plain function in it."""
    return getattr(value, "py_func", getattr(value, "function", value))


def _global_names(definition):
    """Names that a function reads and does not bind itself, in order of appearance."""
    bound = {a.arg for a in ast.walk(definition) if isinstance(a, ast.arg)}
    bound |= {n.id for n in ast.walk(definition) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    read = [n.id for n in ast.walk(definition) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
    return [name for name in dict.fromkeys(read) if name not in bound]


def _resolve(function, name):
    free = dict(zip(function.__code__.co_freevars, function.__closure__ or ()))
    if name in free:
        return True, free[name].cell_contents
    return name in function.__globals__, function.__globals__.get(name)


def flat_names(name, width):
    """Names of the numbers that a piece of memory is, in the module."""
    return [f"m_{name}"] if width == 1 else [f"m_{name}_{axis}" for axis in "xyz"]


def module_text(law, uniform):
    """Text of the module with the loops of ``law``; ``uniform``: all contacts are of one pair of materials.

    Parameters and memory are called p_name and m_name there, so that no name of a user's meets one of the loops'.
    """
    sources = Sources(law)
    parameters = [f"p_{name}" for name in law.parameters]
    history = {name: flat_names(name, width) for name, width in law.history.items()}
    memory = [flat for names in history.values() for flat in names]
    returned = [
        f"new_{name}[{c}]" if len(names) == 3 else f"new_{name}" for name, names in history.items() for c in range(len(names))
    ]
    given = {name: as_tuple(names) for name, names in history.items()}
    given |= {name: f"p_{name}" for name in law.parameters}
    given["relative_omega"] = "(wix - wjx, wiy - wjy, wiz - wjz)"
    arguments = [f"{a}={given.get(a, a)}" for a in inspect.signature(law.function).parameters]
    hoisted = [f"{p} = table[{row}, 0]" for row, p in enumerate(parameters)]
    looked_up = [f"{p} = table[{row}, pair]" for row, p in enumerate(parameters)]
    forces = [f"out[{row}, k] = {name}" for row, name in enumerate(("fx", "fy", "fz", "ax", "ay", "az"))]
    new = [f"{flat} if dt > 0.0 else history[{row}, old]" for row, flat in enumerate(memory)]
    kept = [f"fresh[p, {row}, c] = {value}" for row, value in enumerate(new)]
    kept_at_wall = [f"fresh[{row}, c] = {value}" for row, value in enumerate(new)]
    moved = ["for e in range(count):", *(f"    history[{row}, home + e] = fresh[p, {row}, e]" for row in range(len(memory)))]
    moved_at_wall = [
        "for e in range(barchan_np.uint64(grain.shape[0])):",
        *(f"    history[{row}, home + e] = fresh[{row}, e]" for row in range(len(memory))),
    ]
    read = [f"history[{row}, old]" for row in range(len(memory))]
    arm_first, arm_second, wall_arm = ARMS[law.lever]
    lens = law.lever == "lens"
    arms, arm_at_wall = ["out[6, k] = arm_i", "out[7, k] = arm_j"] * lens, [f"out[6, k] = {wall_arm}"] * lens
    couple = ["cx", "cy", "cz"] if law.couple else []
    couples = [f"out[{6 + 2 * lens + row}, k] = {name}" for row, name in enumerate(couple)]
    names_of_results = {"normal_force": "pressing", "tangential_force": "tangential", "couple": "barchan_couple"}
    shallow, deep, deepest = "\n    ", "\n        ", "\n                "
    text = MODULE.format(
        law=law.name,
        **_held(law, sources.reach, looked_up),
        block=BLOCK,
        lanes=LANES,
        function=sources.root,
        arm_first=arm_first,
        arm_second=arm_second,
        wall_arm=wall_arm,
        imports="\n".join(["from math import sqrt as barchan_sqrt", *[COUPLES_IMPORT] * law.couple, *sources.imports]),
        functions="\n".join(sources.parts),
        flat_inputs=", ".join([*parameters, *memory]),
        arguments=", ".join(arguments),
        outputs=", ".join(names_of_results.get(name, f"new_{name}") for name in law.returns),
        flat_history="".join(f", {r}" for r in [*(f"barchan_couple[{c}]" for c in range(len(couple))), *returned]),
        history_names="".join(f", {n}" for n in [*couple, *memory]),
        flat_arguments=", ".join([*parameters, *read]),
        keep=deepest.join([*forces, *arms, *couples, *kept]),
        keep_at_wall=deep.join([*forces, *arm_at_wall, *couples, *kept_at_wall]),
        keep_fresh="\n            ".join(moved) if memory else "pass",
        keep_fresh_at_wall=shallow.join(moved_at_wall) if memory else "pass",
        hoisted=(shallow.join(hoisted) or "pass") if uniform else "pass",
        gathered="pass" if uniform else deepest.join(["pair = material[i] * stride + material[j]", *looked_up]),
        wall_gathered="pass" if uniform else deep.join(["pair = material[i] * stride + wall_material[c]", *looked_up]),
    )
    return text + STEPS.format(couples=COUPLES if law.couple else "") + energies_text(law, sources.energy, ENERGIES, "pair")


def _held(law, reach, looked_up):
    """What the template says of contacts that last beyond touching."""
    if law.reach is None:
        return {"held": "", "at_least": AT_LEAST, "find": FIND, "touches": "overlap > 0.0"}
    given = {name: f"p_{name}" for name in law.parameters}

    def call(radius_eff):
        return f"{reach}({', '.join(f'{name}={given.get(name, radius_eff)}' for name in law.reach_arguments)})"

    at_wall = f"min(ri / (1.0 + surface[10, c] * ri), {MOST_CURVED} * ri)"
    parameters = "\n            ".join(["pair = material[i] * stride + material[j]", *looked_up])
    return {
        "held": HELD.format(parameters=parameters, reach=call("ri * rj / (ri + rj)")),
        "at_least": "",
        "find": FIND_HELD,
        "touches": f"overlap > 0.0 or (was and overlap > -{call(at_wall)})",
    }


def as_tuple(names):
    """Source text of a number or a vector."""
    return names[0] if len(names) == 1 else f"({', '.join(names)})"


def energies_text(law, energy, template, column):
    """The loop that says what contacts, or bonds, store; none if the law does not tell.

    Args:
        energy: name of the law's function.
        template: text of the loop over c.
        column: name of the array of columns in the table of parameters.
    """
    if law.energy is None:
        return ""
    given, row = {name: f"{name}[c]" for name in law.stored_in}, 0
    given |= {name: f"table[{number}, {column}[c]]" for number, name in enumerate(law.parameters)}
    for name, width in law.history.items():
        given[name] = as_tuple([f"memory[{row + k}, c]" for k in range(width)])
        row += width
    arguments = ", ".join(f"{name}={given[name]}" for name in inspect.signature(law.energy).parameters)
    return template.format(call=f"{energy}({arguments})")


def make_loops(law, uniform):
    """The compiled loops of ``law``, from the cache if they were ever made on this machine.

    Args:
        law: a ``Law``.
        uniform: True when the scene has a single material, whose parameters then stay in registers.

    Raises:
        LawError: the law's source cannot be read, or it uses something that cannot be compiled with it.
    """
    module = imported(f"barchan_law_{law.name}", module_text(law, uniform))
    energies = getattr(module, "barchan_energies", None)
    return Loops(module.pair_forces, module.wall_forces, module.barchan_advance, energies, module)


def imported(name, text):
    """The module of a text, from the cache if it was ever made on this machine.

    Args:
        name: to which a hash is added.
    """
    digest = hashlib.sha256((fingerprint() + text).encode()).hexdigest()[:20]
    name = f"{name}_{digest}"
    if name not in sys.modules:
        path = cache_root() / fingerprint() / f"{name}.py"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_suffix(f".{os.getpid()}.tmp")
            partial.write_text(text)
            os.replace(partial, path)
        spec = importlib.util.spec_from_file_location(name, path)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]
