"""Scattering at surfaces of flatland: the BRDF, and a random next direction.

Directions are pairs (sine, cosine) of the local angle, counter-clockwise from the normal of the
side that is met, so that tracing needs no inverse trigonometry. `out` is where the traced ray came
from, `sine, cosine` where it goes on to. A material that lets light through (refraction) is a
function of the signature of `scatter` that returns a negative cosine.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder._display import Module
from firstorder.numerics._select import safe_sqrt
from firstorder.sampling._distributions import lobe_area, lobe_power, lobe_sine


class Surface(Module):
    """Material at a place, on the side that the ray meets.

    Attributes:
        albedo: diffuse share; BRDF `albedo / 2`.
        mirror: share reflected as by a mirror.
        specular: share reflected by the glossy lobe at normal incidence; less at a slant.
        exponent: of that lobe.
        ior: index of refraction behind the side that is met over that before it; 0 if opaque.
    """

    albedo: Float[Array, "*n"]
    mirror: Float[Array, "*n"]
    specular: Float[Array, "*n"]
    exponent: Float[Array, "*n"]
    ior: Float[Array, "*n"]

    @property
    def total(self) -> Float[Array, "*n"]:
        """The share that goes on, at most."""
        return self.albedo + self.mirror + self.specular


class Scattered(Module):
    """A random next direction.

    Attributes:
        sine, cosine: of its local angle; a negative cosine goes through the surface.
        weight: BRDF times cosine over density; what radiance from there counts.
        density: per radian; of all lobes that have one, whichever was drawn.
        delta: whether it could only have been this direction (mirror), which has no density.
    """

    sine: Float[Array, "*n"]
    cosine: Float[Array, "*n"]
    weight: Float[Array, "*n"]
    density: Float[Array, "*n"]
    delta: Bool[Array, "*n"]


def lobe_flux(e: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Normalisation of the glossy lobe: `int cos^(e + 1)` over the hemicircle."""
    return lobe_area(e + 1.0)


def reflect(
    surface: Surface,
    out: tuple[Array, Array],
    sine: Float[Array, "*n"],
    cosine: Float[Array, "*n"],
    glossy: bool = True,
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """BRDF times cosine, and the density with which `scatter` draws that direction.

    `f = albedo / 2 + specular cos^e(theta - theta_m) / A_(e+1)`, with `theta_m` the mirrored
    direction: reciprocal, and reflects no more than `albedo + specular`, which it does reflect at
    normal incidence. The mirror is not in it: it has no density.

    Args:
        surface: the material.
        out: sine and cosine of the other direction.
        sine: of the direction asked for.
        cosine: of the direction asked for; nothing is reflected where it is not positive.
        glossy: whether there is a glossy lobe anywhere; False saves its powers.

    Reference: J12 eqs. 18-22, §3 "energy conservation and normalization".
    """
    up = jnp.maximum(cosine, 0.0)
    total = surface.total
    share = 1.0 / jnp.where(total > 0.0, total, 1.0)
    value, density = 0.5 * surface.albedo * up, 0.5 * share * surface.albedo * up
    if glossy:
        off = cosine * out[1] - sine * out[0]
        lobe = surface.specular * lobe_power(off, surface.exponent)
        value = value + lobe * up / lobe_flux(surface.exponent)
        seen = jnp.where(cosine > 0.0, lobe, 0.0)
        density = density + share * seen / lobe_area(surface.exponent)
    return value, density


def scatter(
    surface: Surface,
    out: tuple[Array, Array],
    u: Float[Array, "*n 3"],
    glossy: bool = True,
) -> Scattered:
    """Draws the direction to follow: a lobe by its share, then a direction from the lobe.

    What is drawn below the horizon (the tail of a slanted glossy lobe) has weight zero.

    Args:
        surface: the material.
        out: sine and cosine of the direction that the ray came from.
        u: three uniform numbers.
        glossy: whether there is a glossy lobe anywhere.
    """
    total = surface.total
    pick = u[..., 0] * total
    sine = 2.0 * u[..., 1] - 1.0
    cosine = 2.0 * safe_sqrt(u[..., 1] * (1.0 - u[..., 1]))
    if glossy:
        s = lobe_sine(surface.exponent, u[..., 1], u[..., 2])
        c = safe_sqrt((1.0 - s) * (1.0 + s))
        shiny = pick >= surface.albedo + surface.mirror
        sine = jnp.where(shiny, s * out[1] - c * out[0], sine)
        cosine = jnp.where(shiny, c * out[1] + s * out[0], cosine)
    delta = (pick >= surface.albedo) & (pick < surface.albedo + surface.mirror)
    sine = jnp.where(delta, -out[0], sine)
    cosine = jnp.where(delta, out[1], cosine)
    value, density = reflect(surface, out, sine, cosine, glossy)
    weight = jnp.where(density > 0.0, value / jnp.where(density > 0.0, density, 1.0), 0.0)
    return Scattered(sine, cosine, jnp.where(delta, total, weight), density, delta)
