"""Density of points on a line, from the points: fixed width or k nearest, and their known errors.

The estimators work on sorted positions and run on the device. What they do on average, and how much
they scatter, is known exactly for independent points of any density: `expected_fixed_radius` and
`expected_k_nearest` integrate it from the density's cumulative function, bias at boundaries
included.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from scipy.special import betaincinv

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_integer,
    check_positive,
)
from firstorder._display import Module, in_print
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._refinement import with_errors


class DensityEstimator(Module):
    """An estimator of irradiance from a photon map: `k` nearest photons, or a fixed `radius`.

    One of both worlds: in flatland photons count within a length, in space within a disc.

    Args:
        k: how many photons; 0 for a fixed radius.
        radius: the width to each side; 0 for k nearest [m].
        keep_farthest: whether the k-th photon counts, as J12 (30) has it: `k / (k - 1)` too bright.
        cut: whether the width is cut at the ends of a curve or the edges of a face, which removes
            the bias there.

    Raises:
        ValueError: unless just one of `k` and `radius` is positive.

    Example:
        >>> from firstorder.flatland.bounces import DensityEstimator
        >>> DensityEstimator(k=50).excess
        1.0
    """

    k: int = eqx.field(default=0, static=True)
    radius: float = eqx.field(default=0.0, static=True)
    keep_farthest: bool = eqx.field(default=False, static=True)
    cut: bool = eqx.field(default=False, static=True)

    def __check_init__(self):
        """Refuse what is neither, or both; a single photon has no width without itself."""
        check_integer("k", self.k)
        if (self.k > 0) == (self.radius > 0.0):
            raise ValueError("Just one of the arguments `k` and `radius` must be positive.")
        if self.k == 1:
            raise ValueError("Argument `k` must be at least 2, but is 1.")

    @property
    def excess(self) -> float:
        """The factor by which a uniform density is overestimated on average."""
        return self.k / (self.k - 1.0) if self.k and self.keep_farthest else 1.0


class Window(NamedTuple):
    """Points around a place, and the width that they span.

    Attributes:
        first, last: their numbers in sorted order, `first <= i < last`.
        radius: half the length of the window.
    """

    first: Int[Array, "*n"]
    last: Int[Array, "*n"]
    radius: Float[Array, "*n"]


def fixed_window(
    at: Float[Array, " m"],
    x: Float[Array, " q"],
    radius: Float[Array, " q"],
    low: Int[Array, " q"],
    high: Int[Array, " q"],
) -> Window:
    """The points within a distance of x, among those numbered low to high - 1.

    Args:
        at: positions, sorted.
        x: where.
        radius: how far.
        low: number of the first point that may count.
        high: one past that of the last.
    """
    first = jnp.searchsorted(at, x - radius, side="left")
    last = jnp.searchsorted(at, x + radius, side="right")
    return Window(jnp.clip(first, low, high), jnp.clip(last, low, high), radius)


def nearest_window(
    at: Float[Array, " m"],
    x: Float[Array, " q"],
    k: int | Int[Array, " q"],
    low: Int[Array, " q"],
    high: Int[Array, " q"],
) -> Window:
    """The k points nearest to x, among those numbered low to high - 1; all, if there are fewer.

    By bisection for the first of k consecutive points: O(log m) for each x, nothing is sorted.

    Args:
        at: positions, sorted.
        x: where.
        k: how many, everywhere or at each x.
        low: number of the first point that may count.
        high: one past that of the last.

    Raises:
        ValueError: if k is not positive.
    """
    if isinstance(k, int) and k < 1:
        raise ValueError(f"Argument `k` must be positive, but is {k}.")
    last = at.shape[0] - 1

    def halve(_, ends):
        left, right = ends
        middle = (left + right) // 2
        # Move on while the point that would be dropped is farther than the one that would come.
        after = at[jnp.clip(middle + k, 0, last)] - x
        onward = x - at[jnp.clip(middle, 0, last)] > after
        searching = left < right
        left = jnp.where(searching & onward, middle + 1, left)
        right = jnp.where(searching & ~onward, middle, right)
        return left, right

    steps = max(int(np.ceil(np.log2(at.shape[0] + 1))) + 1, 1)
    first, _ = jax.lax.fori_loop(0, steps, halve, (low, jnp.maximum(high - k, low)))
    end = jnp.minimum(first + k, high)
    ends = jnp.stack([at[jnp.clip(first, 0, last)], at[jnp.clip(end - 1, 0, last)]])
    radius = jnp.where(end > first, jnp.max(jnp.abs(ends - x), 0), jnp.inf)
    return Window(first, end, radius)


# --- what to expect ------------------------------------------------------------------------------


class ExpectedDensity(NamedTuple):
    """Mean and standard deviation of an estimate.

    Attributes:
        mean: of the density estimate, an array with an entry for each place.
        spread: standard deviation of one run, an array of that shape.
    """

    mean: np.ndarray
    spread: np.ndarray

    __repr__ = in_print


Cumulative = Callable[[np.ndarray], np.ndarray]
WIDEST = np.log(1e100)  # of all radii that are looked for, in any unit


def expected_fixed_radius(cumulative: Cumulative, x, radius: float, count: int) -> ExpectedDensity:
    """Mean and spread of the estimate `count in radius / (2 r)` of a density, exactly: `p / (2 r)`.

    `p = C(x + r) - C(x - r)` is the chance of a point to fall into the window, so their number is
    binomial. For a smooth density the mean is `f + f'' r^2 / 6`; at an end of the line `f / 2`;
    at a kink in which f' jumps by J, `f + J r / 4`.

    Args:
        cumulative: chance that a point lies to the left of a place, constant beyond the ends.
        x: where.
        radius: half the width.
        count: number of points, wherever they fall.

    Returns:
        Mean and spread of `points inside / (2 r count)`.

    Raises:
        ValueError: if the radius is not positive, a place not finite, or `count` no positive
            integer.

    Example:
        >>> import numpy as np
        >>> from firstorder.sampling import expected_fixed_radius
        >>> even = lambda x: np.clip(x, 0.0, 1.0)
        >>> mean, spread = expected_fixed_radius(even, [0.5, 0.0], 0.125, 1000)
        >>> mean.tolist()  # half of it at the end
        [1.0, 0.5]
    """
    check_positive("radius", radius)
    check_count("count", count)
    check_finite("x", x)
    x = np.asarray(x, float)
    # A sum of shares may end a rounding above 1.
    p = np.clip(cumulative(x + radius) - cumulative(x - radius), 0.0, 1.0)
    return ExpectedDensity(p / (2 * radius), np.sqrt(p * (1 - p) / count) / (2 * radius))


@with_errors("nodes")
def expected_k_nearest(
    cumulative: Cumulative,
    x,
    k: int,
    count: int,
    kept: int | None = None,
    nodes: int = 200,
    with_error: bool = False,
) -> ExpectedDensity:
    """Mean and spread of the k-nearest estimate of a density, exactly for independent points.

    The chance `p(R)` that the window up to the k-th point holds is Beta(k, count - k + 1)
    distributed, whatever the density: `E[g(R)] = int g(R(p)) Beta(p) dp`. For a uniform density
    `R = p / (2 f)` and the mean of `kept / (2 R count)` is `f kept / (k - 1)`: an excess of
    `k / (k - 1)` if all k are kept, none if the farthest is left out.

    Args:
        cumulative: chance that a point lies to the left of a place, constant beyond the ends.
        x: where.
        k: how many points decide the width.
        count: number of points, wherever they fall.
        kept: how many of them count; k if not given.
        nodes: of the quadrature over p.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Returns:
        Mean and spread of `kept / (2 R count)`. For `k = 2` the spread is infinite where points lie
        on both sides, and what is given for it is not to be used.

    Raises:
        ValueError: unless k lies between 2 and `count`: of the nearest point alone the mean is
            infinite. If a place is not finite, or `kept` is no integer from 1 to k.

    Example:
        >>> import numpy as np
        >>> from firstorder.sampling import expected_k_nearest
        >>> even = lambda x: np.clip(x, 0.0, 1.0)
        >>> round(expected_k_nearest(even, [0.5], 11, 1000).mean[0].item(), 6)  # 11 / 10
        1.1
    """
    check_count("k", k)
    check_count("count", count)
    check_finite("x", x)
    if not 2 <= k <= count:
        raise ValueError(f"Argument `k` must lie in [2, {count}], but is {k}.")
    x = np.atleast_1d(np.asarray(x, float))
    kept = k if kept is None else kept
    check_count("kept", kept)
    if kept > k:
        raise ValueError(f"Argument `kept` must be at most `k`, {k}, but is {kept}.")
    t, w = gauss_legendre(nodes)
    # The substitution u = (3 - v^2) v / 4 + 1/2 flattens the quantile's steep ends.
    u, w = 0.5 + 0.25 * t * (3.0 - t**2), w * 0.75 * (1.0 - t**2)
    p = betaincinv(k, count - k + 1, u)
    low, high = np.full((2, x.size, nodes), [[[-WIDEST]], [[WIDEST]]])
    for _ in range(80):  # bisect for the logarithm of the radius at which the window holds p
        middle = 0.5 * (low + high)
        r = np.exp(middle)
        inside = cumulative(x[:, None] + r) - cumulative(x[:, None] - r) < p
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    f = kept / (2.0 * np.exp(0.5 * (low + high)) * count)
    mean = f @ w
    return ExpectedDensity(mean, np.sqrt(np.maximum((f - mean[:, None]) ** 2 @ w, 0.0)))
