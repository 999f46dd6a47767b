"""Adaptive sampling of an image: squares that matter are split in four until the budget is spent.

A sample lies in the middle of each square, so what is known of the picture there (its gradient, its
second derivatives, what a frequency analysis says) tells what the square still hides. A metric puts
that as a number, the root of the square's error integrated over it:

    |grad I| h^2 if a square shows its sample's value, |Hess I| h^3 if it shows its tangent plane

Squares in which two objects meet are split before all others, down to the pixel. Samples lie in
pixels of the image, where (0, 0) is a corner; all that were taken are kept.

Many squares are split at once, the most important share of them, so that shading works on batches:
a strict order wants one square at a time. A partition of the importances finds them; all of the
tree takes 0.2 us a sample then, where a heap's pushes and pops alone take 2 (benchmarks).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import check_integer, check_positive
from firstorder._display import in_print
from firstorder._labelled import DataFrame, data_frame
from firstorder.reconstruction.importance import (
    Metric,
    Numbers,
    Places,
    QuadtreeCells,
    ShadedSamples,
    by_gradient,
)

Shade = Callable[[Places], ShadedSamples]


# --- samples -------------------------------------------------------------------------------------


class ImageSamples(NamedTuple):
    """The samples of an image, in the order in which they were taken.

    Attributes:
        p: places [pixels].
        size: side of the square in whose middle each was taken.
        value: radiance.
        gradient: per pixel; None if the shading function gives none.
        leaf: whether the square was left whole.
        rounds: how often the shading function was called.
    """

    p: Places
    size: Numbers
    value: Numbers
    gradient: Float[np.ndarray, "n 2"] | None
    leaf: Bool[np.ndarray, " n"]
    rounds: int

    __repr__ = in_print

    def to_pandas(self) -> DataFrame:
        """A table with a row for each sample, in the order in which they were taken.

        Raises:
            ModuleNotFoundError: without the extra `tables`.

        Example:
            >>> import numpy as np
            >>> from firstorder.reconstruction import ShadedSamples, sample_image
            >>> ramp = lambda p: ShadedSamples(p[:, 0], np.ones_like(p), None)
            >>> list(sample_image(ramp, 4, 4, 8).to_pandas())
            ['px', 'py', 'size', 'value', 'd_px', 'd_py', 'leaf']
        """
        columns = {"px": self.p[:, 0], "py": self.p[:, 1], "size": self.size, "value": self.value}
        if self.gradient is not None:
            columns |= {"d_px": self.gradient[:, 0], "d_py": self.gradient[:, 1]}
        pixels = dict.fromkeys(("px", "py", "size"), "pixel")
        slopes = dict.fromkeys(("d_px", "d_py"), "value / pixel")
        return data_frame(columns | {"leaf": self.leaf}, pixels | slopes)


def sample_image(
    shade: Shade,
    width: int,
    height: int,
    budget: int,
    metric: Metric = by_gradient,
    *,
    labels: Int[np.ndarray | Array, "w h"] | None = None,
    block: int = 8,
    batch: float = 0.03,
    smallest: float = 0.5,
    thorough: bool = False,
) -> ImageSamples:
    """Samples of an image, placed by a metric of importance.

    Args:
        shade: from places to what is seen there; called once a round with all new places.
        width: of the image [pixels].
        height: of the image [pixels].
        budget: samples; the first grid counts, and the last square split may leave up to 3 over.
        metric: importance of squares, not negative.
        labels: what each pixel shows, first axis across. Squares with several are split first.
        block: side of the first squares, a power of 2 [pixels].
        batch: share of the squares to split in a round; 0 for one at a time.
        smallest: squares of this side are left whole [pixels].
        thorough: whether squares of no importance are split too, by their area, once no others are
            left: a shadow's core may have its edge in a corner. Otherwise the error has a floor
            there that no budget removes.

    Raises:
        ValueError: if the first grid needs more than the budget, the block is no power of 2, what
            `shade` returns does not fit, or the metric gives a number that is none.

    Reference: R07 §9.1.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, by_gradient
        >>> from firstorder.reconstruction import sample_image
        >>> def step(p):  # a blurred edge at the middle
        ...     x = p[:, 0] - 16.0
        ...     return ShadedSamples(np.tanh(x), np.stack([1.0 / np.cosh(x) ** 2, 0.0 * x], -1))
        >>> found = sample_image(step, 32, 32, 100, by_gradient)
        >>> len(found.p), bool(np.median(abs(found.p[:, 0] - 16.0)) < 3.0)
        (100, True)
    """
    _check(width, height, budget, block, batch, smallest)
    mixed = None if labels is None else _Mixed(np.asarray(labels), width, height, block)
    corner, columns = _first(width, height, block)
    if len(corner) > budget:
        raise ValueError(
            f"Argument `budget` must be at least {len(corner)}, one sample a block, "
            f"but is {budget}."
        )
    tree = _Tree(budget, metric, mixed, smallest, (width, height), thorough)
    size = np.full(len(corner), float(block))
    p = tree.middles(corner, size)
    found = _shaded(shade, p)
    tree.add(corner, size, p, found, *_around_grid(found, p, columns))
    while (chosen := tree.choose(batch)).size:
        corner, size = _quarters(tree.corner[chosen], tree.size[chosen])
        inside = np.all(corner < (width, height), axis=1)
        p = tree.middles(corner[inside], size[inside])
        found = _shaded(shade, p)
        around = _around_siblings(found, p, inside)
        tree.leaf[chosen], tree.importance[chosen] = False, WHOLE
        tree.add(corner[inside], size[inside], p, found, *around)
    return tree.samples()


def _check(width, height, budget, block, batch, smallest) -> None:
    for name, count in dict(width=width, height=height, budget=budget, block=block).items():
        check_integer(name, count)
    named = dict(width=width, height=height, budget=budget, block=block, smallest=smallest)
    for name, number in named.items():
        check_positive(name, number)
    if block & (block - 1):
        raise ValueError(f"Argument `block` must be a power of 2, but is {block}.")
    if not 0.0 <= batch <= 1.0:
        raise ValueError(f"Argument `batch` must be within [0, 1], but is {batch}.")


def _shaded(shade: Shade, p: Places) -> ShadedSamples:
    """Values and gradients at places, by a user's function, as arrays.

    Raises:
        ValueError: if there is not one value and gradient for each.
    """
    found = shade(p)
    if not isinstance(found, ShadedSamples):
        raise ValueError(
            f"Argument `shade` must return ShadedSamples, but gives a {type(found).__name__}."
        )
    value = np.asarray(found.value, float)
    gradient = None if found.gradient is None else np.asarray(found.gradient, float)
    for what, x, shape in (("value", value, p.shape[:1]), ("gradient", gradient, p.shape)):
        if x is not None and x.shape != shape:
            raise ValueError(
                f"Argument `shade` must return one {what} for each place, shape {shape}, but gives "
                f"shape {x.shape}."
            )
    more = None if found.more is None else np.asarray(found.more)
    return found._replace(value=value, gradient=gradient, more=more)


def _first(width: int, height: int, block: int) -> tuple[Places, int]:
    """Corners of the first squares, and how many stand in a row."""
    x, y = (np.arange(0.0, n, block) for n in (width, height))
    return np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2), len(x)


def _quarters(
    corner: Places, size: Numbers
) -> tuple[Float[np.ndarray, "m 2"], Float[np.ndarray, " m"]]:
    """Corners and sizes; four rows follow one another: (0, 0), (0, 1), (1, 0), (1, 1)."""
    half = 0.5 * size
    step = np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
    return (corner[:, None] + half[:, None, None] * step).reshape(-1, 2), np.repeat(half, 4)


def _around_grid(found: ShadedSamples, p: Places, columns: int) -> tuple:
    """Differences, bending and variance of neighbours in the first grid."""
    V = found.value.reshape(columns, -1)
    at = p.reshape(*V.shape, 2)
    places = at[:, 0, 0], at[0, :, 1]  # along the border squares are cut, and middles closer
    bending = None
    if found.gradient is not None:
        both = [_grid_differences(g.reshape(V.shape), places) for g in found.gradient.T]
        bending = _symmetric(np.stack(both, 1))
    return _grid_differences(V, places), bending, _grid_variance(V).ravel()


def _grid_variance(V: np.ndarray) -> np.ndarray:
    """Unbiased variance of fours of neighbours: the mean of those that hold a square."""
    i, j = (min(n, 2) for n in V.shape)
    if i * j == 1:
        return np.zeros_like(V)
    fours = np.lib.stride_tricks.sliding_window_view(V, (i, j))
    each = np.var(fours, axis=(2, 3), ddof=1)
    total, count = np.zeros_like(V), np.zeros_like(V)
    for a in range(i):
        for b in range(j):
            at = slice(a, a + each.shape[0]), slice(b, b + each.shape[1])
            total[at] += each
            count[at] += 1.0
    return total / count


def _grid_differences(V: np.ndarray, places: tuple) -> Float[np.ndarray, "n 2"]:
    slope = [np.gradient(V, places[k], axis=k) if n > 1 else 0.0 * V for k, n in enumerate(V.shape)]
    return np.stack(slope, -1).reshape(-1, 2)


def _around_siblings(found: ShadedSamples, p: Places, inside) -> tuple:
    """Differences between the quarters of one square; those outside of the image do not count."""
    bending = None
    if found.gradient is not None:
        both = [_sibling_differences(g, p, inside) for g in found.gradient.T]
        bending = _symmetric(np.stack(both, 1))
    V = np.full(len(inside), np.nan)
    V[inside] = found.value
    V = V.reshape(-1, 4)
    count = np.maximum(np.sum(~np.isnan(V), 1), 1)
    mean = np.nansum(V, 1) / count
    spread = np.nansum((V - mean[:, None]) ** 2, 1) / np.maximum(count - 1, 1)
    differences = _sibling_differences(found.value, p, inside)
    return differences, bending, np.repeat(spread, 4)[inside]


def _sibling_differences(value, p: Places, inside) -> Float[np.ndarray, "n 2"]:
    V = np.full((len(inside), 3), np.nan)
    V[inside] = np.column_stack([value, p])  # middles of cut squares are closer than a side
    V, x, y = np.moveaxis(V.reshape(-1, 2, 2, 3), -1, 0)
    across = (V[:, 1, :] - V[:, 0, :]) / (x[:, 1, :] - x[:, 0, :])
    up = (V[:, :, 1] - V[:, :, 0]) / (y[:, :, 1] - y[:, :, 0])
    both = np.stack(np.broadcast_arrays(across[:, None, :], up[:, :, None]), -1).reshape(-1, 2)
    return np.nan_to_num(both[inside])


def _symmetric(H: np.ndarray) -> Float[np.ndarray, "n 2 2"]:
    return 0.5 * (H + np.swapaxes(H, 1, 2))


class _Mixed:
    """Mask of squares of the image in which several objects meet."""

    def __init__(self, labels: np.ndarray, width: int, height: int, block: int):
        if labels.shape != (width, height):
            raise ValueError(
                f"Argument `labels` must have shape ({width}, {height}), but has {labels.shape}."
            )
        self.levels, side = {}, block
        while side > 1:
            fill = [(0, -n % side) for n in labels.shape]
            L = np.pad(labels, fill, mode="edge")
            tiles = L.reshape(L.shape[0] // side, side, L.shape[1] // side, side)
            self.levels[side] = tiles.min((1, 3)) != tiles.max((1, 3))
            side //= 2

    def __call__(self, corner: Places, size: float) -> Bool[np.ndarray, " n"]:
        """Whether squares of one size are mixed."""
        level = self.levels.get(int(size))
        if level is None:
            return np.zeros(len(corner), bool)
        i, j = (corner / size).astype(int).T
        return level[i, j]


WHOLE = -1.0  # importance of a square that is not to be split, or was
LEAST = 1e-200  # times the area: importance, if need be, of a square in which nothing shows


class _Tree:
    """The samples so far, in arrays that are long enough from the beginning."""

    def __init__(self, budget: int, metric: Metric, mixed, smallest: float, ends, thorough: bool):
        room = budget + 3
        self.budget, self.metric, self.mixed, self.smallest = budget, metric, mixed, smallest
        self.ends, self.thorough = ends, thorough
        self.count, self.rounds = 0, 0
        self.corner, self.p = np.empty((room, 2)), np.empty((room, 2))
        self.size, self.value = np.empty(room), np.empty(room)
        self.gradient: np.ndarray | None = None
        self.leaf = np.ones(room, bool)
        self.importance = np.full(room, WHOLE)
        # Among equals the choice is spread out, and does not go row by row.
        self.spread = 1.0 + 1e-13 * np.modf(0.5 * (np.sqrt(5.0) - 1.0) * np.arange(room))[0]

    def middles(self, corner: Places, size: Numbers) -> Places:
        """Middles of the squares, of the part that lies in the image."""
        return 0.5 * (corner + np.minimum(corner + size[:, None], self.ends))

    def add(self, corner: Places, size: Numbers, p: Places, found: ShadedSamples, *around) -> None:
        """New squares with what was found in them."""
        at = slice(self.count, self.count + len(p))
        self.corner[at], self.size[at], self.p[at], self.value[at] = corner, size, p, found.value
        if found.gradient is not None:
            if self.gradient is None:
                self.gradient = np.zeros_like(self.p)
            self.gradient[at] = found.gradient
        importance = np.asarray(self.metric(QuadtreeCells(size, found, *around)), float)
        if importance.shape != size.shape:
            raise ValueError(
                f"Argument `metric` must give one number for each square, shape {size.shape}, but "
                f"gives shape {importance.shape}."
            )
        if not np.all(importance >= 0.0):
            raise ValueError("Argument `metric` must give numbers from 0 up, but does not.")
        if self.thorough:
            importance = np.maximum(importance, LEAST * size**2)
        if self.mixed is not None:
            for side in np.unique(size):
                where = size == side
                hit = self.mixed(corner[where], side)
                importance[where] = np.where(hit, np.inf, importance[where])
        self.importance[at] = np.where(size <= self.smallest, WHOLE, importance)
        self.count += len(p)
        self.rounds += 1

    def choose(self, batch: float) -> Int[np.ndarray, " k"]:
        """The squares to split next: the most important ones that the budget allows."""
        importance = self.importance[: self.count]
        left = -(-(self.budget - self.count) // 4)
        edges = np.flatnonzero(np.isinf(importance))
        if edges.size:
            return edges[np.argsort(-self.size[edges], kind="stable")][: max(left, 0)]
        splittable = np.count_nonzero(importance > 0.0)
        k = min(max(int(batch * self.count), 1), left, splittable)
        if k <= 0:
            return np.empty(0, int)
        spread = importance * self.spread[: self.count]
        return np.argpartition(spread, self.count - k)[self.count - k :]

    def samples(self) -> ImageSamples:
        """All samples found so far."""
        n = self.count
        gradient = None if self.gradient is None else self.gradient[:n]
        return ImageSamples(
            self.p[:n], self.size[:n], self.value[:n], gradient, self.leaf[:n], self.rounds
        )
