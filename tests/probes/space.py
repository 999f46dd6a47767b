"""Probes of space."""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder import space


def ball(s):
    """A ball above the floor, of radius s / 4."""
    return space.Scene.of(space.primitive(space.sphere((0.1, 0.2, 1.0), 0.25 * s), emission=s))


def under(s):
    """A receiver below it."""
    return space.receiver(jnp.stack([0.1 * s, 0.0, 0.0]))


def towards(s):
    """A ray to the ball."""
    return jnp.zeros((1, 3)) + 0.01 * s, jnp.array([[0.1, 0.2, 1.0]]) / np.sqrt(1.05)


def reached(shape):
    """Where a ray that nearly hits its middle meets a shape, and what is seen of its edge."""
    ray = jnp.array([0.02, 0.03, -3.0]), jnp.array([0.0, 0.0, 1.0])
    row = jax.tree.map(lambda a: a[0], shape)
    scene = space.Scene.of(space.primitive(shape))
    return row.distance(*ray, False), space.silhouette(scene, jnp.array([0.3, 0.4, -5.0]))


def faced(s):
    """Two patches that see each other."""
    return (
        jnp.stack([s, 0.0, 0.1]),
        jnp.array([0.0, 0.0, 1.0]),
        jnp.stack([0.2, -0.1, 1.0 + s]),
        jnp.array([0.0, 0.0, -1.0]),
    )


def slanted(s):
    """Axes of a shape."""
    return jnp.diag(jnp.stack([s, 0.5 + s, 1.0])) + 0.1 * jnp.ones((3, 3))


def seen(s, sky):
    """A sky at its poles and aside, where the direction moves too."""
    aside = jnp.stack([0.6 * jnp.cos(s), 0.8, 0.6 * jnp.sin(s)])
    return sky(jnp.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])), sky(aside)


