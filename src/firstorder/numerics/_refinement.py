"""Errors of quadratures and of sums that end: an answer, beside answers by finer rules.

With `e_n` the error at n nodes, the answers at n, m = 2 n + 1 and k = 3 n + 1 nodes give

    error = 4 max(|I_m - I_n|, |I_k - I_n|) + 16 eps max |I|,

a bound of `e_n` as soon as one of the finer errors is at most 3/4 of it in size, or has the other
sign: `|I_m - I_n| = |e_n - e_m| >= |e_n| - |e_m|`. What that asks for:

- An integrand that is analytic between the breaks has `|e_n| <= c q^(2 n)` (Gauss-Legendre; q^n
  for the trapezoid rule over a period): the finer errors vanish beside it, and the estimate is four
  times the error. Where q is so near to 1 that the rule does not resolve the integrand, nothing is
  known, as of any finite sample.
- A kink inside of a piece leaves an error of order n^-2, a jump one of order 1 / n, a square root
  at an end n^-3, times a function of where the break lies between two nodes. The finer rules divide
  the size by some 4 and 9, or 2 and 3. Their counts are no multiples of n: a break that lies
  well for n nodes would lie as well for 2 n, and a small error of a coarse rule would hide in its
  agreement with the finer ones.
- A break between the end of a piece and the outermost node of every rule is seen by none. That node
  lies `j^2 / (2 (k + 1/2)^2)` from the end of [-1, 1], j = 2.405 the first zero of the Bessel
  function J_0, so a break at a random place hides in `2.9 / (3 n + 1.5)^2` of the cases: 0.8 % at 6
  nodes, 0.1 % at 16, 3 % at 3.

The last term is rounding. The error has no derivative (`stop_gradient`).
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, ParamSpec, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from firstorder._display import in_print

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

SAFETY = 4.0  # times the largest difference
ROUNDING = 16.0  # units in the last place of the largest answer
STEPS = (0, 1, 2)  # as asked, and two refinements


class Approximation(NamedTuple):
    """An answer and a bound of its error, each of the same form and unit.

    What counts is the error that nodes, waves or panels leave; where the question itself cuts light
    off (`reach`, the ends of an integral), that is no error. The bound is the larger difference to
    the answers of 2 n + 1 and 3 n + 1 nodes, four times, plus rounding. It holds if one of these is
    at most three quarters as wrong as the answer: for integrands that are analytic between the
    breaks, where errors fall geometrically, and behind kinks, where they fall as n^-2. No theorem
    stands behind a finite sample: it is measured to hold in 99 of 100 random cases. An `Estimate`
    of drawn samples has a standard error instead.

    Wrong when: nothing is resolved, as a peak between all nodes; for derivatives of light whose
    breaks nobody declared. Behind a kink a second derivative, and behind a jump a first one, lacks
    a Dirac for any number of nodes (give `cuts`, or a sky with `breaks`).

    Attributes:
        value: the answer, the same as without its error.
        error: of each number of it, not negative; without derivative.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws import Integrate
        >>> E = Integrate("theta", -9.0, 9.0, nodes=12)(gaussian((0.0, 0.0), (1.0, 1.0)))
        >>> value, error = E(0.0, with_error=True)
        >>> round(value.item(), 4), round(error.item(), 4), bool(abs(value - 2.5066) < error)
        (2.3937, 0.4518, True)
    """

    value: Any
    error: Any

    __repr__ = in_print


def finer(count: int, step: int) -> int:
    """A count of nodes after a refinement: n, 2 n + 1, 3 n + 1."""
    return (step + 1) * count + (1 if step else 0)


def approximated(answer: Callable[[int], Any]) -> Approximation:
    """An answer with its error, from answers of which the later ones are finer.

    Args:
        answer: by the step of refinement, 0 for the answer itself; a tree of arrays.

    Example:
        >>> from firstorder.numerics import gauss_legendre
        >>> from firstorder.numerics._refinement import approximated, finer
        >>> def inverse(step):  # int_-1^1 1 / (2 + t) dt = log 3
        ...     t, w = gauss_legendre(finer(3, step))
        ...     return w @ (1.0 / (2.0 + t))
        >>> value, error = approximated(inverse)
        >>> abs(value.item() - 1.0986123) < error.item() < 0.005
        True
    """
    answers = [answer(step) for step in STEPS]
    return Approximation(answers[0], jax.tree.map(_error, *answers))


def _error(value: Any, *others: Any) -> Array:
    """The bound for one array of an answer."""
    value = jax.lax.stop_gradient(jnp.asarray(value))
    eps = jnp.finfo(value.dtype).eps if jnp.issubdtype(value.dtype, jnp.inexact) else 0.0
    size, apart = jnp.abs(value), jnp.zeros_like(jnp.abs(value))
    for other in map(jax.lax.stop_gradient, others):
        size = jnp.maximum(size, jnp.abs(other))
        apart = jnp.maximum(apart, jnp.abs(other - value))
    return SAFETY * apart + ROUNDING * eps * size


# --- functions with counts of nodes --------------------------------------------------------------


def with_errors(*counts: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A function that answers `with_error=True` by an `Approximation`, from its own finer answers.

    The function names `with_error` among its arguments, so that its signature shows it, and never
    sees it set. Without it nothing is changed.

    Args:
        counts: names of the arguments that say how finely it computes.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.numerics import gauss_legendre
        >>> from firstorder.numerics._refinement import with_errors
        >>> @with_errors("nodes")
        ... def bell(*, nodes=4, with_error=False):
        ...     t, w = gauss_legendre(nodes)
        ...     return jnp.sum(w * jnp.exp(-t * t))
        >>> value, error = bell(with_error=True)
        >>> value.item() == bell().item(), bool(abs(value - 1.4936483) < error)
        (True, True)
    """

    def added(function: Callable[P, R]) -> Callable[P, R]:
        form = inspect.signature(function)
        place = list(form.parameters).index("with_error")

        @functools.wraps(function)
        def asked(*args: P.args, **kwargs: P.kwargs) -> R:
            wanted = kwargs.pop("with_error", False) or any(args[place:])
            if not wanted:
                return function(*args, **kwargs)
            given = form.bind(*args[:place], **kwargs)
            given.apply_defaults()
            sizes = {name: given.arguments[name] for name in counts}

            def answer(step: int) -> R:
                given.arguments.update({name: finer(n, step) for name, n in sizes.items()})
                return function(*given.args, **given.kwargs)

            found: Any = approximated(answer)
            return found

        asked.__dict__["counts"] = {name: form.parameters[name].default for name in counts}
        return asked

    return added


