"""What notebooks show of laws, events, paths, jets and spectra: Markdown with their formulas.

Every class that shows itself asks `markdown` (`firstorder._display`), so that all are told alike:
what it is, for which light, and the formula of each portrait or the reason why there is none.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
import textwrap
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np
import sympy
from jax.core import Tracer

from firstorder._argument_checks import is_concrete
from firstorder._symbols import SymbolicArray
from firstorder.conventions import SPACE, SPACE_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Spectrum
from firstorder.laws import Convolve, Law, Move, Warp
from firstorder.symbolic._formula import Formula
from firstorder.symbolic._laws import FRAMES
from firstorder.symbolic._programs.exact import Expr
from firstorder.symbolic._spectra import of_spectrum
from firstorder.symbolic.derivation import Derivation, derive
from firstorder.symbolic.unknown import UnknownField
from firstorder.transport import Chain, Event, Path

# Light for which an event or a law that does not say what it takes is shown, in this order.
KNOWN = (*FRAMES, SPACE_SLOPE, SPACE_SLOPE.turned(), SPACE, SPACE.turned())
LONG = 150  # operations of a formula that nobody would read
MANY = 4096  # numbers of what is a table rather than a formula
FEW = 8  # waves of a window that are written out
WORDS = 200  # characters of a refusal's reason
DIGITS = 6
HAT = "\\hat{L}"


def markdown(thing: Any) -> str:
    r"""Markdown that a notebook shows of a law, event, path, jet, spectrum or formula.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.symbolic._display import markdown
        >>> print(markdown(gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE).spectrum()))
        **GaussianSpectrum** of incoming light over $(x, v)$
        <BLANKLINE>
        $$\hat{L}(\Omega_{x}, \Omega_{v}) = 2 \pi e^{- 2 \pi^{2} ...
    """
    match thing:
        case Formula():
            return f"$${latex(thing.expression)}$$"
        case Jet():
            return _jet(thing)
        case Covariance():
            return f"{_heading(thing, thing.frame)}\n\n$$\\Sigma = {_numbers(thing.matrix)}$$"
        case Spectrum():
            return _spectrum(thing)
        case Derivation():
            words = " → ".join(map(_name, (thing.source, *thing.events)))
            acted = isinstance(thing.source, UnknownField) and thing.events
            return _told(f"**{words}**", thing, "L'" if acted else "L")
        case Path():
            return markdown(derive(thing))
        case Chain():
            return _acting(" → ".join(map(_name, thing.events)), thing.events)
        case Event() | Law():
            return _acting(_name(thing), (thing,))
    raise TypeError(f"Nothing is known of how to show a {type(thing).__name__}.")


def latex(expression: Any) -> str:
    """LaTeX of an expression, its floating numbers to six digits."""
    floats = expression.atoms(sympy.Float) if hasattr(expression, "atoms") else ()
    short = {number: _short(number) for number in floats}
    return sympy.latex(expression.xreplace(short) if short else expression)


def _short(number: sympy.Float) -> Expr:
    """Six digits, or the whole number that it is but for rounding."""
    whole = round(float(number))
    near = abs(float(number) - whole) <= 1e-12 * abs(whole)
    return sympy.Integer(whole) if near else sympy.Float(number, DIGITS)


# --- what light becomes --------------------------------------------------------------------------


def _acting(words: str, events: Sequence[Any]) -> str:
    """Events or a law, on unknown light of the first kind that they take."""
    cited = paragraph(events[0], "Reference") if len(events) == 1 else ""
    words = f"**{words}**" + (f" ({cited.rstrip('.')})" if cited else "")
    try:
        derivation = _derivation(events)
    except ValueError as error:
        return f"{words}\n\n{error}"
    return _told(f"{words}, {_light(derivation.source.frame)}", derivation, "L'")


def _derivation(events: Sequence[Any]) -> Derivation:
    """The formulas of events for the first light that they take."""
    fields = [part for part in modules_of(tuple(events)) if isinstance(part, Field)]
    stated = dict.fromkeys(f.frame for f in fields if not f.frame.implied)
    found, refusals = [], []
    for frame in dict.fromkeys((*stated, *KNOWN)):
        try:
            light = UnknownField("L", frame=frame)
            found.append(_fitting(Derivation(light, tuple(events))))
        except (ValueError, TypeError) as error:  # it takes other coordinates, or more of them
            refusals.append(error)
        if found and not _warped(found[-1]):
            return found[-1]
    if not found:
        raise ValueError(f"It takes no light that is known here: {refusals[0]}")
    return found[0]


def _fitting(derivation: Derivation) -> Derivation:
    """Formulas, unless the light has fewer or more coordinates than a matrix of the events."""
    frame = derivation.source.frame
    for law in _laws(derivation):
        if isinstance(law, Move) and law.M.shape != (frame.dims, law.frame(frame).dims):
            raise ValueError(f"A matrix of {law.M.shape} is not for {frame.dims} coordinates.")
        frame = law.frame(frame)
    derivation.portrait("value")
    return derivation


def _laws(derivation: Derivation) -> tuple[Law, ...]:
    """The laws; none where an event has none for unknown light."""
    found = derivation.portrait("laws")
    return () if isinstance(found, Refused) else found


def _warped(derivation: Derivation) -> bool:
    """Whether a warp is among the laws: in other coordinates it may be a move, with a spectrum."""
    return any(isinstance(law, Warp) for law in _laws(derivation))


def _told(words: str, derivation: Derivation, name: str) -> str:
    """Value and spectrum, or why there is none."""
    if size_of((derivation.source, derivation.events)) > MANY:
        return f"{words}\n\nmade of more than {MANY} numbers: a table, and no formula"
    value, most = derivation.portrait("value"), max(map(waves_of, _laws(derivation)), default=0)
    lines = [words, _shown(name, value, "value")]
    if most > FEW:
        lines.append(f"spectrum: a sum over the {most} waves of a window")
    elif derivation.events and not _laws(derivation):
        lines = [words, _shown(name, value, "value and spectrum")]
    else:
        hat = name.replace("L", HAT)
        lines.append(_shown(hat, derivation.portrait("spectrum"), "spectrum"))
    return "\n\n".join(lines)


def waves_of(law: Law) -> int:
    """How many waves a law's spectrum adds up: a kernel that varies is a series on a window."""
    return math.prod(law.window.size) if isinstance(law, Convolve) and law.window else 0


def _shown(name: str, said: Formula | Refused, of: str) -> str:
    """`name(coordinates) = formula`, or the reason of the refusal."""
    if isinstance(said, Refused):
        return f"{of} refused: {textwrap.shorten(said.reason, WORDS, placeholder=' ...')}"
    operations = sympy.count_ops(said.expression)
    if operations > LONG:
        return f"{of}: a formula of {operations} operations, which `derive` returns"
    arguments = ", ".join(map(sympy.latex, said.coordinates))
    return f"$${name}({arguments}) = {latex(said.expression)}$$"


def _spectrum(F: Spectrum) -> str:
    """A spectrum by its formula."""
    if any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(F)):
        return f"{_heading(F, F.frame)}, traced"
    if size_of(F) > MANY:
        table = max(size_of(leaf) for leaf in jax.tree.leaves(F))  # without the light it came from
        return f"{_heading(F, F.frame)}\n\na transform of {table} numbers, and no formula"
    try:
        said = of_spectrum(F)
    except Refused as refusal:
        said = refusal
    return f"{_heading(F, F.frame)}\n\n{_shown(HAT, said, 'spectrum')}"


