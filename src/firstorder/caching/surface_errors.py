"""True error of records on a surface, the best ellipse for a tolerance, and image errors.

The first need the true irradiance, which nobody has while rendering: they judge radii.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy import ndimage, optimize

from firstorder.caching._records import checked_order
from firstorder.caching.radii import DEFINITIONS
from firstorder.caching.surface_cache import surface_taylor
from firstorder.errors import check_positive
from firstorder.numerics.quadrature import gauss_legendre
from firstorder.typing import as_float


def surface_error(
    E: Callable[[Array], Array],
    position: Float[Array, "2"],
    value: Float[Array, ""],
    gradient: Float[Array, "2"],
    hessian: Float[Array, "2 2"],
    matrix: Float[Array, "2 2"],
    *,
    order: int = 1,
    definition: str = "total",
    nodes: int = 16,
    directions: int = 64,
) -> Float[Array, ""]:
    """The error of a record's expansion over its ellipse, by quadrature of the definition.

    Gauss-Legendre along the radius, equally spaced directions. The modulus has kinks where the
    expansion crosses E; there the error is that of one cell, some `1 / directions^2`.

    Args:
        E: the true irradiance, a jittable function of a place (2,) [W/m^2].
        position: of the record [m].
        value: E there [W/m^2].
        gradient: there; not used at order 0.
        hessian: there; used at order 2 only.
        matrix: of its ellipse [1/m].
        order: of the expansion, 0, 1 or 2.
        definition: one of `DEFINITIONS`; "largest" is taken over the nodes.
        nodes: along the radius.
        directions: around.

    Raises:
        ValueError: for another definition.

    Reference: J12 eq. 67 (order 1, total).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import surface_error
        >>> flat = jnp.asarray(0.0), jnp.zeros(2), jnp.zeros((2, 2))
        >>> round(surface_error(lambda x: x @ x, jnp.zeros(2), *flat, jnp.eye(2)).item(), 6)
        1.570796
    """
    if definition not in DEFINITIONS:
        raise ValueError(
            f"Argument `definition` must be one of {list(DEFINITIONS)}, but is {definition!r}."
        )
    t, w = gauss_legendre(nodes)
    r = 0.5 * (1.0 + t)
    phi = 2.0 * np.pi * (np.arange(directions) + 0.5) / directions
    unit = r[:, None, None] * np.stack([np.cos(phi), np.sin(phi)], -1)
    weight = np.broadcast_to((0.5 * w * r)[:, None] * 2.0 * np.pi / directions, unit.shape[:-1])
    inverse = jnp.linalg.inv(matrix)
    dx = jnp.asarray(unit, matrix.dtype).reshape(-1, 2) @ inverse.T
    weight = jnp.asarray(weight, matrix.dtype).ravel() * jnp.abs(jnp.linalg.det(inverse))
    true = jax.vmap(E)(position + dx)
    miss = jnp.abs(true - surface_taylor(value, gradient, hessian, dx, order))
    if definition == "largest":
        return jnp.max(miss)
    squared = definition in ("average squared", "integrated squared")
    total = jnp.sum(weight * (miss**2 if squared else miss))
    if definition in ("average", "average squared"):
        return total / jnp.sum(weight)
    return total / value if definition == "relative" else total


def ideal_ellipse(
    E: Callable[[Array], Array],
    position: ArrayLike,
    tolerance: float,
    low: float,
    high: float,
    *,
    order: int = 1,
    definition: str = "total",
    circle: bool = False,
    most: float = 8.0,
    nodes: int = 16,
) -> tuple[Float[Array, "2 2"], float]:
    """The largest ellipse, or circle, whose true error is the tolerance, by search.

    For a ratio of axes and an angle the size is found by halving; these two by Nelder and Mead
    from three starts. The integrated errors grow with the size, so that the halving has one root;
    the search over shapes finds one of possibly several maxima.

    Args:
        E: the true irradiance, a jittable function of a place (2,), with two derivatives there.
        position: of the record (2,).
        tolerance: the error that is accepted, positive.
        low: smallest geometric mean of the axes to look for [m].
        high: largest [m].
        order: of the expansion.
        definition: one of `DEFINITIONS`.
        circle: whether to keep both axes alike.
        most: largest ratio of the axes.
        nodes: of the quadrature.

    Returns:
        Its matrix, as in `ValidityRegion`, and its area [m^2].

    Raises:
        ValueError: if the tolerance or a limit is not positive.
    """
    for name, number in (("tolerance", tolerance), ("low", low), ("high", high)):
        check_positive(name, number)
    position = as_float(position)
    size = _sizes(E, order, definition, nodes, float(tolerance), float(low), float(high))
    limit = np.log(most)

    def shape(given):
        """Log of the ratio, held within its limits, and the angle."""
        return np.clip(given[0], -limit, limit), given[1]

    def lost(given):
        return -float(size(position, *shape(given)))

    if circle:
        best = np.zeros(2)
    else:
        starts = [np.array([0.1, 0.0]), np.array([0.7, 0.8]), np.array([0.7, -0.8])]
        found = [
            optimize.minimize(lost, s, method="Nelder-Mead", options={"maxfev": 60}) for s in starts
        ]
        best = min(found, key=lambda f: f.fun).x
    R = float(size(position, *shape(best)))
    return _stretched(R, *(jnp.asarray(s, position.dtype) for s in shape(best))), np.pi * R * R


def _stretched(R, log_ratio, angle) -> Array:
    """Matrix of an ellipse with axes R e^(+-l/2), the longer at the angle."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    axes = jnp.stack([jnp.stack([c, -s]), jnp.stack([s, c])])
    inverse = jnp.stack([jnp.exp(-0.5 * log_ratio), jnp.exp(0.5 * log_ratio)]) / R
    return (axes * inverse) @ axes.T


