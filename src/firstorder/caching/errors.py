"""True error of a record's extrapolation, and the radius at which it reaches a tolerance.

These need the true irradiance around the record, which nobody has while rendering: they judge the
radii that are made from derivatives.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder.caching.cache import taylor
from firstorder.caching.radii import DEFINITIONS
from firstorder.errors import check_positive
from firstorder.numerics.quadrature import composite_gauss_legendre
from firstorder.typing import as_float


def true_error(
    E: Callable[[Array], Array],
    x: ArrayLike,
    derivatives: Float[Array, " k"],
    radius: ArrayLike,
    *,
    order: int = 1,
    definition: str = "total",
    breaks: tuple[ArrayLike, ...] = (),
    nodes: int = 32,
) -> Float[Array, ""]:
    """The error of a record's extrapolation over [x - R, x + R], by quadrature of the definition.

    Gauss-Legendre panels, cut at the record and at `breaks`. The modulus has kinks wherever the
    expansion crosses E elsewhere; there the error is that of one panel, some `1 / nodes^2`.

    Args:
        E: the true irradiance, a jittable function of arc length [W/m].
        x: arc length of the record [m].
        derivatives: E, E', ... at the record.
        radius: R [m].
        order: of the extrapolation, 0, 1 or 2.
        definition: one of `DEFINITIONS`; "largest" is taken over the nodes.
        breaks: arc lengths of the kinks of E.
        nodes: per panel.

    Raises:
        ValueError: for another definition.

    Reference: J12 eq. 53 (order 1, total).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import true_error
        >>> round(true_error(jnp.square, 0.0, jnp.array([0.0, 0.0]), 0.5).item(), 12)
        0.083333333333
    """
    if definition not in DEFINITIONS:
        raise ValueError(
            f"Argument `definition` must be one of {list(DEFINITIONS)}, but is {definition!r}."
        )
    x, R = as_float(x), as_float(radius)
    t, w = composite_gauss_legendre(x - R, x + R, [x, *(as_float(b) for b in breaks)], nodes)
    miss = jnp.abs(jax.vmap(E)(t) - taylor(derivatives, t - x, order))
    if definition == "largest":
        return jnp.max(miss)
    squared = definition in ("average squared", "integrated squared")
    total = jnp.sum(w * (miss**2 if squared else miss))
    if definition in ("average", "average squared"):
        return total / (2.0 * R)
    return total / derivatives[0] if definition == "relative" else total


def ideal_radius(
    E: Callable[[Array], Array],
    x: ArrayLike,
    derivatives: Float[Array, " k"],
    tolerance: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    *,
    order: int = 1,
    definition: str = "total",
    breaks: tuple[ArrayLike, ...] = (),
    nodes: int = 32,
) -> Float[Array, ""]:
    """The radius at which the true error reaches the tolerance, by halving.

    The integrated errors grow with the radius, and the root is the only one. Averages and the
    relative error do in practice, not by necessity; then it is one of several.

    Args:
        E: the true irradiance, a jittable function of arc length [W/m].
        x: arc length of the record [m].
        derivatives: E, E', ... at the record.
        tolerance: the error that is accepted, positive.
        low: smallest radius to look for [m]; the answer if its error is too large already.
        high: largest [m]; the answer if its error is tolerated.
        order: of the extrapolation.
        definition: one of `DEFINITIONS`.
        breaks: arc lengths of the kinks of E.
        nodes: per panel.

    Raises:
        ValueError: if the tolerance or a limit is not positive.

    Reference: J12 §6.4 and Fig. 13 (left), there called the ideal setting.
    """
    for name, number in (("tolerance", tolerance), ("low", low), ("high", high)):
        check_positive(name, number)

    def halve(_, ends):
        a, b = ends
        m = 0.5 * (a + b)
        error = true_error(
            E, x, derivatives, m, order=order, definition=definition, breaks=breaks, nodes=nodes
        )
        return jnp.where(error > tolerance, a, m), jnp.where(error > tolerance, m, b)

    a, b = jax.lax.fori_loop(0, 52, halve, (as_float(low), as_float(high)))
    return 0.5 * (a + b)


def rms(estimate: ArrayLike, truth: ArrayLike) -> np.ndarray:
    """Root mean square of the difference, along the last axis."""
    return np.sqrt(np.mean((np.asarray(estimate) - np.asarray(truth)) ** 2, axis=-1))
