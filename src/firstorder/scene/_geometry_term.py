"""The geometry term of two small patches of surface, with its derivatives, in d dimensions.

`G(x, y) = cos_x cos_y / r^(d-1)` turns measure of surface at y into cosine-weighted angle at x:
arc length into angle in flatland (d = 2), area into solid angle in space (d = 3). With
`p = y - x = r u`, `cos_x = n_x . u` and `cos_y = -n_y . u` everything below is a rational function
of vectors, so it holds in every frame; nothing assumes that x is the origin. The dimension is the
length of the last axis.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder.typing import as_float

Points: TypeAlias = Float[ArrayLike, "*#b d"]
Numbers: TypeAlias = Float[ArrayLike, "*#b"]
Values: TypeAlias = Float[Array, "*b"]
Vectors: TypeAlias = Float[Array, "*b d"]
Matrices: TypeAlias = Float[Array, "*b d d"]


class GeometryJet(NamedTuple):
    """Value, gradient and Hessian of the geometry term by translation of x, normals held fixed."""

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

    r: Values
    u: Vectors
    cos_x: Values
    cos_y: Values
    sees: Bool[Array, "*b"]


def facing(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Facing:
    """Distance, direction, both cosines, and whether the surfaces face each other."""
    x, normal_x, y, normal_y = map(as_float, (x, normal_x, y, normal_y))
    p = y - x
    r2 = jnp.sum(p * p, -1)
    apart = ~(r2 <= 0.0)  # asked so that NaN is not taken for it, nor below
    r = jnp.sqrt(jnp.where(apart, r2, 1.0))  # not 0: the root has no derivative there
    u = p / r[..., None]
    cos_x, cos_y = jnp.sum(normal_x * u, -1), -jnp.sum(normal_y * u, -1)
    return Facing(r, u, cos_x, cos_y, apart & ~(cos_x <= 0.0) & ~(cos_y <= 0.0))


def geometry_term(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Values:
    """Geometry term: cosine-weighted angle at x per length or area of surface at y.

    `G(x, y) = cos_x cos_y / r^(d-1) = -(n_x . p)(n_y . p) / r^(d+1)`, symmetric in the two points:
    `cos_x dtheta_x / dl_y` in flatland, `cos_x dw_x / da_y` in space.

    Valid between surfaces that face each other; zero where one shows its back to the other, and
    with a corner where it just turns away (derivatives there are those of the dark side, zero). At
    `r = 0` the answer is zero, which need not be the limit. Two points of one smooth curve, of
    curvature k, have `G -> k^2 r / 4`, and two curves that touch have no limit; points of one
    sphere of radius R have `1 / (4 R^2)` at every distance.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m), finite.
        normal_y: unit normals at y; of a two-sided surface, that of the side that is seen.

    Returns:
        G in 1/m in flatland, 1/m^2 in space.

    Reference: J12 §3.2, eq. 26 (d = 2); §7.1, eqs. 56, 83 (d = 3).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.scene._geometry_term import geometry_term
        >>> up, down = jnp.array([0.0, 1.0]), jnp.array([0.0, -1.0])
        >>> float(geometry_term(jnp.zeros(2), up, jnp.array([0.0, 2.0]), down))
        0.5
        >>> up, down = jnp.array([0.0, 0.0, 1.0]), jnp.array([0.0, 0.0, -1.0])
        >>> float(geometry_term(jnp.zeros(3), up, jnp.array([0.0, 0.0, 2.0]), down))
        0.25
    """
    f = facing(x, normal_x, y, normal_y)
    return jnp.where(f.sees, _value(f.r, f.cos_x, f.cos_y, f.u.shape[-1]), 0.0)


def geometry_gradient(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Vectors:
    """Gradient of the geometry term by translation of the receiving point.

    `grad_x G = ((d+1) cos_x cos_y u - cos_y n_x + cos_x n_y) / r^d`; both normals and y stay.

    Valid and zero as `geometry_term`. The gradient by motion of y is its negative.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        The gradient in 1/m^2 in flatland, 1/m^3 in space, in the frame of the arguments.

    Reference: J12 §5.1, eq. 38, App. A (d = 2); §7.1, eq. 58, App. C (d = 3).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.scene._geometry_term import geometry_gradient
        >>> up, down = jnp.array([0.0, 1.0]), jnp.array([0.0, -1.0])
        >>> geometry_gradient(jnp.zeros(2), up, jnp.array([0.0, 2.0]), down).tolist()
        [0.0, 0.25]
        >>> up, down = jnp.array([0.0, 0.0, 1.0]), jnp.array([0.0, 0.0, -1.0])
        >>> geometry_gradient(jnp.zeros(3), up, jnp.array([0.0, 0.0, 2.0]), down).tolist()
        [0.0, 0.0, 0.25]
    """
    return geometry_jet(x, normal_x, y, normal_y).gradient


def geometry_hessian(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Matrices:
    """Hessian of the geometry term by translation of the receiving point.

    `H_x G = ((d+1)(d+3) cos_x cos_y u u^T - (d+1) cos_x cos_y I - (n_x n_y^T + n_y n_x^T)
    - (d+1) cos_y (n_x u^T + u n_x^T) + (d+1) cos_x (n_y u^T + u n_y^T)) / r^(d+1)`

    Valid and zero as `geometry_term`. It is also the Hessian by motion of y.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        The symmetric Hessian in 1/m^3 in flatland, 1/m^4 in space, in the frame of the arguments.

    Reference: J12 §5.2, eq. 49, App. B (d = 2); §7.2, eq. 66, App. D (d = 3).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.scene._geometry_term import geometry_hessian
        >>> up, down = jnp.array([0.0, 1.0]), jnp.array([0.0, -1.0])
        >>> geometry_hessian(jnp.zeros(2), up, jnp.array([0.0, 1.0]), down).tolist()
        [[-3.0, 0.0], [0.0, 2.0]]
        >>> up, down = jnp.array([0.0, 0.0, 1.0]), jnp.array([0.0, 0.0, -1.0])
        >>> geometry_hessian(jnp.zeros(3), up, jnp.array([0.0, 0.0, 1.0]), down).tolist()
        [[-4.0, 0.0, 0.0], [0.0, -4.0, 0.0], [0.0, 0.0, 6.0]]
    """
    return geometry_jet(x, normal_x, y, normal_y).hessian


def geometry_jet(x: Points, normal_x: Points, y: Points, normal_y: Points) -> GeometryJet:
    """Value, gradient and Hessian of the geometry term together, at the cost of the Hessian.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        Results of `geometry_term`, `geometry_gradient` and `geometry_hessian`.

    Reference: J12 eqs. 26, 38 and 49 (d = 2), 56, 58 and 66 (d = 3).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import geometry_jet
        >>> up = jnp.array([0.0, 0.0, 1.0])
        >>> jet = geometry_jet(0.0 * up, up, 2.0 * up, -up)
        >>> jet.value.item(), jet.gradient[2].item()  # 1 / r^2, and 2 / r^3 as it comes nearer
        (0.25, 0.25)
    """
    f = facing(x, normal_x, y, normal_y)
    jet = linear_jet(f.r, f.u, normal_x, normal_y, f.cos_x, f.cos_y)
    return GeometryJet(
        jnp.where(f.sees, jet.value, 0.0),
        jnp.where(f.sees[..., None], jet.gradient, 0.0),
        jnp.where(f.sees[..., None, None], jet.hessian, 0.0),
    )


def linear_jet(
    r: Numbers, u: Points, normal_x: Points, normal_y: Points, cos_x: Numbers, cos_y: Numbers
) -> GeometryJet:
    """Jet of the geometry term without horizons: linear in each normal, also where it turns away.

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
    return GeometryJet(_value(r, cos_x, cos_y, d), gradient, hessian)


def _value(r, cos_x, cos_y, d):
    return cos_x * cos_y / r ** (d - 1)


def _outer(a, b):
    return a[..., :, None] * b[..., None, :]


def _twice(a, b):
    return _outer(a, b) + _outer(b, a)