def _sizes(E, order, definition, nodes, tolerance, low, high):
    """A compiled function of position, ratio and angle: the size with the tolerated error."""

    @jax.jit
    def size(position, log_ratio, angle):
        value, gradient = jax.value_and_grad(E)(position)
        hessian = jax.hessian(E)(position) if order == 2 else jnp.zeros((2, 2), position.dtype)

        def halve(_, ends):
            a, b = ends
            m = jnp.sqrt(a * b)
            over = (
                surface_error(
                    E, position, value, gradient, hessian, _stretched(m, log_ratio, angle),
                    order=order, definition=definition, nodes=nodes,
                )
                > tolerance
            )  # fmt: skip
            return jnp.where(over, a, m), jnp.where(over, m, b)

        ends = (jnp.asarray(low, position.dtype), jnp.asarray(high, position.dtype))
        a, b = jax.lax.fori_loop(0, 40, halve, ends)
        return jnp.sqrt(a * b)

    return size


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
    miss = np.abs(np.asarray(miss))
    order = np.argsort(miss, axis=None, kind="stable")
    count = np.searchsorted(np.cumsum(miss.ravel()[order]) * cell, tolerance, side="right")
    chosen = np.zeros(miss.size, bool)
    chosen[order[:count]] = True
    chosen = chosen.reshape(miss.shape)
    if near is not None:
        parts = np.zeros(miss.shape, int)
        ndimage.label(chosen, output=parts)
        chosen = (parts == parts[near]) & chosen
    return chosen, float(chosen.sum() * cell)


def ssim(a: ArrayLike, b: ArrayLike, span: float, *, sigma: float = 1.5) -> float:
    """Mean structural similarity of two grey images: 1 for the same image, less for any other.

    With local means m, variances v and covariance c under a Gaussian window,
    `(2 m_a m_b + C1) (2 c + C2) / ((m_a^2 + m_b^2 + C1) (v_a + v_b + C2))`, where
    `C1 = (0.01 span)^2`, `C2 = (0.03 span)^2`; averaged over the pixels whose window lies inside.

    Args:
        a: an image, at least 11 x 11 pixels for the usual window.
        b: another, of the same shape.
        span: of the values, positive: what white is above black.
        sigma: of the window, which is cut at 3.5 sigma [pixels].

    Raises:
        ValueError: if shapes differ, images are smaller than the window, or the span is not
            positive.

    Reference: Wang et al. 2004, which J12 §9 names.

    Example:
        >>> import numpy as np
        >>> from firstorder.caching import ssim
        >>> a = np.linspace(0.0, 1.0, 256).reshape(16, 16)
        >>> ssim(a, a, 1.0)
        1.0
    """
    check_positive("span", span)
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape or a.ndim != 2:
        raise ValueError(f"Arguments must be images of one shape, but have {a.shape}, {b.shape}.")
    rim = int(3.5 * sigma + 0.5)
    if min(a.shape) <= 2 * rim:
        raise ValueError(
            f"Argument `a` must have at least {2 * rim + 1} pixels each way, but has {a.shape}."
        )

    def mean(image):
        return ndimage.gaussian_filter(image, sigma, truncate=3.5)[rim:-rim, rim:-rim]

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

    Reference: J12 §8.1.

    Example:
        >>> from firstorder.caching import floats_per_record
        >>> floats_per_record(1), floats_per_record(2)
        (8, 11)
    """
    vector = 2 if plane else 3
    derivatives = (0, vector, vector + 3)[checked_order(order)]
    return vector + 1 + derivatives + (3 if ellipse else 1)