PROBES = {
    "space.Ellipsoids": lambda s: reached(space.Ellipsoids((0.0, 0.0, 0.0), slanted(s))),
    "space.Boxes": lambda s: space.Boxes((0.0, 0.0, 0.0), slanted(s)),
    "space.Cylinders": lambda s: reached(space.Cylinders((0.0, 0.0, 0.0), slanted(s))),
    "space.Discs": lambda s: reached(space.Discs((0.0, 0.0, 0.0), slanted(s))),
    "space.Rectangles": lambda s: reached(space.Rectangles((0.0, 0.0, 0.0), slanted(s))),
    "space.Triangles": lambda s: reached(space.Triangles((0.0, 0.0, 0.0), slanted(s))),
    "space.Planes": lambda s: space.Planes((0.0, 0.0, 0.0), slanted(s)),
    "space.sphere": lambda s: space.sphere((0.0, 0.0, 2.0), s),
    "space.ellipsoid": lambda s: space.ellipsoid((0.0, 0.0, 2.0), slanted(s)),
    "space.box": lambda s: space.box((0.0, 0.0, 0.0), jnp.stack([s, 2.0 * s, 1.0])),
    "space.cylinder": lambda s: space.cylinder((0.0, 0.0, 0.0), (0.0, 1.0, 1.0), s),
    "space.disc": lambda s: space.disc((0.0, 0.0, 1.0), jnp.stack([s, 1.0, 1.0]), 1.0),
    "space.rectangle": lambda s: space.rectangle(
        (0.0, 0.0, 1.0), jnp.stack([s, 1.0, 0.0]), (0.0, 1.0, 1.0)
    ),
    "space.triangle": lambda s: space.triangle(
        (0.0, 0.0, 1.0), jnp.stack([s, 1.0, 0.0]), (0.0, 1.0, 1.0)
    ),
    "space.triangles": lambda s: (
        space.triangles(
            space.meshes.mesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]]).at(
                s * jnp.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
            )
        ).axes
    ),
    "space.polygon": lambda s: space.polygon(
        jnp.stack([jnp.stack([s, 0.0, 0.0]), jnp.array([0.0, 2.0, 0.0]), jnp.array([-1.0, 0, 0])])
    ),
    "space.plane": lambda s: space.plane((0.0, 0.0, 0.0), jnp.stack([s, 0.0, 1.0])),
    "space.Material": lambda s: space.primitive(space.sphere((0, 0, 2), 1.0), emission=s).material,
    "space.Primitive": lambda s: (
        space.primitive(space.sphere((0, 0, 2), 1.0), albedo=0.5 * s).material
    ),
    "space.primitive": lambda s: (
        space.primitive(space.sphere((0, 0, 2), 1.0), specular=0.5 * s).material
    ),
    "space.Scene": lambda s: ball(s).surface(0, *(a[0] for a in towards(s))),
    "space.Receiver": lambda s: under(s).moved(jnp.stack([s, 0.1])),
    "space.receiver": lambda s: space.receiver(jnp.stack([s, 0.0, 0.0]), (0.0, 1.0, 1.0)),
    "space.in_receiver_frame": lambda s: space.in_receiver_frame(
        space.receiver((0.0, 0.0, 0.0), jnp.stack([s, 1.0, 1.0])), jnp.stack([s, 2.0, 1.0])
    ),
    "space.ConstantSky": lambda s: seen(s, space.ConstantSky(s)),
    "space.GaussianSky": lambda s: seen(s, space.GaussianSky(jnp.stack([s, 0.0, 1.0]), s, 1.0 + s)),
    "space.HarmonicSky": lambda s: seen(s, space.HarmonicSky(s * jnp.arange(1.0, 10.0))),
    "space.PanoramaSky": lambda s: seen(s, space.PanoramaSky(s * jnp.arange(12.0).reshape(3, 4))),
    "space.Hits": lambda s: space.nearest(ball(s), *towards(s)).t,
    "space.first_shape": lambda s: s * space.first_shape(ball(s), *towards(s)),
    "space.nearest": lambda s: space.nearest(ball(s), *towards(s)),
    "space.occluded": lambda s: s * space.occluded(ball(s), *towards(s)),
    "space.silhouettes._curves.SilhouetteSegments": lambda s: (
        space.silhouette(ball(s), under(s).position).straight.start + s
    ),
    "space.silhouettes._curves.SilhouetteArcs": lambda s: (
        space.silhouette(ball(s), under(s).position).curved
    ),
    "space.Silhouette": lambda s: space.silhouette(ball(s), under(s).position),
    "space.silhouette": lambda s: space.silhouette(ball(s), under(s).position).curved.center,
    "space.silhouettes._sides.SilhouetteSides": lambda s: space.visible_silhouettes(
        ball(s), under(s)
    ).rims.jump(jnp.stack([s, 2.0 * s])),
    "space.VisibleSilhouettes": lambda s: space.visible_silhouettes(ball(s), under(s)).on_arcs(4),
    "space.visible_silhouettes": lambda s: space.visible_silhouettes(ball(s), under(s)),
    "space.geometry_jet": lambda s: space.geometry_jet(*faced(s)),
    "space.geometry_term": lambda s: space.geometry_term(*faced(s)),
    "space.net_visibility": lambda s: space.net_visibility(ball(s), under(s), nodes=4),
    "space.irradiance": lambda s: space.irradiance(ball(s), under(s), nodes=4),
    "space.vector_irradiance": lambda s: space.vector_irradiance(ball(s), under(s), nodes=4),
    "space.Derivatives": lambda s: space.Derivatives(s, s[None], s[None, None], ("x",)).second,
    "space.derivatives": lambda s: space.derivatives(
        space.irradiance, ball(s), under(s), freedoms=("x",), nodes=4
    ),
    "space.boundary_gradient": lambda s: space.boundary_gradient(ball(s), under(s), nodes=4),
    "space.light_field": lambda s: space.light_field(ball(s), under(s)).jet(
        jnp.stack([0.1 * s, 0.0, 0.0, -0.2])
    ),
}