def with_errors_of_self(method: Callable[P, R]) -> Callable[P, R]:
    """`with_errors` for a method of a module whose own fields say how finely it computes."""

    @functools.wraps(method)
    def asked(*args: P.args, **kwargs: P.kwargs) -> R:
        if not kwargs.pop("with_error", False):
            return method(*args, **kwargs)
        run: Any = method
        module, *others = args
        found: Any = approximated(lambda step: run(refined(module, step), *others, **kwargs))
        return found

    return asked


def counts_of(function: Any, options: Mapping[str, Any]) -> dict[str, int]:
    """The counts by which a function computes, as it would be called with some options.

    Raises:
        TypeError: if it does not answer `with_error`.
    """
    counts = getattr(function, "counts", None)
    if counts is None:
        name = getattr(function, "__name__", repr(function))
        raise TypeError(f"Argument `f` must answer `with_error`, but {name} does not.")
    return {name: options.get(name, default) for name, default in counts.items()}


# --- things that hold counts ---------------------------------------------------------------------


def refined(thing: T, step: int) -> T:
    """A copy in which every part computes by a finer rule; the thing itself if none can.

    A class says in its attribute `REFINED` which of its fields are counts, or grids with a method
    `finer(step)`; a class with a method `_finer(step)` is asked itself. What stands in a plain
    function is not found.

    Args:
        thing: a module, or a tuple, list or dictionary of them.
        step: of refinement.

    Example:
        >>> from firstorder.laws import Integrate
        >>> from firstorder.numerics._refinement import refined
        >>> refined(Integrate("theta", -1.0, 1.0, nodes=8), 1).nodes
        17
    """
    found = _refined(thing, step) if step else thing
    return found  # pyright: ignore[reportReturnType]


def _refined(thing: Any, step: int) -> Any:
    if isinstance(thing, jax.tree_util.Partial):
        parts = _refined((thing.args, thing.keywords), step)
        return jax.tree_util.Partial(thing.func, *parts[0], **parts[1])
    if type(thing) in (tuple, list):
        return type(thing)(_refined(part, step) for part in thing)
    if type(thing) is dict:
        return {name: _refined(part, step) for name, part in thing.items()}
    if not isinstance(thing, eqx.Module):
        return thing
    own = getattr(type(thing), "_finer", None)
    return _copied(thing, step) if own is None else own(thing, step)


def _copied(thing: eqx.Module, step: int) -> eqx.Module:
    """A module with finer parts; the same object if it has none."""
    names = [f.name for f in dataclasses.fields(thing) if hasattr(thing, f.name)]
    before = {name: getattr(thing, name) for name in names}
    counts = getattr(type(thing), "REFINED", ())
    after = {
        name: _count(part, step) if name in counts else _refined(part, step)
        for name, part in before.items()
    }
    if all(_same(after[name], before[name]) for name in names):
        return thing
    copy = object.__new__(type(thing))
    for name, part in after.items():
        object.__setattr__(copy, name, part)
    return copy


def _count(part: Any, step: int) -> Any:
    """A finer count, or grid; None, where somebody else decides, stays."""
    if part is None:
        return None
    return finer(part, step) if isinstance(part, int) else part.finer(step)


def _same(a: Any, b: Any) -> bool:
    """Whether nothing was made anew in a part."""
    if type(a) in (tuple, list):
        return all(_same(x, y) for x, y in zip(a, b, strict=True))
    if type(a) is dict:
        return all(_same(x, b[name]) for name, x in a.items())
    if isinstance(a, jax.tree_util.Partial):
        return _same((list(a.args), a.keywords), (list(b.args), b.keywords))
    return a is b
