"""Argument checks at the public boundary: on the host, in one sentence.

Concrete arguments raise `ValueError`. Traced arguments cannot be looked at; where an invalid
one would give a plausible number, `nan_unless` turns the result into NaN instead. Shapes and types
are known either way. Where something sensible can be meant, a warning says what is likely wrong.
"""

from __future__ import annotations

import difflib
import math
import operator
import sys
import warnings
from collections.abc import Callable, Iterable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from firstorder._symbols import SymbolicArray

# Angles beyond two turns are taken for degrees.
MOST_TURNS = 2.0


def is_concrete(x: Any) -> bool:
    """Whether every leaf of `x` can be looked at on the host."""
    return not any(isinstance(leaf, (Tracer, SymbolicArray)) for leaf in jax.tree.leaves(x))


def _all(name: str, x: Any, ok, words: str) -> None:
    """Raise unless `ok` holds on all of `x`; a tree of placeholders is left alone."""
    check_number(name, x)
    a = _numbers(x) if is_concrete(x) else None
    if a is None:
        return
    good = ok(a)
    if not np.all(good):
        bad = a[~good].flat[0] if a.ndim else a[()]
        raise ValueError(f"Argument `{name}` must {words}, but is {bad}.")


def _numbers(x: Any) -> np.ndarray | None:
    """An array of a concrete number, array or list of numbers; None for anything else."""
    if isinstance(x, (int, float, np.ndarray, np.generic, jax.Array)):
        return np.asarray(x)
    if not isinstance(x, (list, tuple)):
        return None
    try:
        a = np.asarray(x)
    except ValueError:  # rows of several lengths
        return None
    return a if a.dtype.kind in "biuf" else None


def check_number(name: str, x: Any) -> None:
    """Refuse words and complex numbers; what else there is, JAX may know how to read."""
    if isinstance(x, (str, bytes)):
        raise TypeError(f"Argument `{name}` must be a number, but is {x!r}.")
    check_real(name, x)


def check_real(name: str, x: Any) -> None:
    """Refuse complex numbers, traced ones too."""
    kind = getattr(getattr(x, "dtype", None), "kind", None)  # a random key's type has none
    if isinstance(x, complex) or kind == "c":
        raise ValueError(f"Argument `{name}` must be real, but is complex.")


def check_real_attributes(made: Any) -> None:
    """Refuse something of the library's some number of which is complex.

    A class of a user's may keep a real light by complex coefficients.
    """
    if type(made).__module__.startswith("firstorder."):
        for name, x in vars(made).items():
            check_real(name, x)


def check_finite(name: str, x: Any) -> None:
    """Refuse NaN and infinity."""
    _all(name, x, np.isfinite, "be finite")


def check_positive(name: str, x: Any) -> None:
    """Refuse zero, negative numbers and NaN."""
    _all(name, x, lambda a: np.isfinite(a) & (a > 0), "be positive")


def check_not_negative(name: str, x: Any) -> None:
    """Refuse negative numbers and NaN."""
    _all(name, x, lambda a: np.isfinite(a) & (a >= 0), "not be negative")


def check_between(name: str, x: Any, low: float, high: float) -> None:
    """Refuse what lies outside [low, high]."""
    _all(name, x, lambda a: (a >= low) & (a <= high), f"lie in [{low:g}, {high:g}]")


def check_zero_or_one(name: str, x: Any) -> None:
    """Refuse numbers between, and what takes neither nothing nor all."""
    _all(name, x, lambda a: (a == 0) | (a == 1), "be 0 or 1")


def check_inside(name: str, x: Any, low: float, high: float) -> None:
    """Refuse what lies outside (low, high), the ends too."""
    _all(name, x, lambda a: (a > low) & (a < high), f"lie in ({low:g}, {high:g})")


def check_below(name: str, x: Any, high: float) -> None:
    """Refuse what is not less than a bound, and NaN."""
    _all(name, x, lambda a: a < high, f"be less than {high:g}")


def check_shape(name: str, x: Any, shape: tuple[int, ...]) -> None:
    """Refuse an array whose shape is not `shape`."""
    if hasattr(x, "shape") and tuple(x.shape) != tuple(shape):
        raise ValueError(f"Argument `{name}` must have shape {shape}, but has {tuple(x.shape)}.")


