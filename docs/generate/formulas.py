"""What a law or an event does to each portrait, as formulas read out of its code."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import equinox as eqx
import numpy as np
import sympy

from docs.generate import markdown as md
from firstorder.checks.squares import Case, Step, by_rule
from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.symbolic import Derivation, Formula, UnknownField
from firstorder.symbolic._display import FEW, LONG, MANY, latex, size_of, waves_of
from firstorder.transport import Chain

# A portrait of `Derivation`, and what its formula is called: the light before is L.
PORTRAITS = {
    "value": "L'({coordinates})",
    "gradient": "\\nabla L'({coordinates})",
    "hessian": "\\nabla^2 L'({coordinates})",
    "spectrum": "\\hat{{L}}'({coordinates})",
    "covariance": "\\Sigma'",
}


def acts(case: Case) -> list[tuple[str, str]]:
    """Each portrait by name, with Markdown: its formula, or words why none is shown."""
    derivation = _derivation(case)
    found = [(portrait, _said(derivation, portrait)) for portrait in PORTRAITS]
    return [*found, ("wavelet", _wavelet(case))]


def parameters(case: Case) -> str:
    """The numbers that stand behind the symbols in the formulas, in words."""
    steps = case.step.events if isinstance(case.step, Chain) else (case.step,)
    named = {k: v for s in steps if _symbolic(s) is not s for k, v in _numbers(s).items()}
    return ", ".join(f"`{name} = {number:.6g}`" for name, number in named.items())


def _derivation(case: Case) -> Derivation:
    """Formulas with symbols for the numbers of the step, where it takes symbols."""
    step = case.step
    steps = step.events if isinstance(step, Chain) else (step,)
    try:
        found = _acting(tuple(map(_symbolic, steps)), case.field.frame)
        found.portrait("value")
    except (TypeError, ValueError, NotImplementedError):  # it is for numbers alone
        found = _acting(tuple(steps), case.field.frame)
    return found


def _acting(steps: tuple[Any, ...], frame: Frame) -> Derivation:
    return Derivation(UnknownField("L", frame=frame), steps)


def _numbers(step: Step) -> dict[str, float]:
    """The fields of a step that are one number each."""
    fields = {f.name: getattr(step, f.name, None) for f in dataclasses.fields(step)}
    return {
        k: float(v)
        for k, v in fields.items()
        if eqx.is_array_like(v) and not isinstance(v, (bool, int)) and np.ndim(v) == 0
    }


def _symbolic(step: Step) -> Step:
    """The step with a symbol for each of its numbers; itself if it has none or takes none."""
    names = _numbers(step)
    symbols = {k: sympy.Symbol(k, real=True, positive=v > 0 or None) for k, v in names.items()}
    kept = {f.name: getattr(step, f.name, None) for f in dataclasses.fields(step) if f.init}
    try:
        return type(step)(**{**kept, **symbols}) if symbols else step
    except (TypeError, ValueError):
        return step


def _said(derivation: Derivation, portrait: str) -> str:
    """A formula, or the reason why it is not shown."""
    if size_of(derivation.events) > MANY:
        return f"Made of more than {MANY} numbers: a table, and no formula."
    value = derivation.portrait("value")
    derived = portrait in ("gradient", "hessian")
    if derived and isinstance(value, Formula) and _operations(value) > LONG:
        return "The derivative of a formula too long to be read, which `derive` returns."
    laws = derivation.portrait("laws")
    waves = 0 if isinstance(laws, Refused) else max(map(waves_of, laws), default=0)
    if portrait == "spectrum" and waves > FEW:
        return f"A sum over the {waves} waves of a window."
    said = derivation.portrait(portrait)
    if isinstance(said, Refused):
        return f"No formula: {md.escaped(said.reason)}."
    if (count := _operations(said)) > LONG:
        return f"A formula of {count} operations, which `derive` returns."
    arguments = ", ".join(map(sympy.latex, said.coordinates))
    left = PORTRAITS[portrait].format(coordinates=arguments)
    return md.mathematics(_greek(f"{left} = {latex(said.expression)}"))


def _greek(shown: str) -> str:
    """Subscripts of the light's covariance: SymPy takes `xtheta` for one Latin word."""

    def subscript(found: re.Match) -> str:
        return "\\Sigma_{" + re.sub("theta|phi", r"\\\g<0> ", found[1]) + "}"

    return re.sub(r"\\Sigma_\{L (\w+)\}", subscript, shown)


def _operations(formula: Formula) -> int:
    """How long a formula is."""
    entries = formula.expression
    flat = sympy.flatten(entries) if hasattr(entries, "__len__") else [entries]
    return sum(int(sympy.count_ops(e)) for e in flat)


def _wavelet(case: Case) -> str:
    """Whether wavelet coefficients have a rule."""
    if case.expected.get("wavelet") != "refused":
        return "By a matrix of the Haar basis, which has numbers and no formula."
    try:
        by_rule(case, "wavelet")
    except Refused as refusal:
        return f"No formula: {md.escaped(refusal.reason)}."
    return "Answered, though its case expects a refusal."
