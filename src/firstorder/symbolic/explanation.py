"""A path told step by step: event, source, formula, and the numbers at a ray."""

from __future__ import annotations

import dataclasses
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from firstorder._argument_checks import check_finite
from firstorder.errors import Refused
from firstorder.fields.jet import Jet
from firstorder.laws import Law, Move, Warp
from firstorder.symbolic._display import modules_of, paragraph
from firstorder.symbolic._formula import Formula
from firstorder.symbolic._laws import fitting_frame, has_symbols, of_field, of_law
from firstorder.symbolic.derivation import derive
from firstorder.symbolic.unknown import UnknownField, UnknownLobe, UnknownVaryingLobe
from firstorder.transport import Chain, Path
from firstorder.typing import Ray, as_float

_jets = eqx.filter_jit(lambda field, u: field.jet(u))


@dataclasses.dataclass(frozen=True)
class ExplainedStep:
    """One step of a path.

    Attributes:
        name: of the event; "source" for the light.
        reference: the equations that it cites.
        formula: radiance after it, in terms of the light `L` before it; the light itself for the
            source. A refusal where there is no formula.
        ray: where the ray that is followed is at this step, if one is.
        jet: value, gradient and Hessian there, if the path has numbers.
        called: what the papers call the event, where it is not its name here.
    """

    name: str
    reference: str
    formula: Formula | Refused
    ray: Ray | None
    jet: Jet | None
    called: str = ""

    @property
    def title(self) -> str:
        """The name, with what the papers call it."""
        return f"{self.name}, called {self.called}" if self.called else self.name


@dataclasses.dataclass(frozen=True)
class Explanation:
    """A path step by step; `print` shows text, a notebook Markdown with formulas.

    Attributes:
        steps: the light, and each event.
    """

    steps: tuple[ExplainedStep, ...]

    def __str__(self) -> str:
        """Text for a terminal."""
        told = (_lines(k, step) for k, step in enumerate(self.steps))
        return "\n".join(line for lines in told for line in lines)

    @property
    def markdown(self) -> str:
        """Markdown with LaTeX."""
        parts = []
        for k, step in enumerate(self.steps):
            said = step.formula
            shown = f"refused: {said.reason}" if isinstance(said, Refused) else f"$${said.latex}$$"
            cited = f" ({step.reference})" if step.reference else ""
            title = f"**{k}. {step.name}**{step.title.removeprefix(step.name)}"
            parts.append(f"{title}{cited}\n\n{shown}\n")
            if step.jet is not None:
                parts.append(f"{_numbers(step)}\n")
        return "\n".join(parts)

    def _repr_markdown_(self) -> str:
        """Markdown, for a notebook."""
        return self.markdown


def explain(path: Any, ray: Any = None) -> Explanation:
    """A path step by step: each event with the equations it cites, its formula, and numbers.

    Args:
        path: a path, or a chain of events (on an unknown light in the first frame that fits: angles
            or slopes, incoming or outgoing).
        ray: coordinates at the end of the path; it is followed back through moves and warps, and
            stays where it is at a product or a convolution. Left out, no numbers are shown.

    Returns:
        The explanation, which prints itself.

    Raises:
        TypeError: if it is no path.
        ValueError: if the ray has not the coordinates of the light, or one is not finite.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.symbolic import explain
        >>> from firstorder.transport import Travel
        >>> path = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE) >> Travel(2.0)
        >>> print(explain(path, (2.0, 1.0)))
        0. source
           exp(-v**2/2 - x**2/2)
           at x = 0, v = 1: value 0.606531, gradient 0, -0.606531
        1. Travel, called transport, or travel in free space (D05 §3.1)
           [D05 eqs. 2-3 (their printed primes are exchanged between the two).]
           L(-2*v + x, v)
           at x = 2, v = 1: value 0.606531, gradient 0, -0.606531
    """
    if isinstance(path, Chain):
        path = Path(UnknownField("L", frame=fitting_frame(path.events)), path)
    if not isinstance(path, Path):
        raise TypeError(f"Argument `path` must be a path or a chain, but is {type(path).__name__}.")
    if ray is not None:
        check_finite("ray", as_float(ray))
    numbers = ray is not None and not has_symbols(path) and not _unknown(path)
    fields = path.steps if numbers else (None,) * (len(path.events) + 1)
    laws = derive(path).laws
    rays = _followed(laws, None if ray is None else as_float(ray), numbers)
    said, frame = [_or_refusal(lambda: of_field(path.source))], path.source.frame
    for law in laws:
        light = UnknownField("L", frame=frame)
        said.append(_or_refusal(lambda law=law, light=light: of_law(law, of_field(light))))
        frame = law.frame(frame)
    names = ["source", *(getattr(e, "name", type(e).__name__) for e in path.events)]
    cited = ["", *(paragraph(e, "Reference") for e in path.events)]
    called = ["", *(paragraph(e, "Called").removesuffix(".") for e in path.events)]
    jets = [None if f is None else _jets(f, u) for f, u in zip(fields, rays, strict=True)]
    columns = zip(names, cited, said, rays, jets, called, strict=True)
    return Explanation(tuple(ExplainedStep(*column) for column in columns))


def _unknown(path: Path) -> bool:
    """Whether some light, mask or lobe of the path has no numbers."""
    unknown = UnknownField, UnknownLobe, UnknownVaryingLobe
    return any(isinstance(module, unknown) for module in modules_of(path))


def _followed(laws: tuple[Law, ...], ray: Any, numbers: bool) -> list[Any]:
    """Where a ray is at each step, from the end back."""
    if not numbers:
        return [ray if k == len(laws) else None for k in range(len(laws) + 1)]
    rays = [ray]
    for law in reversed(laws):
        u = rays[-1]
        if isinstance(law, Move):
            u = law.preimage(u)
        elif isinstance(law, Warp):
            u = law.map(u)
        rays.append(u)
    return rays[::-1]


def _or_refusal(make) -> Formula | Refused:
    try:
        return make()
    except Refused as refusal:
        return refusal


def _lines(k: int, step: ExplainedStep) -> list[str]:
    said = step.formula
    words = f"refused: {said.reason}" if isinstance(said, Refused) else str(said)
    cited = f"[{step.reference}]"
    if not step.reference:
        lines = [f"{k}. {step.title}"]
    elif step.called:
        lines = [f"{k}. {step.title}", f"   {cited}"]
    else:
        lines = [f"{k}. {step.title} {cited}"]
    lines.append(f"   {words}")
    return lines if step.jet is None else [*lines, f"   {_numbers(step)}"]


def _numbers(step: ExplainedStep) -> str:
    """The ray, and what is found there."""
    assert step.jet is not None
    assert step.ray is not None
    names = step.jet.frame.coordinates
    at = ", ".join(f"{n} = {_short(a)}" for n, a in zip(names, step.ray, strict=True))
    slope = ", ".join(map(_short, step.jet.gradient))
    return f"at {at}: value {_short(step.jet.value)}, gradient {slope}"


def _short(a: Any) -> str:
    """Six digits; a zero without a sign."""
    return f"{float(jnp.asarray(a)) + 0.0:.6g}"
