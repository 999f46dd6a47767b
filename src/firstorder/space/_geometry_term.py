"""The geometry term of two patches of surface in space, with its derivatives in closed form.

`G(x, y) = cos_x cos_y / r^2` turns area at y into cosine-weighted solid angle at x. With
`p = y - x = r u`, `cos_x = n_x . u` and `cos_y = -n_y . u` everything below is a rational function
of vectors, so it holds in every frame; nothing assumes that x is the origin.
The formulas themselves are those of `scene._geometry_term`, at d = 3.
"""

from __future__ import annotations

from typing import TypeAlias

from jaxtyping import Array, ArrayLike, Float

from firstorder.scene import _geometry_term as geometry_term

Points: TypeAlias = Float[ArrayLike, "*#b 3"]
Values: TypeAlias = Float[Array, "*b"]
Vectors: TypeAlias = Float[Array, "*b 3"]
Matrices: TypeAlias = Float[Array, "*b 3 3"]
CouplingJet: TypeAlias = geometry_term.Jet


def coupling(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Values:
    """Geometry term: cosine-weighted solid angle at x per area of surface at y [1/m^2].

    `G(x, y) = cos_x dw_x / da_y = cos_x cos_y / r^2 = -(n_x . p)(n_y . p) / r^4`, symmetric in the
    two points.

    Valid between surfaces that face each other; zero where one shows its back to the other, and
    with a corner where it just turns away (derivatives there are those of the dark side, zero). At
    `r = 0` the answer is zero, and not the limit, which depends on the surface: points of one
    sphere of radius R couple by `1 / (4 R^2)` at every distance.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m), finite.
        normal_y: unit normals at y; of a two-sided surface, that of the side that is seen.

    Returns:
        G in 1/m^2.

    Reference: J12 §7.1, eqs. 56, 83.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space._geometry_term import coupling
        >>> up, down = jnp.array([0.0, 0.0, 1.0]), jnp.array([0.0, 0.0, -1.0])
        >>> float(coupling(jnp.zeros(3), up, jnp.array([0.0, 0.0, 2.0]), down))
        0.25
    """
    return geometry_term.value(geometry_term.facing(x, normal_x, y, normal_y))


def coupling_gradient(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Vectors:
    """Gradient of the geometry term by translation of the receiving point.

    `grad_x G = (4 cos_x cos_y u - cos_y n_x + cos_x n_y) / r^3`; both normals and y stay.

    Valid and zero as `coupling`. The gradient by motion of y is its negative.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        The gradient in 1/m^3, in the frame of the arguments.

    Reference: J12 §7.1, eq. 58, derived in App. C.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space._geometry_term import coupling_gradient
        >>> up, down = jnp.array([0.0, 0.0, 1.0]), jnp.array([0.0, 0.0, -1.0])
        >>> coupling_gradient(jnp.zeros(3), up, jnp.array([0.0, 0.0, 2.0]), down).tolist()
        [0.0, 0.0, 0.25]
    """
    return coupling_jet(x, normal_x, y, normal_y).gradient


def coupling_hessian(x: Points, normal_x: Points, y: Points, normal_y: Points) -> Matrices:
    """Hessian of the geometry term by translation of the receiving point.

    `H_x G = (24 cos_x cos_y u u^T - 4 cos_x cos_y I - (n_x n_y^T + n_y n_x^T)
    - 4 cos_y (n_x u^T + u n_x^T) + 4 cos_x (n_y u^T + u n_y^T)) / r^4`

    Valid and zero as `coupling`. It is also the Hessian by motion of y.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        The symmetric Hessian in 1/m^4, in the frame of the arguments.

    Reference: J12 §7.2, eq. 66, derived in App. D.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space._geometry_term import coupling_hessian
        >>> up, down = jnp.array([0.0, 0.0, 1.0]), jnp.array([0.0, 0.0, -1.0])
        >>> coupling_hessian(jnp.zeros(3), up, jnp.array([0.0, 0.0, 1.0]), down).tolist()
        [[-4.0, 0.0, 0.0], [0.0, -4.0, 0.0], [0.0, 0.0, 6.0]]
    """
    return coupling_jet(x, normal_x, y, normal_y).hessian


def coupling_jet(x: Points, normal_x: Points, y: Points, normal_y: Points) -> CouplingJet:
    """Value, gradient and Hessian of the geometry term together, at the cost of the Hessian.

    Args:
        x: receiving points (m).
        normal_x: unit normals at x.
        y: sending points (m).
        normal_y: unit normals at y.

    Returns:
        What `coupling`, `coupling_gradient` and `coupling_hessian` return.

    Reference: J12 eqs. 58 and 66.
    """
    f = geometry_term.facing(x, normal_x, y, normal_y)
    jet = linear_jet(f.r, f.u, normal_x, normal_y, f.cos_x, f.cos_y)
    return geometry_term.with_horizons(jet, f.sees)


def linear_jet(r, u, normal_x, normal_y, cos_x, cos_y) -> CouplingJet:
    """Jet of the geometry term without horizons: linear in each normal, also where it turns away.

    A turn of the receiver's normal therefore needs no formula of its own: put the change of the
    normal for `normal_x`, and its product with u for `cos_x`.
    """
    return geometry_term.linear_jet(r, u, normal_x, normal_y, cos_x, cos_y)
