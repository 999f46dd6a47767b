"""Probes of flatland."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder import flatland


def beam(s):
    """A segment overhead."""
    return flatland.Segments(jnp.stack([0.5 + s, 1.0]), jnp.stack([-0.5, 1.0]))


def shadowed(s):
    """A lamp, which is a mirror too, and a disc before it."""
    lamp = flatland.thing(beam(s), emission=s, mirror=0.5)
    return flatland.Scene.of(lamp, flatland.thing(flatland.Circles((0.1, 0.4), 0.1 * s)))


def above(s):
    """A receiver below the lamp."""
    return flatland.Receiver(jnp.stack([s, 0.0]), 0.1 * s)


def lit(s):
    """Irradiance as a function of the receiver."""
    return lambda at: flatland.irradiance(shadowed(s), at)


def up(s):
    """One ray that meets the lamp."""
    return jnp.stack([s, 0.0])[None], jnp.array([[0.0, 1.0]]) + 0.0 * s


def hit_of(shape):
    """A ray upward, and the tangents."""
    scene = flatland.Scene.of(flatland.thing(shape))
    return flatland.nearest(scene, jnp.zeros((1, 2)), jnp.array([[0.0, 1.0]])), scene.silhouettes(
        jnp.zeros(2)
    )


def round_curve(s):
    """A smooth closed curve overhead."""
    a = 2.0 * np.pi * np.arange(16) / 16
    curve = flatland.closed_curve(np.stack([np.cos(a), 2.0 + np.sin(a)], -1), 2)
    return eqx.tree_at(lambda c: c.cosines, curve, curve.cosines.at[:, 1, 0].add(0.1 * s))


PROBES = {
    "flatland.Arcs": lambda s: hit_of(flatland.Arcs((0.0, 2.0), 0.5 + s, 0.5, -5.0)),
    "flatland.Circles": lambda s: hit_of(flatland.Circles((0.0, 2.0), s)),
    "flatland.Curves": lambda s: hit_of(round_curve(s)),
    "flatland.Derivatives": lambda s: flatland.derivatives(lit(s), above(s)).along(s).second,
    "flatland.Ellipses": lambda s: hit_of(
        flatland.Ellipses((0.0, 2.0), jnp.stack([s, 0.5 * s]), s)
    ),
    "flatland.Frenet": lambda s: shadowed(s).frame(1, 0.1).normal,
    "flatland.Hits": lambda s: flatland.nearest(shadowed(s), *up(s)).s,
    "flatland.Material": lambda s: flatland.thing(beam(s), emission=s).material,
    "flatland.PointLights": lambda s: flatland.PointLights((0.0, 1.0), s),
    "flatland.Receiver": lambda s: above(s).normal,
    "flatland.Scene": lambda s: shadowed(s).length(0),
    "flatland.Segments": lambda s: hit_of(beam(s)),
    "flatland.Thing": lambda s: flatland.thing(beam(s), albedo=s).material,
    "flatland.View": lambda s: flatland.view(shadowed(s), above(s)).angles,
    "flatland.derivatives_on_shape": lambda s: flatland.derivatives_on_shape(
        lit(s), shadowed(s), 1, 0.1 * s
    ),
    "flatland.box": lambda s: flatland.box((0.0, 0.0), jnp.stack([s, 1.0])),
    "flatland.closed_curve": lambda s: hit_of(round_curve(s)),
    "flatland.gathered": lambda s: flatland.gathered(shadowed(s), above(s), jnp.cos, nodes=4),
    "flatland.in_mirrors": lambda s: flatland.in_mirrors(shadowed(s), above(s), (0,)),
    "flatland.irradiance": lambda s: flatland.irradiance(shadowed(s), above(s)),
    "flatland.nearest": lambda s: flatland.nearest(shadowed(s), *up(s)),
    "flatland.occluded": lambda s: s * flatland.occluded(shadowed(s), *up(s)),
    "flatland.polyline": lambda s: flatland.polyline(
        jnp.stack([jnp.stack([s, s]), s * jnp.eye(2)[0]])
    ),
    "flatland.receiver": lambda s: flatland.receiver(shadowed(s), 1, s),
    "flatland.thing": lambda s: flatland.thing(beam(s), mirror=s).material,
    "flatland.derivatives": lambda s: flatland.derivatives(lit(s), above(s)),
    "flatland.view": lambda s: flatland.view(shadowed(s), above(s)).angles,
    "flatland.ConstantSky": lambda s: flatland.ConstantSky(s)(s),
    "flatland.GaussianSky": lambda s: flatland.GaussianSky(0.1, 0.5 + s, s)(s),
    "flatland.RowSky": lambda s: flatland.RowSky(jnp.stack([s, 2.0 * s, 1.0 + s, s]), True)(s),
}
