"""Probes of edges and of what they hide."""

import jax.numpy as jnp
import numpy as np

from firstorder import visibility

LIMB, FLAT = (-1.0, 0.0, 0.0), np.diag([0.0, 1.0, 1.0])  # a normal, and a bend across it


def slab(s):
    """Edges of a blocker whose height is a parameter."""
    low, high = (visibility.point_alpha(jnp.stack([c, 1.0 + s])[None], side=c) for c in (1.0, -0.5))
    return visibility.exposed_edges(low, high)


def shadow(s):
    """Shading behind it."""
    return visibility.shading(lambda x, t, w: s * jnp.cos(w + 0.1 * t * x), 0.1, s, slab(s))


def slots(s):
    """Two intervals that overlap."""
    return jnp.stack([-s, 0.0 * s]), jnp.stack([0.1 * s, s])


def disc(s):
    """Distance to a disc of radius s about (0, 2), and the edges that rays find."""

    def hit(a):
        inside = s**2 - 4.0 * jnp.sin(a) ** 2
        there = (inside > 0) & (jnp.cos(a) > 0)
        root = jnp.sqrt(jnp.where(there, inside, 1.0))
        return jnp.where(there, 2.0 * jnp.cos(a) - root, jnp.inf)

    angles = jnp.linspace(-1.5, 1.5, 32, dtype=s.dtype)
    return hit, visibility.bracketed(lambda a: jnp.isfinite(hit(a)), angles, 2)


PROBES = {
    "visibility.Alpha": lambda s: visibility.point_alpha(jnp.stack([s, 1.0]), kappa=s),
    "visibility.Brackets": lambda s: (s, disc(s)[1].angle),
    "visibility.Edges": lambda s: slab(s).gradient,
    "visibility.Limbs": lambda s: visibility.limbs(*disc(s)).alpha().alpha_x,
    "visibility.Elevation": lambda s: (
        visibility.rim_elevation((s, 0.2, 1.0), (0.1, 1.0, s)).gradient
    ),
    "visibility.limb_bend": lambda s: visibility.limb_bend((0.0, 0.0, s), LIMB, s * FLAT, 0.0),
    "visibility.limb_elevation": lambda s: visibility.limb_elevation((0.0, s, 2.0), LIMB, 0.2 * s),
    "visibility.rim_bend": lambda s: visibility.rim_bend((s, 0.2, 1.0), (0.1, 1.0, s)),
    "visibility.rim_elevation": lambda s: visibility.rim_elevation((s, 0.2, 1.0), (0.1, 1.0, s)),
    "visibility.Shading": lambda s: shadow(s).hessian.total,
    "visibility.Split": lambda s: shadow(s).gradient.interior,
    "visibility.angular_by_parts": lambda s: visibility.angular_by_parts(
        lambda x, w: s * jnp.cos(w), lambda a: jnp.exp(-s * a**2), 0.1, s, slab(s)
    ),
    "visibility.blocked_measure": lambda s: visibility.blocked_measure(*slots(s), jnp.sin),
    "visibility.bracketed": lambda s: (s, disc(s)[1].sign),
    "visibility.circle_alpha": lambda s: visibility.circle_alpha(jnp.stack([s, 2.0]), s, kappa=s),
    "visibility.clipped": lambda s: visibility.clipped(*slots(s), (-0.1, 0.2)),
    "visibility.differentiated_edges": lambda s: visibility.differentiated_edges(
        lambda p: slots(p[0] * s), jnp.stack([s, 1.0])
    ),
    "visibility.exposed": lambda s: s * visibility.exposed(*slots(s))[0],
    "visibility.exposed_edges": lambda s: slab(s),
    "visibility.limbs": lambda s: visibility.limbs(*disc(s)),
    "visibility.merged": lambda s: visibility.merged(*slots(s)),
    "visibility.point_alpha": lambda s: visibility.point_alpha(jnp.stack([s, 2.0]), radius=s),
    "visibility.rotated": lambda s: visibility.rotated(visibility.point_alpha(jnp.stack([s, 2.0]))),
    "visibility.shaded": lambda s: shadow(s).value,
    "visibility.shading": lambda s: shadow(s),
    "visibility.sight": lambda s: visibility.sight(jnp.stack([s, 2.0]), radius=s),
    "visibility.signed_edges": lambda s: visibility.signed_edges(*slots(s)),
    "visibility.spanned": lambda s: visibility.spanned(*slots(s)),
    "visibility.visible_gaps": lambda s: visibility.visible_gaps(*slots(s)),
    "visibility.visible_measure": lambda s: visibility.visible_measure(*slots(s), jnp.sin),
}
