"""Random points on the surfaces of shapes, and the density by area with which they are drawn."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from firstorder.conventions import cylindrical
from firstorder.numerics._vectors import cross, dot, norm
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Rectangles,
    Shape,
    Triangles,
)

# Areas of the canonical shapes; a plane has none.
AREAS = {
    Ellipsoids: 4.0 * jnp.pi,
    Boxes: 24.0,
    Cylinders: 6.0 * jnp.pi,
    Discs: jnp.pi,
    Rectangles: 4.0,
    Triangles: 0.5,
}


def point_on(shape: Shape, u: Float[Array, "2"]) -> tuple[Array, Array]:
    """A point of a surface, uniform on the canonical shape, and the unit normal there.

    Args:
        shape: a single one, of any kind but a plane.
        u: two uniform numbers.

    Example:
        >>> import jax
        >>> import jax.numpy as jnp
        >>> from firstorder.space import rectangle
        >>> from firstorder.space.bounces._surface_points import point_on
        >>> shapes = rectangle((0.0, 0.0, 1.0), (2.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        >>> point, normal = jax.vmap(lambda one: point_on(one, jnp.array([1.0, 0.5])))(shapes)
        >>> point.tolist(), normal.tolist()
        ([[2.0, 0.0, 1.0]], [[0.0, 0.0, 1.0]])
    """
    point = shape.world(_canonical(shape, u))
    return point, shape.normal(point)


def area_density(
    scene: Scene, index: Int[Array, " n"], normal: Float[Array, "n 3"]
) -> Float[Array, " n"]:
    """Density by area with which `point_on` draws a point where the unit normal n is known [1/m^2].

    An affine map A stretches area by `|det A| |A^-T q|`, where q is the canonical unit normal. With
    `n = A^-T q / |A^-T q|` that is `|det A| / |A^T n|`, so that q need not be known.

    Args:
        scene: the shapes.
        index: numbers of shapes.
        normal: unit normals at the points.
    """

    def one(index, normal):
        def ask(shape: Shape):
            axes = shape.axes
            det = jnp.abs(dot(axes[:, 0], cross(axes[:, 1], axes[:, 2])))
            return norm(axes.T @ normal) / (AREAS.get(type(shape), 1.0) * det)

        return scene.ask(index, ask)

    return jax.vmap(one)(index, normal)


def _canonical(shape: Shape, u: Float[Array, "2"]) -> Float[Array, "3"]:
    """A uniform point on the canonical shape."""
    match shape:
        case Ellipsoids():
            return on_ball(u)
        case Boxes():
            return _on_cube(u)
        case Cylinders():
            return _on_can(u)
        case Discs():
            rho = jnp.sqrt(u[0])
            return cylindrical(rho, 2.0 * jnp.pi * u[1], 0.0 * rho)
        case Triangles():
            s, t = jnp.where(u[0] + u[1] > 1.0, 1.0 - u, u)
            return jnp.stack([s, t, 0.0 * s])
    s, t = 2.0 * u - 1.0
    return jnp.stack([s, t, 0.0 * s])


def on_ball(u):
    """Even over the ball, as two rows of numbers are over the square: in height and azimuth."""
    z, phi = 1.0 - 2.0 * u[0], 2.0 * jnp.pi * u[1]
    return cylindrical(jnp.sqrt(jnp.maximum(1.0 - z * z, 0.0)), phi, z)


def _on_cube(u):
    """One of six faces by the first number, whose rest is uniform again."""
    face = jnp.minimum(jnp.floor(6.0 * u[0]), 5.0)
    s, t = 2.0 * (6.0 * u[0] - face) - 1.0, 2.0 * u[1] - 1.0
    sign = jnp.where(face % 2 == 0, -1.0, 1.0)
    faces = jnp.stack([jnp.stack(a) for a in ((sign, s, t), (t, sign, s), (s, t, sign))])
    return faces[(face // 2).astype(jnp.int32)]


def _on_can(u):
    """The wall with two thirds of the numbers, each cap with a sixth."""
    phi = 2.0 * jnp.pi * u[1]
    wall = cylindrical(jnp.ones_like(phi), phi, 3.0 * u[0] - 1.0)
    top = u[0] > 5.0 / 6.0
    share = 6.0 * u[0] - jnp.where(top, 5.0, 4.0)
    cap = cylindrical(jnp.sqrt(jnp.clip(share, 0.0, 1.0)), phi, jnp.where(top, 1.0, -1.0))
    return jnp.where(u[0] < 2.0 / 3.0, wall, cap)
