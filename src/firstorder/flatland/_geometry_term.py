"""The geometry term of flatland and its derivatives by motion of the receiver, in closed form.

`G(x, y) = cos_x cos_y / r` turns arc length at y into cosine-weighted angle at x. With
`p = y - x = r u`, `cos_x = n_x . u` and `cos_y = -n_y . u` everything below is a rational function
of vectors, so it holds in every frame; nothing assumes that x is the origin.
The formulas themselves are those of `scene._geometry_term`, at d = 2.
"""

from __future__ import annotations

from typing import TypeAlias

from jaxtyping import Array, ArrayLike, Float

from firstorder.scene import _geometry_term as patches

Points: TypeAlias = Float[ArrayLike, "*#b 2"]
Values: TypeAlias = Float[Array, "*b"]
Vectors: TypeAlias = Float[Array, "*b 2"]
Matrices: TypeAlias = Float[Array, "*b 2 2"]
GeometryJet: TypeAlias = patches.Jet


def geometry_term(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Values:
    """Geometry term `cos_x cos_y / r`: cosine-weighted angle at x per metre of curve at y.

    `G(x, y) = cos_x dtheta_x / dl_y = cos_x cos_y / r = -(n_x . p)(n_y . p) / r^3`, symmetric in
    the two points.

    Valid between surfaces that face each other; zero where one shows its back to the other, and
    with a corner where it just turns away (derivatives there are those of the dark side, zero). At
    `r = 0` the answer is zero: two points of one smooth curve, of curvature k, have
    `G -> k^2 r / 4`; two curves that touch have no limit.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m), finite.
        normal_y: unit normals at y; of a two-sided curve, that of the side that is seen.

    Returns:
        G in 1/m.

    Reference: J12 §3.2, eq. 26.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland._geometry_term import geometry_term
        >>> up, down = jnp.array([0.0, 1.0]), jnp.array([0.0, -1.0])
        >>> float(geometry_term(jnp.zeros(2), up, jnp.array([0.0, 2.0]), down))
        0.5
    """
    return patches.value(patches.facing(x, normal_x, y, normal_y))


def geometry_gradient(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Vectors:
    """Gradient of the geometry term by translation of the receiving point.

    `grad_x G = (3 cos_x cos_y u - cos_y n_x + cos_x n_y) / r^2`; both normals and y stay.

    Valid and zero as `geometry_term`. The gradient by motion of y is its negative.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        The gradient in 1/m^2, in the frame of the arguments.

    Reference: J12 §5.1, eq. 38, derived in App. A.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland._geometry_term import geometry_gradient
        >>> up, down = jnp.array([0.0, 1.0]), jnp.array([0.0, -1.0])
        >>> geometry_gradient(jnp.zeros(2), up, jnp.array([0.0, 2.0]), down).tolist()
        [0.0, 0.25]
    """
    return geometry_jet(x, normal_x, y, normal_y).gradient


def geometry_hessian(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Matrices:
    """Hessian of the geometry term by translation of the receiving point.

    `H_x G = (15 cos_x cos_y u u^T - 3 cos_x cos_y I - (n_x n_y^T + n_y n_x^T)
    - 3 cos_y (n_x u^T + u n_x^T) + 3 cos_x (n_y u^T + u n_y^T)) / r^3`

    Valid and zero as `geometry_term`. It is also the Hessian by motion of y.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        The symmetric Hessian in 1/m^3, in the frame of the arguments.

    Reference: J12 §5.2, eq. 49, derived in App. B.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland._geometry_term import geometry_hessian
        >>> up, down = jnp.array([0.0, 1.0]), jnp.array([0.0, -1.0])
        >>> geometry_hessian(jnp.zeros(2), up, jnp.array([0.0, 1.0]), down).tolist()
        [[-3.0, 0.0], [0.0, 2.0]]
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
        What `geometry_term`, `geometry_gradient` and `geometry_hessian` return.

    Reference: J12 eqs. 26, 38 and 49.
    """
    f = patches.facing(x, normal_x, y, normal_y)
    jet = linear_jet(f.r, f.u, normal_x, normal_y, f.cos_x, f.cos_y)
    return patches.with_horizons(jet, f.sees)


def linear_jet(r, u, normal_x, normal_y, cos_x, cos_y) -> GeometryJet:
    """Jet of the geometry term without horizons: linear in each normal, also where it turns away.

    A turn of the receiver's normal, `dn_x / dn = -tangent`, therefore needs no formula of its own:
    put `-tangent` for `normal_x`, and `-u . tangent` for `cos_x`.
    """
    return patches.linear_jet(r, u, normal_x, normal_y, cos_x, cos_y)