def check_broadcast(name: str, x: Any, shape: tuple[int, ...]) -> None:
    """Refuse an array that does not broadcast to a shape."""
    try:
        fits = np.broadcast_shapes(np.shape(x), shape) == tuple(shape)
    except ValueError:
        fits = False
    if not fits:
        raise ValueError(
            f"Argument `{name}` must broadcast to shape {shape}, but has {np.shape(x)}."
        )


def check_coordinates(name: str, x: Any, count: int = 3) -> None:
    """Refuse points and vectors that are not of space, or with two coordinates not of the plane."""
    shape, words = np.shape(x), {2: "two", 3: "three"}[count]
    if shape[-1:] != (count,):
        raise ValueError(f"Argument `{name}` must have {words} coordinates, but has shape {shape}.")


def check_one(name: str, x: Any) -> None:
    """Refuse what is not one number."""
    check_number(name, x)
    if x is None:
        raise TypeError(f"Argument `{name}` must be a number, but is None.")
    shape = np.shape(x)
    if shape:
        raise ValueError(f"Argument `{name}` must be one number, but has shape {shape}.")


def check_one_or_bands(name: str, x: Any) -> None:
    """Refuse what is neither one number nor a row of them, one for each band."""
    shape = np.shape(x)
    if len(shape) > 1 or shape == (0,):
        raise ValueError(
            f"Argument `{name}` must be one number, or one for each band, but has shape {shape}."
        )


def check_count(name: str, x: Any) -> None:
    """Refuse what is no positive integer, and one by which nothing can be numbered."""
    try:
        number = operator.index(x)
    except TypeError:
        number = 0
    if number <= 0:
        raise ValueError(f"Argument `{name}` must be a positive integer, but is {x!r}.")
    if number > sys.maxsize:
        raise ValueError(f"Argument `{name}` must be at most {sys.maxsize}, but is more.")


def check_integer(name: str, x: Any) -> None:
    """Refuse a number that is no integer; how small it may be is asked apart."""
    try:
        operator.index(x)
    except TypeError:
        shown = x.dtype if isinstance(x, Tracer) else repr(x)
        raise ValueError(f"Argument `{name}` must be an integer, but is {shown}.") from None


def check_kind(name: str, x: Any, kind: type | tuple[type, ...], words: str) -> None:
    """Refuse what is not of a kind, in one sentence."""
    if not isinstance(x, kind):
        raise TypeError(f"Argument `{name}` must be {words}, but is {what(x)}.")


def check_key(name: str, x: Any) -> None:
    """Refuse what is no key of random numbers, such as the seed of one."""
    kind = getattr(x, "dtype", None)
    if kind is None or not (jnp.issubdtype(kind, jax.dtypes.prng_key) or kind == jnp.uint32):
        raise TypeError(
            f"Argument `{name}` must be a key of random numbers, but is {what(x)}: "
            "write jax.random.key(0)."
        )


def what(x: Any) -> str:
    """A value's kind in two words."""
    if isinstance(x, type):
        return f"the class {x.__name__}"
    name = type(x).__name__
    return f"{'an' if name[0] in 'AEIOUaeiou' else 'a'} {name}"


def check_index(name: str, x: Any, count: int) -> None:
    """Refuse what is no number of a shape, and the numbers of shapes that are not there."""
    if isinstance(x, (str, tuple, list)):
        meant = x if isinstance(x, str) else "floor"
        raise TypeError(
            f"Argument `{name}` must be a shape's number, but is {x!r}: "
            f"write scene.named({meant!r})[0] for the first of that name."
        )
    dtype = getattr(x, "dtype", np.dtype(type(x)) if isinstance(x, (int, float)) else None)
    if dtype is not None and dtype.kind not in "iu":
        raise TypeError(f"Argument `{name}` must be a shape's number, an integer, but is {x}.")
    if is_concrete(x) and (wrong := [i for i in np.ravel(np.asarray(x)) if not 0 <= i < count]):
        raise ValueError(
            f"Argument `{name}` must be the number of a shape, 0 to {count - 1}, but is {wrong[0]}."
        )


