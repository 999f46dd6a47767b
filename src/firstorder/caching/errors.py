"""True errors of records, the regions at which they reach a tolerance, and errors of images.

The first two need the true irradiance around the record, which nobody has while rendering: they
judge the regions that are made from derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy import ndimage, optimize

from firstorder._argument_checks import check_count, check_one, check_positive, nan_unless
from firstorder._display import Module
from firstorder.caching._records import checked_order
from firstorder.caching.cache import taylor
from firstorder.caching.candidates import Candidates, _as_number
from firstorder.caching.radii import DEFINITIONS
from firstorder.caching.regions import (
    CUT,
    FREE,
    RAISED,
    ValidityRegion,
    _check_regions,
    _checked_limits,
)
from firstorder.numerics._quadrature import composite_gauss_legendre, gauss_legendre
from firstorder.numerics._refinement import with_errors
from firstorder.typing import as_float


@with_errors("nodes", "directions")
def true_error(
    E: Callable[[Array], Array],
    records: Candidates,
    region: ValidityRegion,
    *,
    order: int = 1,
    definition: str = "total",
    breaks: tuple[ArrayLike, ...] = (),
    nodes: int = 32,
    directions: int = 64,
    with_error: bool = False,
) -> Float[Array, " m"]:
    """The error of each record's extrapolation over its region, by quadrature of the definition.

    Along a line Gauss-Legendre panels, cut at the record and at `breaks`; on a plane Gauss-Legendre
    along the radius and equally spaced directions. The modulus has kinks wherever the expansion
    crosses E elsewhere; there the error is that of one panel, some `1 / nodes^2`, or of one cell,
    some `1 / directions^2`.

    Args:
        E: the true irradiance, a jittable function of a place (d,), which gives one number [W/m^d].
        records: places, values and derivatives.
        region: of each.
        order: of the extrapolation, 0, 1 or 2.
        definition: one of `DEFINITIONS`; "largest" is taken over the nodes.
        breaks: arc lengths of the kinks of E, along a line, one number or an array each [m].
        nodes: per panel, or along the radius.
        directions: around, on a plane.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        TypeError: if `region` is a number or an array of radii.
        ValueError: for another definition, breaks on a plane, a Hessian that is missing, or regions
            that are not as many as records, or have other dimensions.

    Reference: J12 eqs. 53 (a line) and 67 (a plane), order 1, total.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Candidates, circular_regions, true_error
        >>> flat = Candidates.on_line(jnp.zeros(1), jnp.zeros((1, 2)))
        >>> half = circular_regions(jnp.array([0.5]), 0.1, 1.0)
        >>> round(true_error(jnp.square, flat, half).item(), 12)
        0.083333333333
        >>> flat = Candidates.of(jnp.zeros((1, 2)), jnp.zeros(1), jnp.zeros((1, 2)))
        >>> disc = circular_regions(jnp.ones(1), 0.1, 1.0, dims=2)
        >>> round(true_error(lambda x: x @ x, flat, disc).item(), 6)
        1.570796
    """
    _checked(definition, records, order, breaks)
    _check_regions(region, records.count, records.dims)
    check_count("directions", directions)
    rule = _Rule(order, definition, nodes, directions)
    cut = _each(breaks)
    return jax.vmap(lambda record, matrix: rule.error(E, record, matrix, cut))(
        records, as_float(region.matrix)
    )


def _checked(definition: str, records: Candidates, order: int, breaks: tuple) -> None:
    if definition not in DEFINITIONS:
        raise ValueError(
            f"Argument `definition` must be one of {list(DEFINITIONS)}, but is {definition!r}."
        )
    if breaks and records.dims != 1:
        raise ValueError("Argument `breaks` must be left out on a plane.")
    records.derivative(checked_order(order))
    if definition == "relative":
        check_positive("value", records.value)


class _Rule(Module):
    """Quadrature of a definition of error."""

    order: int
    definition: str
    nodes: int
    directions: int

    def error(self, E, record: Candidates, matrix: Float[Array, "d d"], breaks) -> Array:
        """Error of one record."""
        dx, weight = self._region(record, matrix, breaks)
        expansion = taylor(record.value, record.gradient, record.hessian, dx, self.order)
        miss = jnp.abs(jax.vmap(_as_number(E))(record.position + dx) - expansion)
        if self.definition == "largest":
            return jnp.max(miss)
        total = jnp.sum(weight * (miss**2 if "squared" in self.definition else miss))
        if self.definition in ("average", "average squared"):
            return total / jnp.sum(weight)
        return total / record.value if self.definition == "relative" else total

    def _region(self, record: Candidates, matrix: Array, breaks) -> tuple[Array, Array]:
        """Steps (k, d) to the nodes in a region, and their weights."""
        if len(matrix) == 1:
            x, R = record.position[0], 1.0 / jnp.abs(matrix[0, 0])
            t, weight = composite_gauss_legendre(x - R, x + R, [x, *breaks], self.nodes)
            return (t - x)[:, None], weight
        t, w = gauss_legendre(self.nodes)
        r = 0.5 * (1.0 + t)
        phi = 2.0 * np.pi * (np.arange(self.directions) + 0.5) / self.directions
        unit = r[:, None, None] * np.stack([np.cos(phi), np.sin(phi)], -1)
        share = (0.5 * w * r)[:, None] * 2.0 * np.pi / self.directions
        inverse = jnp.linalg.inv(matrix)
        dx = jnp.asarray(unit, matrix.dtype).reshape(-1, 2) @ inverse.T
        weight = jnp.asarray(np.broadcast_to(share, unit.shape[:-1]), matrix.dtype).ravel()
        return dx, weight * jnp.abs(jnp.linalg.det(inverse))


def ideal_region(
    E: Callable[[Array], Array],
    records: Candidates,
    tolerance: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    *,
    order: int = 1,
    definition: str = "total",
    circle: bool = False,
    most: float = 8.0,
    breaks: tuple[ArrayLike, ...] = (),
    nodes: int = 32,
) -> ValidityRegion:
    """The largest region of each record whose true error is the tolerance, by search.

    The radius is found by halving its logarithm. On a plane this is done for a ratio of axes and an
    angle, which Nelder and Mead look for from three starts, on the host. The integrated errors grow
    with the radius, and the root is the only one; averages and the relative error do in practice,
    not by necessity. The search over shapes finds one of possibly several maxima.

    Args:
        E: the true irradiance, a jittable function of a place (d,), which gives one number [W/m^d].
        records: places, values and derivatives.
        tolerance: the error that is accepted, one positive number.
        low: smallest radius to look for, of an ellipse that of the circle of its area [m]; the
            answer if its error is too large already.
        high: largest [m]; the answer if its error is tolerated.
        order: of the extrapolation.
        definition: one of `DEFINITIONS`.
        circle: whether to keep both axes alike, on a plane.
        most: largest ratio of the axes.
        breaks: arc lengths of the kinks of E, along a line, one number or an array each [m].
        nodes: of the quadrature.

    Returns:
        The regions, with the codes of `circular_regions` where `low` or `high` is the answer; NaN
        where E is.

    Raises:
        ValueError: if the tolerance or a limit is not one positive number, limits are not in order
            or `most` is below 1, and as `true_error`.

    Reference: J12 §6.4 and Fig. 13 (left), there called the ideal setting.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import Candidates, ideal_region
        >>> flat = Candidates.on_line(jnp.zeros(1), jnp.zeros((1, 2)))
        >>> round(ideal_region(jnp.square, flat, 2.0 / 3.0, 0.1, 5.0).radius.item(), 9)
        1.0
    """
    for name, number in (("tolerance", tolerance), ("low", low), ("high", high)):
        check_one(name, number)
    check_positive("tolerance", tolerance)
    low, high = _checked_limits(low, high)
    if not most >= 1.0:
        raise ValueError(f"Argument `most` must be at least 1, but is {most!r}.")
    _checked(definition, records, order, breaks)
    dtype = records.value.dtype
    limits = [as_float(a).astype(dtype) for a in (tolerance, low, high)]
    rule = _Rule(order, definition, nodes, 64)
    cut = _each(breaks)

    @jax.jit
    def sizes(records, shapes):
        return jax.vmap(lambda record, shape: _largest(rule, E, record, shape, limits, cut))(
            records, shapes
        )

    shapes = jnp.zeros((records.count, 2), dtype)
    if records.dims == 2 and not circle:
        limit = float(np.log(most))
        every = [_best_shape(sizes, records.at(slice(i, i + 1)), limit) for i in range(len(shapes))]
        shapes = jnp.asarray(np.stack(every), dtype)
    radius, code = sizes(records, shapes)
    matrices = jax.vmap(lambda R, shape: _stretched(R, shape, records.dims))
    return ValidityRegion(matrices(radius, shapes), code)


def _stretched(R: Array, shape: Float[Array, "2"], dims: int) -> Float[Array, "d d"]:
    """Matrix of an ellipse with axes R e^(+-l/2), the longer at the angle; shape is l and that."""
    if dims == 1:
        return (1.0 / R).reshape(1, 1)
    c, s = jnp.cos(shape[1]), jnp.sin(shape[1])
    axes = jnp.stack([jnp.stack([c, -s]), jnp.stack([s, c])])
    inverse = jnp.stack([jnp.exp(-0.5 * shape[0]), jnp.exp(0.5 * shape[0])]) / R
    return (axes * inverse) @ axes.T


def _largest(rule: _Rule, E, record: Candidates, shape: Array, limits, breaks):
    """The radius at which a region of one shape has the tolerated error, and what limited it."""
    tolerance, low, high = limits

    def error(R):
        matrix = _stretched(R, shape, record.position.shape[-1])
        return rule.error(E, record, matrix, breaks)

    def halve(_, ends):
        a, b = ends
        m = jnp.sqrt(a * b)
        wrong = error(m) > tolerance
        return jnp.where(wrong, a, m), jnp.where(wrong, m, b)

    a, b = jax.lax.fori_loop(0, 52, halve, (low, high))
    least, most = error(low), error(high)
    code = jnp.where(least > tolerance, RAISED, jnp.where(most > tolerance, FREE, CUT))
    radius = jnp.where(code == RAISED, low, jnp.where(code == CUT, high, jnp.sqrt(a * b)))
    return nan_unless(~jnp.isnan(least + most), radius), code


def _best_shape(sizes, record: Candidates, limit: float) -> np.ndarray:
    """Log of the ratio of axes, held within its limits, and angle of the largest ellipse."""

    def held(given):
        return np.array([np.clip(given[0], -limit, limit), given[1]])

    def lost(given):
        return -float(sizes(record, jnp.asarray(held(given), record.value.dtype)[None])[0][0])

    starts = [np.array([0.1, 0.0]), np.array([0.7, 0.8]), np.array([0.7, -0.8])]
    found = [
        optimize.minimize(lost, s, method="Nelder-Mead", options={"maxfev": 60}) for s in starts
    ]
    return held(min(found, key=lambda f: f.fun).x)


def largest_set(
    miss: ArrayLike, cell: float, tolerance: float, *, near: tuple[int, int] | None = None
) -> tuple[np.ndarray, float]:
    """The largest set of cells over which a miss integrates to no more than the tolerance.

    Cells are taken in the order of their misses: nothing with the same error is larger, of any
    shape. What no ellipse reaches is what any shape could still gain.

    Args:
        miss: modulus of the miss at the middle of each cell (rows, columns).
        cell: area of a cell [m^2].
        tolerance: total error that is accepted, positive.
        near: row and column of the record; then only what is connected to it is kept.

    Returns:
        Which cells, and their area.

    Raises:
        ValueError: if the tolerance or the area is not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import largest_set
        >>> largest_set(np.array([[3.0, 1.0, 2.0]]), 1.0, 3.0)[0].tolist()
        [[False, True, True]]
    """
    check_positive("tolerance", tolerance)
    check_positive("cell", cell)
    miss = np.abs(np.asarray(miss, float))
    order = np.argsort(miss, axis=None, kind="stable")
    count = np.searchsorted(np.cumsum(miss.ravel()[order]) * cell, tolerance, side="right")
    chosen = np.zeros(miss.size, bool)
    chosen[order[:count]] = True
    chosen = chosen.reshape(miss.shape)
    if near is not None:
        parts = np.zeros(miss.shape, int)
        ndimage.label(chosen, output=parts)
        chosen = (parts == parts[tuple(near)]) & chosen
    return chosen, float(chosen.sum() * cell)


def rms(estimate: ArrayLike, truth: ArrayLike) -> Any:
    """Root mean square of the difference, along the last axis.

    Args:
        estimate: an array.
        truth: an array that broadcasts with it.

    Returns:
        One number for each row, a scalar of NumPy where there is one row.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import rms
        >>> rms(np.array([[3.0, 1.0, 4.0, 1.0]]), 1.0).round(6).tolist()  # sqrt((4 + 9) / 4)
        [1.802776]
    """
    # Levels of pixels are bytes, of which a difference goes around at zero.
    miss = np.abs(_at_least_float(estimate) - _at_least_float(truth))
    return np.sqrt(np.mean(miss**2, axis=-1))


def _each(breaks: Sequence[ArrayLike]) -> tuple[Array, ...]:
    """The kinks one by one."""
    return tuple(kink for part in breaks for kink in jnp.ravel(as_float(part)))


def _at_least_float(a: ArrayLike) -> np.ndarray:
    a = np.asarray(a)
    return a if a.dtype.kind in "fc" and a.dtype.itemsize > 2 else a.astype(float)


def ssim(a: ArrayLike, b: ArrayLike, span: float, *, sigma: float = 1.5) -> float:
    """Mean structural similarity of two grey images: 1 for the same image, less for any other.

    With local means m, variances v and covariance c under a Gaussian window,
    `(2 m_a m_b + C1) (2 c + C2) / ((m_a^2 + m_b^2 + C1) (v_a + v_b + C2))`, where
    `C1 = (0.01 span)^2`, `C2 = (0.03 span)^2`; averaged over the pixels whose window lies inside.

    Args:
        a: an image, an array of at least 11 x 11 pixels for the usual window.
        b: another, of the same shape.
        span: of the values, positive: what white is above black.
        sigma: of the window, which is cut at 3.5 sigma [pixels].

    Raises:
        ValueError: if shapes differ, images are smaller than the window, or the span or sigma is
            not positive.

    Reference: Wang et al. 2004, which J12 §9 names.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import ssim
        >>> a = np.linspace(0.0, 1.0, 256).reshape(16, 16)
        >>> ssim(a, a, 1.0)
        1.0
    """
    check_positive("span", span)
    check_positive("sigma", sigma)
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape or a.ndim != 2:
        raise ValueError(f"Arguments must be images of one shape, but have {a.shape}, {b.shape}.")
    rim = int(3.5 * sigma + 0.5)
    if min(a.shape) <= 2 * rim:
        raise ValueError(
            f"Argument `a` must have at least {2 * rim + 1} pixels each way, but has {a.shape}."
        )

    def mean(image):
        whole = ndimage.gaussian_filter(image, sigma, truncate=3.5)
        return np.asarray(whole)[rim : -rim or None, rim : -rim or None]

    ma, mb = mean(a), mean(b)
    va, vb, c = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    C1, C2 = (0.01 * span) ** 2, (0.03 * span) ** 2
    likeness = (2 * ma * mb + C1) * (2 * c + C2) / ((ma**2 + mb**2 + C1) * (va + vb + C2))
    return float(np.mean(likeness))


def floats_per_record(order: int = 1, *, ellipse: bool = False, plane: bool = False) -> int:
    """Numbers that one record stores, in grey: place, value, derivatives and region.

    In space: place 3, E 1, gradient 3, radius 1: the 8 that J12 counts; 3 more for a symmetric
    2 x 2 Hessian, 2 more for an ellipse. On a plane that everybody knows, place and gradient are
    of 2 numbers.

    Args:
        order: of the expansion: 0 stores no gradient, 2 a Hessian.
        ellipse: whether the reach is one.
        plane: whether the plane is known.

    Raises:
        ValueError: for another order than 0, 1 or 2.

    Reference: J12 §8.1.

    Example:
        >>> from firstorder.caching import floats_per_record
        >>> floats_per_record(1), floats_per_record(2)
        (8, 11)
    """
    vector = 2 if plane else 3
    derivatives = (0, vector, vector + 3)[checked_order(order)]
    return vector + 1 + derivatives + (3 if ellipse else 1)
