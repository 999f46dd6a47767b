"""The geometry term of two small patches of surface, in flatland and in space.

In d dimensions `G(x, y) = cos_x cos_y / r^(d-1)` turns measure of surface at y into cosine-weighted
angle at x. With `p = y - x = r u`, `cos_x = n_x . u` and `cos_y = -n_y . u` everything below is a
rational function of vectors, so it holds in every frame; nothing assumes that x is the origin.

The formulas stand here once. With the papers' names, units and equation numbers they are
`flatland._geometry_term` (d = 2) and `space._geometry_term` (d = 3).
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder.typing import as_float

Vectors: TypeAlias = Float[ArrayLike, "*#b d"]
Numbers: TypeAlias = Float[ArrayLike, "*#b"]


class Jet(NamedTuple):
    """Value, gradient and Hessian by translation of x, normals held fixed."""

    value: Array
    gradient: Array
    hessian: Array


class Facing(NamedTuple):
    """Mutual position of two patches.

    Attributes:
        r: their distance; 1 for points that coincide, of which nothing is seen.
        u: unit vector from x to y.
        cos_x, cos_y: of the angles between the normals and the line, both positive where
            the patches face each other.
        sees: whether they do, and are apart.
    """

    r: Float[Array, "*b"]
    u: Float[Array, "*b d"]
    cos_x: Float[Array, "*b"]
    cos_y: Float[Array, "*b"]
    sees: Bool[Array, "*b"]


def facing(x: Vectors, normal_x: Vectors, y: Vectors, normal_y: Vectors) -> Facing:
    """Distance, direction, both cosines, and whether the surfaces face each other."""
    x, normal_x, y, normal_y = map(as_float, (x, normal_x, y, normal_y))
    p = y - x
    r2 = jnp.sum(p * p, -1)
    apart = r2 > 0.0
    r = jnp.sqrt(jnp.where(apart, r2, 1.0))  # not 0: the root has no derivative there
    u = p / r[..., None]
    cos_x, cos_y = jnp.sum(normal_x * u, -1), -jnp.sum(normal_y * u, -1)
    return Facing(r, u, cos_x, cos_y, apart & (cos_x > 0.0) & (cos_y > 0.0))


def value(f: Facing) -> Float[Array, "*b"]:
    """The geometry term, zero where one patch shows its back to the other."""
    return jnp.where(f.sees, _value(f.r, f.cos_x, f.cos_y, f.u.shape[-1]), 0.0)


def with_horizons(jet: Jet, sees: Bool[Array, "*b"]) -> Jet:
    """Jet with the horizons: zero where one patch shows its back to the other."""
    return Jet(
        jnp.where(sees, jet.value, 0.0),
        jnp.where(sees[..., None], jet.gradient, 0.0),
        jnp.where(sees[..., None, None], jet.hessian, 0.0),
    )


def linear_jet(
    r: Numbers, u: Vectors, normal_x: Vectors, normal_y: Vectors, cos_x: Numbers, cos_y: Numbers
) -> Jet:
    """Jet without the horizons: linear in each normal, also where it turns away.

    With `a = cos_x`, `b = cos_y` and d coordinates

        G      = a b / r^(d-1)
        grad G = ((d+1) a b u - b n_x + a n_y) / r^d
        H G    = ((d+1)(d+3) a b u u^T - (d+1) a b I - (n_x n_y^T + n_y n_x^T)
                  - (d+1) b (n_x u^T + u n_x^T) + (d+1) a (n_y u^T + u n_y^T)) / r^(d+1)

    The two cosines are arguments of their own, so that a turn of the receiver's normal needs no
    formula of its own: put the change of the normal for `normal_x`, and its product with u for
    `cos_x`.

    Reference: J12 eqs. 26, 38 and 49 (d = 2), 56, 58 and 66 (d = 3).
    """
    r, u, normal_x, normal_y, cos_x, cos_y = map(as_float, (r, u, normal_x, normal_y, cos_x, cos_y))
    d = u.shape[-1]
    first, second = d + 1.0, (d + 1.0) * (d + 3.0)
    a, b, over = cos_x[..., None], cos_y[..., None], r[..., None]
    gradient = (first * a * b * u - b * normal_x + a * normal_y) / over**d
    a, b, over = a[..., None], b[..., None], over[..., None]
    hessian = (
        second * a * b * _outer(u, u)
        - first * a * b * jnp.eye(d, dtype=u.dtype)
        - _twice(normal_x, normal_y)
        - first * b * _twice(normal_x, u)
        + first * a * _twice(normal_y, u)
    ) / over ** (d + 1)
    return Jet(_value(r, cos_x, cos_y, d), gradient, hessian)


def _value(r, cos_x, cos_y, d):
    return cos_x * cos_y / r ** (d - 1)


def _outer(a, b):
    return a[..., :, None] * b[..., None, :]


def _twice(a, b):
    return _outer(a, b) + _outer(b, a)
