"""Covariance under a stated Gaussian window: for factors that never die out."""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np

from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Field
from firstorder.fields.gaussians import Gaussian
from firstorder.numerics.batching import batched


def _normal(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights for the mean over a standard normal variable.

    The trapezoid rule: exponentially convergent for smooth means, at any number of nodes.
    """
    t = np.linspace(-8.5, 8.5, nodes)
    w = np.exp(-0.5 * t**2)
    return t, w / np.sum(w)


def windowed_covariance(field: Field, window: Gaussian, nodes: int = 48) -> Covariance:
    """Covariance of `field * window`, from the field's jets.

    With the window's precision P and E the mean over its square (a normal density of precision
    2 P), integration by parts turns `int grad(f g) grad(f g)^T / (4 pi^2 int (f g)^2)` into
    `(P + E[grad f grad f^T - f Hess f] / E[f^2]) / (8 pi^2)`.
    For a Gaussian field the fraction is its precision: then, and only then, products add exactly.

    Valid when: the field is smooth on the scale of the window (the mean is a sum over nodes). Wrong
    when its detail is finer than the window divided by the number of nodes.

    Args:
        field: a smooth factor in the window's coordinates; it need not die out.
        window: the stated window; its amplitude does not matter.
        nodes: quadrature nodes per coordinate.

    Raises:
        Refused: if the field has edges, whose covariance is infinite under any window.
        ValueError: if there are no nodes.

    Example:
        >>> from firstorder.fields import Constant, gaussian, windowed_covariance
        >>> window = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> S = windowed_covariance(Constant(2.0), window)
        >>> round(float(S.matrix[0, 0] / window.covariance().matrix[0, 0]), 6)
        1.0
    """
    if field.edges():
        raise Refused("an edge has an infinite covariance under any window")
    if nodes < 2:
        raise ValueError(f"Argument `nodes` must be at least 2, but is {nodes}.")
    n = window.frame.dims
    t, w = _normal(nodes)
    z = jnp.asarray(np.stack(np.meshgrid(*[t] * n, indexing="ij"), -1).reshape(-1, n))
    weight = jnp.asarray(functools.reduce(np.multiply.outer, [w] * n).ravel())
    # u = center + S z with S S^T = (2 P)^-1, so that u is distributed as the window's square.
    root = jnp.linalg.inv(jnp.linalg.cholesky(2.0 * window.precision)).T
    jets = batched(field.jet)(window.center + z @ root.T)
    f, g, H = jets.value, jets.gradient, jets.hessian
    bend = jnp.tensordot(weight, g[:, :, None] * g[:, None] - f[:, None, None] * H, axes=1)
    matrix = window.precision + bend / jnp.sum(weight * f**2)
    return Covariance(matrix / (8.0 * np.pi**2), window.frame)
