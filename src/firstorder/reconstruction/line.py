"""Adaptive sampling along a line: the most important cell is split until the budget is spent.

What is important is a driver's to say: the gradient, the second derivative, what one more
derivative would change, the difference of neighbouring samples, or nothing but length. Samples
that were taken are kept, so their table is what the interpolation needs.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import (
    check_finite,
    check_integer,
    check_one,
    check_positive,
    is_concrete,
    nan_unless,
)
from firstorder._display import Module, in_print, table
from firstorder.reconstruction.hermite import HermiteInterpolant, hermite_basis, interpolation_error
from firstorder.typing import Scalar, as_float

# --- drivers: refinement priority of a cell -----------------------------------------------------


class LineCell(NamedTuple):
    """An interval as a driver sees it: its length, and the data at its two ends.

    Attributes:
        length: in the unit of x.
        left, right: value, slope and second derivative, as many as the function returns.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction import LineCell
        >>> cell = LineCell(jnp.array(1.0), jnp.array([0.0, 0.0, 2.0]), jnp.array([1.0, 2.0, 4.0]))
        >>> cell.mean(2).item()
        3.0
    """

    length: Float[Array, ""]
    left: Float[Array, " k"]
    right: Float[Array, " k"]

    __repr__ = in_print

    def mean(self, order: int) -> Scalar:
        """Mean magnitude of a derivative over both ends."""
        if self.left.shape[0] <= order:
            needs = ("values", "slopes", "second derivatives")[order]
            raise ValueError(f"Argument `driver` needs {needs}, but `function` returns none.")
        return 0.5 * (jnp.abs(self.left[order]) + jnp.abs(self.right[order]))


Driver = Callable[[LineCell], Scalar]


def line_by_length(cell: LineCell) -> Scalar:
    """The cell's length: samples spread evenly, as far as halving goes.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction import LineCell, line_by_length
        >>> line_by_length(LineCell(jnp.array(0.5), jnp.zeros(1), jnp.ones(1))).item()
        0.5
    """
    return cell.length


def line_by_differences(cell: LineCell) -> Scalar:
    """`|f(b) - f(a)|`: the numeric gradient times the length, from values alone.

    It is the magnitude of `int f'`, in which ups and downs cancel: a cell that holds whole periods
    of a wave shows nothing.

    Reference: R07 §9.2 ("adaptive image sampling").

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction import LineCell, line_by_differences
        >>> line_by_differences(LineCell(jnp.array(0.5), jnp.zeros(1), -jnp.ones(1))).item()
        1.0
    """
    return jnp.abs(cell.right[0] - cell.left[0])


def line_by_gradient(cell: LineCell) -> Scalar:
    """`h (|f'(a)| + |f'(b)|) / 2`: the gradient's magnitude times the length.

    It estimates `int |f'|`, in which nothing cancels. Blind where both ends happen to be extrema.

    Reference: R07 §9.1, which takes the gradient at the cell's middle and the area in 2D.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction import LineCell, line_by_gradient
        >>> line_by_gradient(LineCell(jnp.array(0.5), jnp.array([0.0, 2.0]), jnp.array([0.0,
        ...     -2.0]))).item()
        1.0
    """
    return cell.length * cell.mean(1)


def line_by_curvature(cell: LineCell) -> Scalar:
    """`h^2 / 8` times the mean of |f''| at the ends: the error of linear interpolation.

    Args:
        cell: with second derivatives.

    Returns:
        A number [unit of the function].

    Raises:
        ValueError: if the cell holds no second derivatives.

    Reference: R07 §9.3 asks for it; the constant is `interpolation_error`'s.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction import LineCell, line_by_curvature
        >>> parabola = jnp.array([0.0, 0.0, 2.0]), jnp.array([1.0, 2.0, 2.0])
        >>> line_by_curvature(LineCell(jnp.array(1.0), *parabola)).item()  # x^2: 1/4 at 1/2
        0.25
    """
    return interpolation_error(cell.length, cell.mean(2), 1)


@functools.cache  # the same object again, which is compiled already
def line_by_disagreement(data: int) -> Driver:
    """Driver: the distance between Hermite curves of `data` and of all known numbers per node.

    `max |p_all - p_data|` over nine places in the cell: what the interpolant that will be used
    gets wrong, as far as the derivatives that it leaves out can tell. With slopes it needs no
    second derivative to see the error of linear interpolation.

    Args:
        data: of the interpolant whose error is wanted; fewer than the function returns.

    Raises:
        ValueError: from the driver, if the function returns no more than `data` numbers.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction import LineCell, line_by_disagreement
        >>> parabola = jnp.array([0.0, 0.0]), jnp.array([1.0, 2.0])
        >>> line_by_disagreement(1)(LineCell(jnp.array(1.0), *parabola)).item()
        0.25
    """

    def driver(cell: LineCell) -> Scalar:
        known = cell.left.shape[0]
        if known <= data:
            raise ValueError(
                f"Argument `data` must be less than the {known} numbers that `function` returns, "
                f"but is {data}."
            )
        t = as_float(np.linspace(0.1, 0.9, 9)).astype(cell.left.dtype)
        powers = cell.length ** jnp.arange(known)
        both = jnp.stack([cell.left, cell.right]) * powers
        all_of_it = jnp.sum(hermite_basis(t, known) * both, (-2, -1))
        fewer = jnp.sum(hermite_basis(t, data) * both[:, :data], (-2, -1))
        return jnp.max(jnp.abs(all_of_it - fewer))

    return driver


# --- the table ---------------------------------------------------------------------------------


class LineSamples(Module):
    """Samples of a function along a line, in rising order; a break is there twice.

    Attributes:
        x: positions [any unit].
        data: value, slope, second derivative at each, in columns, as many as are known.
        order: when each was taken; those that it began with come first.

    Example:
        >>> from firstorder.reconstruction import LineSamples, sample_line
        >>> line = sample_line(lambda x: (x**2, 2.0 * x), 0.0, 1.0, budget=4, initial=3)
        >>> isinstance(line, LineSamples)
        True
        >>> print(line)
           x   value  slope  order
         0.0     0.0    0.0      0
         0.5    0.25    1.0      1
        0.75  0.5625    1.5      3
         1.0     1.0    2.0      2
    """

    x: Float[Array, " n"]
    data: Float[Array, "n k"]
    order: Int[Array, " n"]

    @property
    def value(self) -> Float[Array, " n"]:
        """The values."""
        return self.data[:, 0]

    def interpolant(self, data: int | None = None) -> HermiteInterpolant:
        """Curve through the samples: 1 linear, 2 cubic, 3 quintic; left out, as high as possible.

        Raises:
            ValueError: if more is asked for than is known.
        """
        known = self.data.shape[1]
        if data is not None and not 1 <= data <= known:
            raise ValueError(f"Argument `data` must lie in [1, {known}], but is {data}.")
        return HermiteInterpolant(self.x, self.data[:, :data])

    def columns(self) -> dict[str, np.ndarray]:
        """The table by columns, as `io.write_csv` takes it."""
        names = ("value", "slope", "second")[: self.data.shape[1]]
        known = {name: np.asarray(self.data[:, i]) for i, name in enumerate(names)}
        return {"x": np.asarray(self.x), **known, "order": np.asarray(self.order)}

    def __str__(self) -> str:
        """The table, a line for each sample; of many the first and the last."""
        if not is_concrete(self):
            return repr(self)
        text = []
        for name, column in self.columns().items():
            words = [f"{v:.6}" if column.dtype.kind == "f" else str(v) for v in column]
            width = max(map(len, [name, *words]))
            text.append([word.rjust(width) for word in [name, *words]])
        return table(["  ".join(line) for line in zip(*text, strict=True)])


# --- the sampler -------------------------------------------------------------------------------


def sample_line(
    function: Callable[[Scalar], Sequence[Any]],
    low,
    high,
    budget: int,
    driver: Driver = line_by_gradient,
    *,
    initial: int = 9,
    batch: int | float = 1,
    breaks=(),
) -> LineSamples:
    """Samples of a function on [low, high], each in the middle of the most important cell.

    Every smooth piece begins with `initial` even samples. A break is sampled on both sides, a few
    roundings inside each piece, and no cell crosses it. Runs compiled, under `jit` and `vmap` too;
    the parameters of `function` are differentiable if it is a pytree (`equinox.Partial`, a module),
    for the positions that were chosen.

    A cell whose importance is not finite, or that is a few roundings short, is split last of all.

    Args:
        function: maps x to (value,), (value, slope) or (value, slope, second derivative).
        low: where the line begins.
        high: where it ends.
        budget: how many samples there will be, those at the beginning included.
        driver: what makes a cell important, such as `line_by_gradient`.
        initial: samples of each piece at the beginning, its two ends among them.
        batch: cells that are split at a time, a count or (below 1) a share of all; the more, the
            less greedy, and the fewer the steps.
        breaks: where the function jumps or has a kink, in rising order.

    Raises:
        ValueError: if the ends and breaks do not rise, an end is more than one number, or a count
            is too small.

    Reference: R07 §6.3, §9.1 and §9.2.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.reconstruction import sample_line
        >>> line = sample_line(lambda x: (jnp.tanh(9.0 * x), 9.0 / jnp.cosh(9.0 * x) ** 2),
        ...                    -1.0, 1.0, budget=32)
        >>> int(jnp.sum(jnp.abs(line.x) < 0.25))  # a quarter of the line, most of the samples
        24
    """
    check_one("low", low)
    check_one("high", high)
    parts = [jnp.atleast_1d(as_float(part)) for part in (low, breaks, high)]
    ends = jnp.concatenate(parts)
    pieces = ends.size - 1
    _check(ends, pieces, budget, initial, batch)
    sizes = _sizes(pieces * initial, pieces, budget, batch)
    steps, widest = jnp.asarray(np.array(sizes, np.int32)), max(sizes)
    x, order, data = _run(function, driver, ends, initial, budget, steps, widest)
    rising = jnp.all(jnp.diff(ends) > 0)
    return LineSamples(nan_unless(rising, x), data, order)


def _check(ends, pieces, budget, initial, batch) -> None:
    check_finite("ends", ends)
    if is_concrete(ends) and not bool(jnp.all(jnp.diff(ends) > 0)):
        raise ValueError(f"Arguments `low`, `breaks`, `high` must rise, but are {ends.tolist()}.")
    check_integer("budget", budget)
    check_integer("initial", initial)
    check_positive("batch", batch)
    if initial < 2:
        raise ValueError(f"Argument `initial` must be at least 2, but is {initial}.")
    if budget < pieces * initial:
        raise ValueError(
            f"Argument `budget` must be at least {pieces * initial}, the samples at the beginning, "
            f"but is {budget}."
        )


def _sizes(count: int, pieces: int, budget: int, batch: int | float) -> list[int]:
    """Sample counts of all steps, the even ones first: known before anything is sampled."""
    nodes, sizes = count, []
    while nodes < budget:
        cells = nodes - pieces
        wanted = max(int(batch * cells), 1) if batch < 1 else int(batch)
        sizes.append(min(wanted, cells, budget - nodes))
        nodes += sizes[-1]
    widest = max(sizes, default=budget - pieces)
    even = [min(widest, count - done) for done in range(0, count, widest)]
    return even + sizes


class _State(NamedTuple):
    """Nodes and cells, in arrays that are as long as they will ever be."""

    x: Array  # positions of the nodes, in the order of insertion
    data: Array  # what is known there
    left: Array  # cells: their first node
    right: Array  # and their second
    weight: Array  # and their importance; -inf where there is no cell yet
    nodes: Array  # how many nodes there are


@eqx.filter_jit
def _run(function, driver, ends, initial: int, budget: int, sizes, widest: int):
    """The greedy loop; `sizes` is what each step samples, `widest` the most of them.

    The even samples of the beginning go through the same loop: `function` is compiled once.
    """
    pieces = ends.size - 1
    grid, inner, rounding = _even(ends, initial)
    count, cells = grid.size, budget - pieces
    slots = jnp.arange(widest, dtype=sizes.dtype)

    def importance(x, data, a, b):
        length = x[b] - x[a]
        w = jax.vmap(driver)(LineCell(length, data[a], data[b]))
        last = jnp.finfo(data.dtype).min  # below all that a driver says, above what is no cell
        return jnp.where(jnp.isfinite(w) & (length > 4.0 * rounding), w, last)

    def known(x):
        return jax.vmap(lambda s: jnp.stack([as_float(v) for v in function(s)]))(x)

    def step(s: _State, size):
        node, live = s.nodes + slots, slots < size
        even, begins = node < count, node % initial == 0
        _, chosen = jax.lax.top_k(s.weight, widest)
        # An even node closes the cell to its left, unless a piece begins with it; a later one
        # stands in the middle of a chosen cell, and opens another to its right.
        a, b = jnp.where(even, node - 1, s.left[chosen]), s.right[chosen]
        old = jnp.where(even, node - 1 - node // initial, chosen)
        # What is not to be written points past the end, where writes are dropped.
        old = jnp.where(live & ~(even & begins), old, cells)
        new = jnp.where(live & ~even, node - pieces, cells)
        at = jnp.where(live, node, budget)
        middle = 0.5 * (s.x[a] + s.x[b])
        x = s.x.at[at].set(jnp.where(even, grid[node], middle), mode="drop")
        data = s.data.at[at].set(known(jnp.where(even, inner[node], middle)), mode="drop")
        weight = s.weight.at[old].set(importance(x, data, a, node), mode="drop")
        weight = weight.at[new].set(importance(x, data, node, b), mode="drop")
        left = s.left.at[old].set(a, mode="drop").at[new].set(node, mode="drop")
        right = s.right.at[old].set(node, mode="drop").at[new].set(b, mode="drop")
        return _State(x, data, left, right, weight, s.nodes + size), None

    shape = jax.eval_shape(known, grid[:1])
    no_cell = jnp.zeros(cells, sizes.dtype)
    start = _State(
        jnp.zeros(budget, grid.dtype),
        jnp.zeros((budget, shape.shape[1]), shape.dtype),
        no_cell,
        no_cell,
        jnp.full(cells, -jnp.inf, shape.dtype),
        jnp.zeros((), sizes.dtype),
    )
    end, _ = jax.lax.scan(step, start, sizes)
    # Stable: of the two nodes at a break the left one comes first.
    order = jnp.argsort(end.x, stable=True)
    return end.x[order], order, end.data[order]


def _even(ends, initial: int):
    """Even places of every piece, the places at which to evaluate them, and how places round."""
    t = jnp.linspace(0.0, 1.0, initial, dtype=ends.dtype)
    low, high = ends[:-1, None], ends[1:, None]
    grid = (low + (high - low) * t).at[:, -1].set(ends[1:])  # the sum may miss it by a rounding
    # At a break, ask for the value on the piece's own side.
    rounding = float(jnp.finfo(ends.dtype).eps) * jnp.max(jnp.abs(ends))
    near = jnp.minimum(64.0 * rounding, 0.25 * (high - low)[:, 0] / (initial - 1))
    inner = grid.at[:, 0].add(near).at[:, -1].add(-near)
    inner = inner.at[0, 0].set(ends[0]).at[-1, -1].set(ends[-1])
    return grid.ravel(), inner.ravel(), rounding
