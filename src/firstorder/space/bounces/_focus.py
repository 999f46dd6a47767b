r"""Photons of light without end: dense about a ball, sparse far away, and nowhere cut off.

A plane that shines, or a sky over a plane, sends power without bound, and light may come to any
place by way of any other. Photons start with a density p by area that is positive on the whole
plane, and each weighs the power per area over p: what lands anywhere is right on average,

    E[sum of weights of starts in A] = int_A (M / p) p dA = int_A M dA.

How far the weights spread is chosen by what reaches the ball, of radius R. From a place at a
distance r on a plane, far away, a share of about `(R / r)^2 s / r` goes there at most, s being the
larger of the ball's radius and the height h of its middle. With

    p = s / (2 pi (s^2 + r^2)^(3/2)),    s^2 = R^2 + h^2,

even by solid angle over the foot of the ball, the weight grows as that share falls.

The photon that sets out by the cosine seldom finds the ball, and with all its weight: the second
moment `int (M / p)^2 share p dA` diverges. So from outside of the ball half of the directions are
drawn about it, by solid angle with the density

    p_w = 1 / (2 pi (t + t_R) log(1 + 2 / t_R)),    t = 1 - cos(angle to the ball's middle),

where t_R is t at the ball's rim, and each weighs by the density of the mixture. The weight of what
goes to the ball then falls by the share too, up to a logarithm. The density reaches out evenly in
log t, so that the same holds at each scale for what lands between the ball and the place, where
other planes send it on. Each reflection adds a factor of logarithms to a second moment that falls
like `r^-6`, and `int r^3 r^-6 r dr` converges: the flux on a bounded piece of surface has a finite
variance. At a distance d it grows like `(d / R)^3` relative to the square of the flux.

The logarithms are not small. Between planes that face each other the light of second and later
reflections comes with few heavy photons, and its sample variance is too small until they come.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder.conventions import cylindrical
from firstorder.numerics._vectors import dot, matvec, norm, orthonormal_frame
from firstorder.space.bounces._vertices import Rows, Vertex, brdf, scattered

AIMED = 0.5  # share of the directions from outside of the ball that are drawn about it


class Ball(NamedTuple):
    """A ball: around shapes, or where photons are dense.

    Attributes:
        middle: [m].
        radius: [m].
    """

    middle: Float[Array, "3"]
    radius: Float[Array, ""]


def spread(
    focus: Ball, point: Float[Array, "*#n 3"], normal: Rows, u: Float[Array, "n 2"]
) -> tuple[Rows, Array]:
    """Places on planes, each through a point, and the density by area of each place [1/m^2].

    Args:
        focus: about whose feet they are dense.
        point: of each plane, or of all.
        normal: of each plane.
        u: uniform numbers.
    """
    height = dot(focus.middle - point, normal)
    foot = focus.middle - height[:, None] * normal
    size = jnp.sqrt(focus.radius**2 + height**2)
    cosine = 1.0 - u[:, 0]
    r = size * jnp.sqrt(u[:, 0] * (1.0 + cosine)) / cosine
    offset = cylindrical(r, 2.0 * jnp.pi * u[:, 1], jnp.zeros_like(r))
    place = foot + matvec(orthonormal_frame(normal), offset)
    return place, cosine**3 / (2.0 * jnp.pi * size**2)


def aimed(
    focus: Ball, here: Vertex, guided: Bool[Array, " n"], u: Float[Array, "n 3"]
) -> tuple[Rows, Array]:
    """Random directions, and `f cos / density`: `scattered`, and about the ball from outside of it.

    Args:
        focus: the ball.
        here: where the directions start.
        guided: which of them may be drawn about the ball.
        u: uniform numbers.
    """
    outside = norm(focus.middle - here.position) > focus.radius
    share = jnp.where(guided & outside, AIMED, 0.0)
    about = u[:, 0] < share
    again = jnp.where(about, u[:, 0] / AIMED, (u[:, 0] - share) / (1.0 - share))
    along, _, _ = scattered(here, u.at[:, 0].set(again))
    along = jnp.where(about[:, None], _toward(focus, here, u[:, 1:]), along)
    value, density = brdf(here, along)
    density = (1.0 - share) * density + share * _toward_density(focus, here, along)
    return along, jnp.where(density > 0.0, value / jnp.where(density > 0.0, density, 1.0), 0.0)


def _toward(focus: Ball, here: Vertex, u: Float[Array, "n 2"]) -> Rows:
    """Directions about that to the ball; those below the surface are turned up by its mirror."""
    axis, rim = _cone(focus, here)
    t = rim * jnp.expm1(u[:, 0] * jnp.log1p(2.0 / rim))
    rho = jnp.sqrt(jnp.maximum(t * (2.0 - t), 0.0))
    along = matvec(orthonormal_frame(axis), cylindrical(rho, 2.0 * jnp.pi * u[:, 1], 1.0 - t))
    return along - 2.0 * jnp.minimum(dot(along, here.normal), 0.0)[:, None] * here.normal


def _toward_density(focus: Ball, here: Vertex, along: Rows) -> Array:
    """Density by solid angle of `_toward`, above the surface."""
    axis, rim = _cone(focus, here)
    below = along - 2.0 * dot(along, here.normal)[:, None] * here.normal

    def density(along):
        way = along - axis
        return 1.0 / (0.5 * dot(way, way) + rim)  # |a - b|^2 = 2 - 2 cos, with all its digits

    return (density(along) + density(below)) / (2.0 * jnp.pi * jnp.log1p(2.0 / rim))


def _cone(focus: Ball, here: Vertex) -> tuple[Rows, Array]:
    """Unit vectors to the ball's middle, and one less the cosine of the angle to its rim."""
    way = focus.middle - here.position
    distance = jnp.maximum(norm(way), focus.radius)  # from inside nothing is aimed
    sine = focus.radius / distance
    rim = sine**2 / (1.0 + jnp.sqrt(jnp.maximum(1.0 - sine**2, 0.0)))
    return way / distance[:, None], rim
