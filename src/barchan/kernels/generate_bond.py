"""Makes the loop of a bond law, as ``generate.py`` makes those of a contact law."""

import inspect
import types
from typing import NamedTuple

from barchan.kernels.bond_template import BLOCK, BOND_ENERGIES, BOND_MODULE, NO_MODE, NOT_FINITE, TOO_LONG
from barchan.kernels.generate import Sources, as_tuple, energies_text, flat_names, imported
from barchan.laws.bond import RETURNED
from barchan.laws.law import VECTOR


class BondLoops(NamedTuple):
    """The compiled loops of a bond law; ``energies`` is None if it does not tell them."""

    bond_forces: object
    energies: object
    module: types.ModuleType


def make_bond_loops(law, uniform):
    """The compiled loops of a ``BondLaw``, from the cache if they were ever made on this machine.

    Args:
        uniform: all bonds are of one kind, whose properties then stay in registers.

    Raises:
        LawError: the law's source cannot be read, or it uses something that cannot be compiled with it.
    """
    module = imported(f"barchan_bond_{law.name}", bond_module_text(law, uniform))
    return BondLoops(module.bond_forces, getattr(module, "barchan_energies", None), module)


def bond_module_text(law, uniform):
    """Text of the module with the loops of ``law``."""
    sources = Sources(law)
    parameters = [f"p_{name}" for name in law.parameters]
    history = {name: flat_names(name, width) for name, width in law.history.items()}
    memory = [flat for names in history.values() for flat in names]
    turned = [f"turned_{name} = spun(carried({as_tuple(history[name])}, barchan_then, normal), normal, spin)" for name in history]
    turned = [line for line, width in zip(turned, law.history.values()) if width == VECTOR]
    given = {f: f"turned_{f}" if width == VECTOR else history[f][0] for f, width in law.history.items()}
    given |= {name: f"p_{name}" for name in law.parameters}
    results = dict(zip(RETURNED, ("pressing", "tangential", "couple", "mode")))
    returned = [f"new_{f}[{c}]" if width == VECTOR else f"new_{f}" for f, width in law.history.items() for c in range(width)]
    forces = [f"out[{row}, k] = {name}" for row, name in enumerate(("fx", "fy", "fz", "ux", "uy", "uz", "wx", "wy", "wz"))]
    kept = [f"fresh[p, {row}, c] = {flat}" for row, flat in enumerate(memory)]
    moved = [f"history[{row}, k] = fresh[p, {row}, c] if holds else history[{row}, k]" for row in range(len(memory))]
    looked_up = [f"{p} = table[{row}, kind[k]]" for row, p in enumerate(parameters)]
    deepest = "\n                "
    text = BOND_MODULE.format(
        law=law.name,
        imports="\n".join(["from math import sqrt as barchan_sqrt", *sources.imports]),
        functions="\n".join(sources.parts),
        flat_inputs=", ".join([*parameters, *memory]),
        turned="\n    ".join(turned) or "pass",
        outputs=", ".join(results.get(name, f"new_{name}") for name in law.returns),
        function=sources.root,
        arguments=", ".join(f"{a}={given.get(a, a)}" for a in inspect.signature(law.function).parameters),
        flat_history="".join(f", {name}" for name in returned),
        history_names="".join(f", {name}" for name in memory),
        hoisted=("\n    ".join(f"{p} = table[{row}, 0]" for row, p in enumerate(parameters)) or "pass") if uniform else "pass",
        gathered="pass" if uniform else (deepest.join(looked_up) or "pass"),
        flat_arguments=", ".join([*parameters, *(f"history[{row}, k]" for row in range(len(memory)))]),
        keep=deepest.join([*forces, *kept]),
        keep_fresh=deepest.join(moved) or "pass",
        block=BLOCK,
        n_modes=len(law.modes),
        total=" + ".join(memory) or "0.0",
        no_mode=NO_MODE,
        too_long=TOO_LONG,
        not_finite=NOT_FINITE,
    )
    return text + energies_text(law, sources.energy, BOND_ENERGIES, "kind")
