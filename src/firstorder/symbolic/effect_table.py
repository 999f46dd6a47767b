"""What events do to light and to its spectrum, as a table: D05's Table 1, derived."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import sympy

from firstorder._argument_checks import what
from firstorder._labelled import DataFrame, data_frame
from firstorder.errors import Refused
from firstorder.laws import Convolve, Integrate, Law, Move, Multiply, Warp
from firstorder.symbolic._formula import Formula, in_cell
from firstorder.symbolic._laws import FRAMES, fitting_frame
from firstorder.symbolic._programs.reading import matrix
from firstorder.symbolic.derivation import Derivation, derive
from firstorder.symbolic.unknown import UnknownField, UnknownLobe, UnknownVaryingLobe
from firstorder.transport import (
    Arrival,
    Chain,
    Cosine,
    Curvature,
    Event,
    Incidence,
    Mirror,
    Occlusion,
    Outgoing,
    Reflection,
    Texture,
    Travel,
    separable,
)

NOTHING = "no simple formula"


@dataclasses.dataclass(frozen=True)
class Effect:
    """Effect of one event, or of a chain of them, on unknown light and its spectrum.

    Attributes:
        name: of the step.
        light: the light after it, in terms of the light `L` before it.
        spectrum: the spectrum after it, or the refusal.
        on_light: what that is called: shear, multiplication, convolution, ...
        on_spectrum: what it does to the spectrum.
    """

    name: str
    light: Formula
    spectrum: Formula | Refused
    on_light: str
    on_spectrum: str


@dataclasses.dataclass(frozen=True)
class EffectTable:
    """Steps and their effects; `print` shows text, a notebook a table.

    Attributes:
        rows: one for each step.
    """

    rows: tuple[Effect, ...]

    def __str__(self) -> str:
        """Three lines for each step."""
        return "\n".join(
            f"{r.name}\n  light ({r.on_light}): {_said(r.light)}"
            f"\n  spectrum ({r.on_spectrum}): {_said(r.spectrum)}"
            for r in self.rows
        )

    def to_pandas(self) -> DataFrame:
        """A table of text, the formulas as SymPy prints them; refusals with their reasons.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> import sympy
            >>> from firstorder.symbolic import effects
            >>> from firstorder.transport import Travel
            >>> table = effects({"travel": Travel(sympy.Symbol("d", positive=True))}).to_pandas()
            >>> table.light[0]
            'L(-d*v + x, v)'
        """
        columns = {
            "step": [r.name for r in self.rows],
            "on_light": [r.on_light for r in self.rows],
            "light": [_said(r.light) for r in self.rows],
            "on_spectrum": [r.on_spectrum for r in self.rows],
            "spectrum": [_said(r.spectrum) for r in self.rows],
        }
        return data_frame(columns, {})

    def _repr_markdown_(self) -> str:
        """A table, for a notebook."""
        head = "| step | light | | spectrum | |", "|---|---|---|---|---|"
        body = (
            f"| {r.name} | {r.on_light} | {in_cell(r.light)} | {r.on_spectrum} | "
            f"{_said(r.spectrum) if isinstance(r.spectrum, Refused) else in_cell(r.spectrum)} |"
            for r in self.rows
        )
        return "\n".join((*head, *body))


def effects(steps: Mapping[str, Event | Chain] | None = None) -> EffectTable:
    """The table of what steps do to light and to its spectrum, read out of their code.

    Each step meets unknown light of flatland, in slopes or angles: the first in which it has a
    spectrum.

    Args:
        steps: events or chains by their names; left out, those of D05's Table 1 (`table_1`).

    Raises:
        TypeError: if the steps have no names.
        ValueError: if a step takes no light of flatland.

    Reference: D05 Table 1 (§5.3), whose rows 3 and 4 are misprinted.

    Example:
        >>> import sympy
        >>> from firstorder.symbolic import effects
        >>> from firstorder.transport import Travel
        >>> print(effects({"travel": Travel(sympy.Symbol("d", positive=True))}))
        travel
          light (shear): L(-d*v + x, v)
          spectrum (shear): L_hat(Omega_x, Omega_v + Omega_x*d)
    """
    steps = table_1() if steps is None else steps
    if not isinstance(steps, Mapping):
        raise TypeError(
            f"Argument `steps` must hold events by their names, but is {what(steps)}: "
            "write {'travel': Travel(1.0)}."
        )
    return EffectTable(tuple(_effect(name, step) for name, step in steps.items()))


def table_1() -> dict[str, Event | Chain]:
    """The steps of D05's Table 1, and the mirror, with symbols for all that they depend on.

    Example:
        >>> from firstorder.symbolic import table_1
        >>> list(table_1())[:3]
        ['travel', 'visibility', 'light incidence']
    """
    d = sympy.Symbol("d", positive=True)
    k, theta_0, theta_1 = sympy.symbols("kappa theta_0 theta_1", real=True)
    lobe = UnknownLobe("rho")
    return {
        "travel": Travel(d),
        "visibility": Occlusion(UnknownField("V", ("x",))),
        "light incidence": Arrival() >> Incidence(theta_0),
        "outgoing angle": Outgoing(theta_1),
        "curvature": Curvature(k),
        "cosine term": Cosine(),
        "mirror": Mirror(),
        "BRDF": Reflection(lobe),
        "texture mapping": Texture(UnknownField("T", ("x",))),
        "separable BRDF": separable(lobe, incoming=UnknownField("f", ("theta",))),
        "space-varying BRDF": Reflection(UnknownVaryingLobe("rho")),
    }


def _effect(name: str, step: Event | Chain) -> Effect:
    found = _fitting(step)
    spectrum = found.portrait("spectrum")
    kinds = [_kinds(law) for law in found.laws]
    on_light, on_spectrum = (", ".join(words) for words in zip(*kinds, strict=True))
    if isinstance(spectrum, Refused):
        on_spectrum = NOTHING
    return Effect(name, found.value, spectrum, on_light, on_spectrum)


def _fitting(step: Event | Chain) -> Derivation:
    """The step on light of the first frame in which it has a spectrum, or else that fits."""
    for frame in FRAMES:
        found = derive(step, frame)
        try:
            if isinstance(found.portrait("spectrum"), Formula):
                return found
        except ValueError:
            continue
    return derive(step, fitting_frame(derive(step).events))


def _kinds(law: Law) -> tuple[str, str]:
    """Names of a law: of what it does to light, and to the spectrum."""
    match law:
        case Move():
            M = matrix(law.M)
            if M.is_square and sympy.eye(M.rows) == M:
                return "shift", "phase"
            kind = _kind_of_move(M)
            return kind, kind
        case Multiply():
            return "multiplication", "convolution"
        case Convolve():
            semi = "" if not isinstance(law.kernel, UnknownVaryingLobe) else "semi-"
            return f"{semi}convolution", f"{semi}convolution" if semi else "multiplication"
        case Integrate():
            return "integral", "slice"
        case Warp():
            return "warp", NOTHING
    return type(law).__name__.lower(), type(law).__name__.lower()


def _kind_of_move(M: Any) -> str:
    """Shear, scale or flip, by the entries of the matrix."""
    if M.shape[0] != M.shape[1]:
        return "projection"
    if M.is_diagonal():
        return "flip" if all(abs(m) == 1 for m in M.diagonal()) else "scale"
    return "shear" if M.det() == 1 and all(m == 1 for m in M.diagonal()) else "linear map"


def _said(formula: Formula | Refused) -> str:
    return f"refused: {formula.reason}" if isinstance(formula, Refused) else str(formula)
