"""Shadow edges by azimuth from traced rays, without knowledge of the silhouettes.

In a vertical slice a few dozen rays say "blocked" or "free"; between neighbours that differ an edge
is bisected. The point that the edge's ray touches is not the first hit beside it: on a smooth
blocker that lies nearer by the root of the step. But angle, distance and normal are smooth
functions of `q = |w . n|` at the hits, which vanishes at the contour: polynomials through a few
hits, at q = 0, give all three. At a corner q does not vanish; the edge is then where it was
bisected, and how it runs is seen from the slices beside it.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder.conventions import polar
from firstorder.errors import check_positive
from firstorder.numerics._compiled import compiled
from firstorder.space.intersect import nearest
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene
from firstorder.visibility.elevation import contour_elevation
from firstorder.visibility.from_rays import bracket_edges


class TracedEdges(eqx.Module):
    """Edges in vertical slices, a row for each azimuth; slots that are not used have sign 0.

    Attributes:
        alpha: polar angle, negative beyond the pole [rad].
        sign: +1 from visible to blocked as angles grow, -1 back.
        distance: to the touched point [m].
        alpha_v: rate for a step across the slice [rad/m].
        phi: azimuths, in [0, pi) [rad].
        smooth: 1 for a smooth contour, 0 for a corner.
        extra: rays beyond those that are traced for shading anyway.
    """

    alpha: Float[Array, "k m"]
    sign: Float[Array, "k m"]
    distance: Float[Array, "k m"]
    alpha_v: Float[Array, "k m"]
    phi: Float[Array, " k"]
    smooth: Float[Array, "k m"]
    extra: Int[Array, ""]

    def gradient(self) -> Float[Array, "2"]:
        """Gradient of net visibility by R07 (48), the azimuths taken as evenly spaced.

        Rates grow without bound where a slice grazes: a hundred azimuths may be off by a third
        beside a ball, however exact each of its edges.
        """
        s, c = jnp.sin(self.alpha), jnp.cos(self.alpha)
        u, v = self.sign * jnp.abs(s) * -c / self.distance, self.sign * jnp.abs(s) * self.alpha_v
        cos, sin = jnp.cos(self.phi)[:, None], jnp.sin(self.phi)[:, None]
        return jnp.stack([jnp.sum(u * cos - v * sin), jnp.sum(u * sin + v * cos)]) * (
            np.pi / self.phi.size
        )


def traced_edges(
    scene: Scene,
    at: Receiver,
    *,
    azimuths: int = 100,
    rays: int = 100,
    size: int = 4,
    steps: int = 9,
    points: int = 4,
    reach: float = 4e-3,
) -> TracedEdges:
    """Edges of sampled visibility, refined to the point of contact.

    Valid when: blockers and gaps are wider than the step between two rays, and each blocker is the
    nearest surface over `reach` inside its edge.

    Args:
        scene: the blockers.
        at: the receiver, one.
        azimuths: half great circles, even over [0, pi).
        rays: in each, even in polar angle.
        size: slots for edges in a slice; NaN if there are more.
        steps: bisections of an edge.
        points: hits for its contour.
        reach: how far inside the edge to look [rad].

    Raises:
        ValueError: if a count or `reach` is not positive.

    Reference: R07 §8.1, which takes the nearest ray's angle and its first hit.

    Example:
        >>> from firstorder.space import Scene, receiver, sphere, primitive
        >>> from firstorder.space.azimuthal._from_rays import traced_edges
        >>> scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 1.0)))
        >>> found = traced_edges(scene, receiver((0.0, 0.0, 0.0)), azimuths=2)
        >>> found.alpha[0, :2].round(3).tolist(), found.sign[0].tolist()
        ([-0.524, 0.524], [1.0, -1.0, 0.0, 0.0])
    """
    for name, count in (("azimuths", azimuths), ("rays", rays), ("points", points)):
        check_positive(name, count)
    check_positive("reach", reach)
    return _found(scene, at, azimuths, rays, size, steps, points, reach)


@compiled
def _found(
    scene: Scene,
    at: Receiver,
    azimuths: int,
    rays: int,
    size: int,
    steps: int,
    points: int,
    reach: ArrayLike,
) -> TracedEdges:
    """`traced_edges` of good numbers."""
    dtype = at.position.dtype
    phi = jnp.asarray(np.pi * (np.arange(azimuths) + 0.5) / azimuths, dtype)
    theta = jnp.asarray(np.pi * ((np.arange(rays) + 0.5) / rays - 0.5), dtype)
    width = np.pi / rays * 0.5**steps
    delta = jnp.asarray(0.5 * width + reach * (np.arange(points) / (points - 1.0)) ** 2, dtype)

    def one(phi):
        edges = bracket_edges(lambda a: _hits(scene, at, phi, a)[0] >= 0, theta, size, steps)
        inside = edges.angle[:, None] + edges.sign[:, None] * delta
        _, t, normal, w = _hits(scene, at, phi, inside.ravel())
        shape = inside.shape
        return (*_touched(edges, inside, t.reshape(shape), normal.reshape(*shape, 3), w), edges)

    alpha, D, normal, smooth, edges = jax.lax.map(one, phi)
    shown = edges.sign != 0.0
    D = jnp.where(shown, D, 1.0)
    at_phi = jnp.broadcast_to(phi[:, None], alpha.shape)
    p = D[..., None] * polar(alpha, at_phi)
    limb = contour_elevation(p, normal, at_phi).alpha_v
    # alpha_phi = sin(alpha) D alpha_v, from the slices on either side.
    slope = _beside(alpha, edges.count) * azimuths / np.pi
    sine = jnp.sin(alpha)
    corner = slope / jnp.where(sine == 0.0, 1.0, D * sine)
    alpha_v = jnp.where(shown, jnp.where(smooth, jnp.nan_to_num(limb), corner), 0.0)
    extra = jnp.sum(edges.count) * (steps + points)
    return TracedEdges(alpha, edges.sign, D, alpha_v, phi, smooth * 1.0, extra)


# --- small change --------------------------------------------------------------------------------


def _hits(scene: Scene, at: Receiver, phi, theta):
    """First hits at angles of a slice: shape or -1, distance, normal and direction (local)."""
    w = polar(theta, jnp.broadcast_to(phi, theta.shape))
    world = w @ at.axes.T
    origins = jnp.broadcast_to(at.position, world.shape)
    found = nearest(scene, origins, world, at.on)
    index = jnp.maximum(found.index, 0)
    _, normal, t = jax.vmap(scene.surface)(index, origins, world)
    return found.index, t, normal @ at.axes, w


def _touched(edges, inside, t, normal, w):
    """Angle, distance and normal at q = 0, or at the edge itself where that is a corner."""
    shown = (edges.sign != 0.0)[:, None]
    t, normal = jnp.where(shown, t, 1.0), jnp.where(shown[..., None], normal, 0.0)
    q = jnp.abs(jnp.sum(normal * w.reshape(normal.shape), -1))
    smooth = (q[:, 0] < 0.6 * q[:, -1]) & (edges.sign != 0.0)
    # Lagrange's polynomial at zero; at a corner in the distance from the edge.
    s = jnp.where(smooth[:, None], q, jnp.abs(inside - edges.angle[:, None]))
    others = ~np.eye(s.shape[1], dtype=bool)
    ratio = s[:, None, :] / jnp.where(others, s[:, None, :] - s[:, :, None], 1.0)
    weight = jnp.prod(jnp.where(others, ratio, 1.0), -1)
    weight = jnp.where(shown, weight, 0.0)
    alpha = jnp.where(smooth, jnp.sum(weight * inside, -1), edges.angle)
    return alpha, jnp.sum(weight * t, -1), jnp.sum(weight[..., None] * normal, -2), smooth


def _beside(alpha, count):
    """Half the change of each edge's angle from the slice before to the slice after.

    Slices go round: after the last comes the first, upside down. Where the number of edges changes
    the difference is one-sided, or none.
    """
    used = jnp.arange(alpha.shape[1]) < count[:, None]

    def upside_down(row, n):
        turned = -row[::-1]
        return jnp.roll(turned, n - row.size)

    after = jnp.roll(alpha, -1, 0).at[-1].set(upside_down(alpha[0], count[0]))
    before = jnp.roll(alpha, 1, 0).at[0].set(upside_down(alpha[-1], count[-1]))
    next_, last = jnp.roll(count, -1) == count, jnp.roll(count, 1) == count
    rise = jnp.where(next_[:, None], after - alpha, 0.0)
    fall = jnp.where(last[:, None], alpha - before, 0.0)
    share = jnp.maximum(next_ * 1.0 + last * 1.0, 1.0)[:, None]
    return jnp.where(used, (rise + fall) / share, 0.0)
