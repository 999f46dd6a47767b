"""Reflection by composed laws, which split the integral at the edges of the light."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import Frame
from firstorder.fields.field import Field, Function
from firstorder.fields.jet import Jet
from firstorder.laws.convolve import Convolve
from firstorder.laws.integrate import Integrate
from firstorder.laws.move import Move
from firstorder.laws.multiply import Multiply
from firstorder.transport.brdf.general import Brdf
from firstorder.transport.brdf.lobes import Lobe
from firstorder.transport.events.bump import Bump
from firstorder.transport.events.cosine import ClampedCosine
from firstorder.typing import Ray, Scalar

_WIDE = Frame(("x", "theta", "omega"))


def convolved(r: Lobe, light: Field, normal: Field, nodes: int) -> Field:
    """The light, times the clamped cosine if the lobe asks for it, convolved with the lobe.

    What is reflected along a ray is its value at the centre of the lobe (`center_of`).
    """
    if r.cosine:
        light = Multiply(Bump(normal, back=True)(ClampedCosine()))(light)
    return Convolve(r.kernel, nodes=nodes)(light)


def over_hemisphere(r: Brdf, light: Field, normal: Field, nodes: int) -> Field:
    """Light that a general BRDF reflects: into the local frame, integrated, and back."""
    local = Bump(normal)(light)
    factor = Function(lambda x, o, w: r.derivatives(w, o)[0] * jnp.cos(w), _WIDE)
    wide = Move([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], to=_WIDE)(local)
    quarter = 0.5 * np.pi
    breaks = tuple(_Peak(r, i) for i in range(len(r.peaks(jnp.zeros(())))))
    integrate = Integrate("omega", -quarter, quarter, nodes, breaks)
    integral = integrate(Multiply(factor)(wide))
    return Bump(normal, back=True)(integral)


class _Peak(Field):
    """Peak of a general BRDF, to split quadrature there: it moves nothing but the nodes."""

    brdf: Brdf
    index: int = eqx.field(static=True)
    frame: Frame = eqx.field(static=True, default=_WIDE)

    def at(self, u: Ray) -> Scalar:
        """One of the peaks for the outgoing angle, held still."""
        return jax.lax.stop_gradient(self.brdf.peaks(u[1])[self.index].astype(u.dtype))

    def jet(self, u: Ray) -> Jet:
        """The peak, and zeros."""
        zero = jnp.zeros((u.size, u.size), u.dtype)
        return Jet(self.at(u), zero[0], zero, self.frame)