def check_known(name: str, word: Any, known: Iterable[str]) -> None:
    """Refuse a word that is none of those known, and say which was meant."""
    known = list(known)
    if word in known:
        return
    close = difflib.get_close_matches(word, known, 1, 0.8) if isinstance(word, str) else []
    meant = f": did you mean {close[0]!r}?" if close else "."
    words = ", ".join(known) or "none"
    raise ValueError(f"Argument `{name}` must be one of {words}, but is {word!r}{meant}")


def warn_of_degrees(name: str, x: Any, stacklevel: int = 3) -> None:
    """Warn of concrete angles that look like degrees."""
    if not is_concrete(x):
        return
    most = float(np.max(np.abs(np.asarray(x)), initial=0.0))
    if MOST_TURNS * math.tau < most < math.inf:
        warnings.warn(
            f"Argument `{name}` is an angle of {most:g} rad, {most / math.tau:.1f} turns: "
            "angles are in radians.",
            stacklevel=stacklevel,
        )


def check_invertible(name: str, M: Any) -> None:
    """Refuse a square matrix that is singular to working precision, in any unit of a column."""
    if not is_concrete(M) or not hasattr(M, "ndim") or M.ndim != 2 or M.shape[0] != M.shape[1]:
        return
    check_finite(name, M)
    a = np.asarray(M)
    most = np.max(np.abs(a), 0)
    a = a / np.where(most > 0.0, most, 1.0)
    if np.linalg.cond(a) > 1.0 / np.finfo(a.dtype).eps:
        raise ValueError(f"Argument `{name}` must be invertible, but its rank is too low.")


def nan_unless(ok: Any, x: Any) -> Any:
    """`x` where `ok`, NaN elsewhere: an invalid traced input never looks like an answer.

    Nor does a derivative: one that is not zero is NaN there. A number that `jnp.where` masks
    afterwards gives nothing to derivatives, and leaves those of its neighbours as they are: its
    cotangent is zero, and zero stays zero, which a product with NaN would not do.
    """
    if is_concrete((ok, x)):
        return x if np.all(np.asarray(ok)) else jnp.where(ok, x, jnp.nan)
    return _nan_unless(ok, x)


@jax.custom_jvp
def _nan_unless(ok: Any, x: Any) -> Any:
    if jnp.shape(ok) == jnp.shape(x) and getattr(x, "dtype", np.dtype(int)).kind == "f":
        return jax.lax.select(ok, x, jnp.full_like(x, jnp.nan))  # `where` in fewer equations
    return jnp.where(ok, x, jnp.nan)


@_nan_unless.defjvp
def _nan_unless_jvp(primals, tangents):
    ok, x = primals
    made = _nan_unless(ok, x)
    change = jnp.broadcast_to(tangents[1], made.shape)
    return made, jax.lax.select(jnp.broadcast_to(ok, made.shape), change, _lost(change))


def _lost(change: Array) -> Array:
    """NaN for every change of a number that is NaN, and zero for none, forwards and backwards.

    JAX must take it for linear, which `custom_linear_solve` promises of what it solves.
    """

    def solve(_, b):
        return jax.lax.select(b == 0.0, b, jnp.full_like(b, jnp.nan))

    return jax.lax.custom_linear_solve(lambda a: a, change, solve, symmetric=True)


def traced_nan_unless(ok: Callable[[Any], Any], x: Any) -> Any:
    """`x`; a traced one is NaN where `ok(x)` is not true. Concrete ones have checks with words."""
    return x if is_concrete(x) else nan_unless(ok(x), x)


def not_negative(x: Any) -> Any:
    """Numbers that `check_not_negative` will look at: traced ones are NaN where negative."""
    return traced_nan_unless(lambda a: a >= 0.0, x)


def check_unit(name: str, w: Float[Array, "*n 3"]) -> None:
    """Refuse directions that are not unit vectors."""
    if is_concrete(w):
        lengths = np.ravel(np.linalg.norm(np.asarray(w), axis=-1))
        wrong = lengths[~(np.abs(lengths - 1.0) < 1e-4)]
        if wrong.size:
            raise ValueError(
                f"Argument `{name}` must be a unit vector, but has length {wrong[0]:g}."
            )
