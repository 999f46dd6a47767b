"""Probes of edges and of what they hide."""

import jax.numpy as jnp
import numpy as np

from firstorder import visibility

LIMB, FLAT = (-1.0, 0.0, 0.0), np.diag([0.0, 1.0, 1.0])  # a normal, and a bend across it


def slab(s):
    """Edges of a blocker whose height is a parameter."""
    low, high = (
        visibility.point_edge_angle(jnp.stack([c, 1.0 + s])[None], side=c) for c in (1.0, -0.5)
    )
    return visibility.visible_edges(low, high)


def shadow(s):
    """Shading behind it."""
    return visibility.shading(lambda x, t, w: s * jnp.cos(w + 0.1 * t * x), 0.1, s, slab(s))


def slots(s):
    """Two intervals that overlap."""
    return jnp.stack([-s, 0.0 * s]), jnp.stack([0.1 * s, s])


def segment(s):
    """A straight edge overhead, and one seen end-on."""
    there = jnp.array([0.3, -0.2, 1.0]) + 0.0 * s
    return jnp.stack([there, s * there]), jnp.stack([jnp.stack([-s, s, 1.0 + s]), there])


def disc(s):
    """Distance to a disc of radius s about (0, 2), and the edges that rays find."""

    def hit(a):
        inside = s**2 - 4.0 * jnp.sin(a) ** 2
        there = (inside > 0) & (jnp.cos(a) > 0)
        root = jnp.sqrt(jnp.where(there, inside, 1.0))
        return jnp.where(there, 2.0 * jnp.cos(a) - root, jnp.inf)

    angles = jnp.linspace(-1.5, 1.5, 32, dtype=s.dtype)
    return hit, visibility.bracket_edges(lambda a: jnp.isfinite(hit(a)), angles, 2)


PROBES = {
    "visibility.EdgeAngle": lambda s: visibility.point_edge_angle(jnp.stack([s, 1.0])).along(s, s),
    "visibility.BracketedEdges": lambda s: (s, disc(s)[1].angle),
    "visibility.VisibilityEdges": lambda s: slab(s).edges.gradient,
    "visibility.TangentPoints": lambda s: visibility.tangent_points(*disc(s)).edges().along().first,
    "visibility.Elevation": lambda s: (
        visibility.crease_elevation((s, 0.2, 1.0), (0.1, 1.0, s)).gradient
    ),
    "visibility.contour_elevation_hessian": lambda s: visibility.contour_elevation_hessian(
        (0.0, 0.0, s), LIMB, s * FLAT, 0.0
    ),
    "visibility.contour_elevation": lambda s: visibility.contour_elevation(
        (0.0, s, 2.0), LIMB, 0.2 * s
    ),
    "visibility.crease_elevation_hessian": lambda s: visibility.crease_elevation_hessian(
        (s, 0.2, 1.0), (0.1, 1.0, s)
    ),
    "visibility.crease_elevation": lambda s: visibility.crease_elevation(
        (s, 0.2, 1.0), (0.1, 1.0, s)
    ),
    "visibility.Shading": lambda s: shadow(s).hessian.total,
    "visibility.SplitDerivative": lambda s: shadow(s).gradient.interior,
    "visibility.angular_derivative_by_parts": lambda s: visibility.angular_derivative_by_parts(
        lambda x, w: s * jnp.cos(w), lambda a: jnp.exp(-s * a**2), 0.1, s, slab(s)
    ),
    "visibility.blocked_measure": lambda s: visibility.blocked_measure(*slots(s), jnp.sin),
    "visibility.bracket_edges": lambda s: (s, disc(s)[1].sign),
    "visibility.circle_edge_angle": lambda s: visibility.circle_edge_angle(jnp.stack([s, 2.0]), s),
    "visibility.clip_intervals": lambda s: visibility.clip_intervals(*slots(s), (-0.1, 0.2)),
    "visibility.autodiff_edges": lambda s: visibility.autodiff_edges(
        lambda p: slots(p[0] * s), jnp.stack([s, 1.0])
    ),
    "visibility.exposed_ends": lambda s: s * visibility.exposed_ends(*slots(s))[0],
    "visibility.visible_edges": lambda s: slab(s),
    "visibility.tangent_points": lambda s: visibility.tangent_points(*disc(s)),
    "visibility.merge_intervals": lambda s: visibility.merge_intervals(*slots(s)),
    "visibility.point_edge_angle": lambda s: visibility.point_edge_angle(
        jnp.stack([s, 2.0]), radius=s
    ),
    "visibility.edge_at": lambda s: visibility.edge_at(s, 1.0 + s, s, 0.1 * s),
    "visibility.segment_solid_angle": lambda s: visibility.segment_solid_angle(*segment(s)),
    "visibility.segment_vector_irradiance": lambda s: visibility.segment_vector_irradiance(
        *segment(s)
    ),
    "visibility.shading_derivatives": lambda s: shadow(s).value,
    "visibility.shading": lambda s: shadow(s),
    "visibility.signed_edges": lambda s: visibility.signed_edges(*slots(s)),
    "visibility.interval_between": lambda s: visibility.interval_between(*slots(s)),
    "visibility.visible_gaps": lambda s: visibility.visible_gaps(*slots(s)),
    "visibility.visible_measure": lambda s: visibility.visible_measure(*slots(s), jnp.sin),
}
