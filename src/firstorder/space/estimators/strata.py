"""Cells of the hemisphere over a receiver, bounded by circles of latitude and by meridians.

Angles and directions are local: theta from the receiver's normal, phi from its first tangent. Rows
run over theta from the pole to the horizon, columns over phi.
"""

from __future__ import annotations

import operator
from typing import SupportsIndex

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, PRNGKeyArray

from firstorder._argument_checks import check_count, check_key, is_concrete, traced_nan_unless
from firstorder._display import Module
from firstorder.conventions import cylindrical
from firstorder.scene._arguments import numbers

# What cells of one row count, and random directions in a cell are uniform, by.
MEASURES = ("cosine", "solid angle", "angle")


class Strata(Module):
    """A product of cells that covers the hemisphere, with one direction in each.

    Attributes:
        theta: borders of the rows from 0 to pi/2, ascending [rad].
        phi: borders of the columns, ascending over one turn [rad].
        directions: one in each cell, in the receiver's frame; leading axes are receivers.
        weights: inverse density of that direction, so that `sum(weights f(directions))` estimates
            `int f dw` [sr].

    Reference: J12 §7.1, eq. 61 for `projected`.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space.estimators import Strata
        >>> theta, phi = jnp.array([0.0, 1.5707963]), jnp.array([0.0, 6.2831853])
        >>> up = jnp.array([[[0.0, 0.0, 1.0]]])
        >>> round(Strata(theta, phi, up, jnp.ones((1, 1))).projected[0, 0].item(), 4)  # pi
        3.1416
    """

    theta: Float[Array, " m_1"]
    phi: Float[Array, " n_1"]
    directions: Float[Array, "*k m n 3"]
    weights: Float[Array, "*k m n"]

    @property
    def projected(self) -> Float[Array, "m n"]:
        """Projected solid angle of each cell, `(phi+ - phi-)(sin^2 theta+ - sin^2 theta-) / 2`."""
        return 0.5 * jnp.diff(jnp.sin(self.theta) ** 2)[:, None] * jnp.diff(self.phi)


def hemisphere_strata(
    theta: SupportsIndex | Float[ArrayLike, " m_1"],
    phi: SupportsIndex | Float[ArrayLike, " n_1"],
    key: PRNGKeyArray | None = None,
    measure: str = "cosine",
    shape: SupportsIndex | tuple[SupportsIndex, ...] = (),
) -> Strata:
    """Cells of the hemisphere and a direction in each: jittered, or in the middle.

    Args:
        theta: how many rows of equal measure, or their borders, ascending from 0 to pi/2 [rad].
        phi: how many equal columns, or their borders, ascending over 2 pi [rad].
        key: for a random direction in each cell; None takes the middle.
        measure: "cosine" (weighted solid angle), "solid angle" or "angle" (theta itself): by which
            rows are equal, and directions in a cell uniform.
        shape: leading axes, or the only one, for as many independent sets of directions in the
            same cells.

    Raises:
        ValueError: if a number of cells or of sets is no positive integer, borders do not ascend
            over the hemisphere (traced ones give NaN), or the measure is unknown.
        TypeError: if `key` is no key, or borders are no numbers.

    Example:
        >>> from firstorder.space.estimators import hemisphere_strata
        >>> cells = hemisphere_strata(2, 4)
        >>> cells.projected.round(4).tolist()[0]
        [0.3927, 0.3927, 0.3927, 0.3927]
    """
    if measure not in MEASURES:
        raise ValueError(f"Argument `measure` must be one of {MEASURES}, but is {measure!r}.")
    shape = tuple(shape) if isinstance(shape, (tuple, list)) else (shape,)
    for count in shape:
        check_count("shape", count)
    if key is not None:
        check_key("key", key)
    theta, phi = _rows(theta, measure), _columns(phi)
    size = (*shape, theta.shape[0] - 1, phi.shape[0] - 1)
    if key is None:
        up = across = jnp.full(size, 0.5, theta.dtype)
    else:
        up, across = jax.random.uniform(key, (2, *size), theta.dtype)
    low, high = _height(theta[:-1], measure)[:, None], _height(theta[1:], measure)[:, None]
    height, width = low + up * (high - low), jnp.diff(phi)
    sine, cosine = _sine_cosine(height, measure)
    where = phi[:-1] + across * width
    directions = cylindrical(sine, where, cosine)
    over = {"cosine": 0.5 / cosine, "solid angle": 1.0, "angle": sine}[measure]
    return Strata(theta, phi, directions, jnp.broadcast_to(over * (high - low) * width, size))


def _height(theta, measure):
    """The number by which rows are measured, from 0 at the pole; its sines keep their digits."""
    if measure == "angle":
        return theta
    return jnp.sin(theta) ** 2 if measure == "cosine" else 2.0 * jnp.sin(0.5 * theta) ** 2


def _sine_cosine(height, measure):
    """Sine and cosine of theta, a rounding off the horizon, where a weight would be infinite."""
    if measure == "angle":
        return jnp.sin(height), jnp.cos(height)
    height = jnp.minimum(height, 1.0 - jnp.finfo(height.dtype).eps)
    if measure == "cosine":
        return jnp.sqrt(height), jnp.sqrt(1.0 - height)
    return jnp.sqrt(height * (2.0 - height)), 1.0 - height


def _rows(theta, measure) -> Array:
    if np.ndim(theta):
        return _ascending("theta", theta, 0.5 * np.pi, "from 0 to pi/2")
    check_count("theta", theta)
    count = operator.index(theta)
    even = jnp.arange(count + 1) / count
    if measure == "angle":
        return 0.5 * jnp.pi * even
    return jnp.arcsin(jnp.sqrt(even)) if measure == "cosine" else jnp.arccos(1.0 - even)


def _columns(phi) -> Array:
    if np.ndim(phi):
        return _ascending("phi", phi, 2.0 * np.pi, "over 2 pi")
    check_count("phi", phi)
    count = operator.index(phi)
    return 2.0 * jnp.pi * jnp.arange(count + 1) / count


def _ascending(name, edges, span, words) -> Array:
    edges = numbers(name, edges)
    fits = edges.ndim == 1 and edges.shape[0] > 1
    if not fits or (is_concrete(edges) and not _is_span(name, np.asarray(edges), span)):
        raise ValueError(f"Argument `{name}` must ascend {words}.")
    return traced_nan_unless(lambda a: _is_span(name, a, span), edges)


def _is_span(name, edges, span):
    """Whether borders ascend over all that there is."""
    first, ascends = edges[0], (edges[1:] > edges[:-1]).all()
    begins = abs(first) <= 1e-6 if name == "theta" else True
    return ascends & (abs(edges[-1] - first - span) < 1e-5) & begins