# --- numbers -------------------------------------------------------------------------------------


def _jet(jet: Jet) -> str:
    """Value, gradient and Hessian as matrices, the coordinates named."""
    heading = _heading(jet, jet.frame)
    shape = np.shape(jet.value)
    if shape:
        return f"{heading}, at {' x '.join(map(str, shape))} rays"
    names = [sympy.latex(sympy.Symbol(name)) for name in jet.frame.coordinates]
    first = _matrix([[f"\\partial_{{{a}}} L"] for a in names])
    second = _matrix([[f"\\partial_{{{a}}} \\partial_{{{b}}} L" for b in names] for a in names])
    lines = [
        f"L = {_numbers(jet.value)}",
        f"{first} = {_numbers(jet.gradient)}",
        f"{second} = {_numbers(jet.hessian)}",
    ]
    return "\n\n".join([heading, *(f"$${line}$$" for line in lines)])


def _numbers(a: Any) -> str:
    """A number, a column or a matrix, of numbers or of symbols."""
    if isinstance(a, SymbolicArray):
        entries = np.vectorize(latex, otypes=[object])(a.entries)
    elif is_concrete(a):
        entries = np.vectorize(_digits, otypes=[object])(np.asarray(a))
    else:
        return "\\text{traced}"
    if entries.ndim == 0:
        return str(entries[()])
    return _matrix(entries.reshape(len(entries), -1).tolist())


def _digits(number: Any) -> str:
    """Six digits, and a power of ten where it needs one."""
    digits, _, power = f"{float(number) + 0.0:.{DIGITS}g}".partition("e")
    digits = digits.replace("inf", "\\infty").replace("nan", "\\text{NaN}")
    return f"{digits} \\cdot 10^{{{int(power)}}}" if power else digits


def _matrix(rows: Sequence[Sequence[str]]) -> str:
    body = " \\\\ ".join(" & ".join(row) for row in rows)
    return f"\\begin{{pmatrix}} {body} \\end{{pmatrix}}"


# --- words ---------------------------------------------------------------------------------------


def paragraph(event: Any, head: str) -> str:
    """Text of a paragraph of the event's docstring, by the word that it begins with; "" if none."""
    found = re.search(rf"{head}:(.*?)(\n\s*\n|$)", inspect.getdoc(type(event)) or "", re.S)
    return " ".join(found.group(1).split()) if found else ""


def _name(event: Any) -> str:
    return getattr(event, "name", "") or type(event).__name__


def _heading(thing: Any, frame: Frame) -> str:
    return f"**{type(thing).__name__.lstrip('_')}** of {_light(frame)}"


def _light(frame: Frame) -> str:
    names = ", ".join(sympy.latex(sympy.Symbol(name)) for name in frame.coordinates)
    return f"{frame.sense} light over $({names})$"


def size_of(tree: Any) -> int:
    """How many numbers something is made of."""
    return sum(int(np.size(leaf)) for leaf in jax.tree.leaves(tree) if hasattr(leaf, "shape"))


def modules_of(tree: Any):
    """A module and all modules inside it."""
    if isinstance(tree, tuple | list):
        for part in tree:
            yield from modules_of(part)
    if isinstance(tree, eqx.Module):
        yield tree
        for field in dataclasses.fields(tree):
            yield from modules_of(getattr(tree, field.name, None))
