"""Light that several probes send on its way."""

import equinox as eqx
import jax
import jax.numpy as jnp

from firstorder import fields, transport
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.fields import Grid, gaussian

ANGLE, OFFSET, OUT = Frame(("theta",)), Frame(("x",)), Frame(sense="outgoing")
SLOPE = FLATLAND_SLOPE
GRID = Grid.spanning((8, 9), (2.0, 1.8))


def light(s, frame=FLATLAND):
    """Off-centre, correlated, of width s."""
    return gaussian(jnp.stack([0.2 * s, -0.1]), jnp.stack([0.5 + s, 0.4]), 0.3, 1.3, frame)


def ray(frame):
    return jnp.array([0.31, 0.12, -0.2, 0.15])[: frame.dims]


def jet(field):
    """Value, to be differentiated, and the jet at a ray, which is a derivative already."""
    arrays, rest = eqx.partition(field, eqx.is_inexact_array)
    frozen = eqx.combine(jax.lax.stop_gradient(arrays), rest)
    return field.at(ray(field.frame)), jax.lax.stop_gradient(frozen.jet(ray(field.frame)))


def value_on(event, s, frame=FLATLAND):
    """The value alone: for what shares its jet with something else on the walk."""
    field = event(light(s, frame))
    return field.at(ray(field.frame))


def on(event, s, frame=FLATLAND):
    """The jet of light after an event or law."""
    return jet(event(light(s, frame)))


def lobe(s):
    return fields.GaussianProfile(0.3 + 0.1 * s)


def mask(s, frame=SLOPE):
    return fields.half_plane(s, 0.0, 1.0, "x", frame)


def wave(s, frame=FLATLAND):
    return transport.wave(0.25, 0.2 * s, frame=frame)
