r"""R07's terms of the light that many points send to the eye, by sums over nodes as products.

What `_area_lights.lobe_radiance` and `shadow_edge_terms` say of one point, of a block of n points
under k nodes at a time. The nodes stand still in a frame of the light: the way to one is

    d = o + Q e

with e the same for all points, o from the point to the middle of a lamp (0 for distant light), and
Q the frame of a surface for a sky whose nodes stand about its normal (else 1). Each term is then a
matrix of n times k weights, times one of k times few numbers (1, e), which are products that a
processor is good at. With h = n.d, c = r.d, m = (c / |d|)^s and F = -a.d / |d|^4,

    A = V F,  B = A m,  C = s B h / c      light over its factors n.d (both lobes) and r.d
    A h / |d|^2,  B h / |d|^2              what a step changes by the distance, of near light
    F h G,  F h m G                        what shadows uncover that move over rows and columns

V tells what is seen. G of a node is the sum over the edges beside it of the jump of V times the
blocker's (1 - tau) / tau, or 1 / D (`_area_lights.edge_rate`). A node's radiance belongs to the few
numbers where all points see the same, so that further bands cost those products alone.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder.imaging._area_lights import (
    TO_LIMB,
    LobeRadiance,
    SurfaceReflectance,
    edge_rate,
    lobe_factors,
)
from firstorder.imaging._interaction import SurfaceInteraction
from firstorder.imaging._lamps import Lamp
from firstorder.imaging._reflection import SurfacePoint, half_turn, mirrored
from firstorder.imaging.sky_lights import CosineSkyLight, DistantLight
from firstorder.numerics._vectors import cross, dot, near_one, orthonormal_frame, settled

Light = Lamp | DistantLight | CosineSkyLight
Many = Float[Array, "n k"]
Terms = tuple[LobeRadiance, LobeRadiance]


class LightFrame(NamedTuple):
    """Nodes of a light as a block of points sees them.

    Attributes:
        light: the lamp, or distant light in its own frame.
        place: e, from the middle of a lamp, or directions.
        share: -a.d of each node over that of its light: a constant of the node.
        radiance: of each node, or of all; 1 where points see it differently (`own`).
        own: radiance of each node from each point, where that differs.
        offset: o of each point, None for distant light.
        frame: Q of each point, None where it is 1.
        facing: what `share` is of, of each point; None for 1.
    """

    light: Lamp | DistantLight
    place: Float[Array, "k 3"]
    share: Float[Array, " k"]
    radiance: Float[Array, "*k"]
    own: Many | None
    offset: Float[Array, "n 3"] | None
    frame: Float[Array, "n 3 3"] | None
    facing: Float[Array, " n"] | None

    def along(self, n: Float[Array, "n 3"]) -> Many:
        """The scalar products of vectors, one a point, with the ways to all nodes."""
        if self.frame is not None:
            n = jnp.einsum("nij,ni->nj", self.frame, n)
        found = n @ self.place.T
        return found if self.offset is None else found + dot(n, self.offset)[:, None]

    @property
    def ways(self) -> list[Array]:
        """The ways to all nodes, coordinates apart."""
        turned = self.place.T[:, None]
        if self.frame is not None:
            turned = [row @ self.place.T for row in jnp.moveaxis(self.frame, 1, 0)]
        if self.offset is None:
            return list(turned)
        return [a + o[:, None] for a, o in zip(turned, self.offset.T, strict=True)]

    @property
    def basis(self) -> Float[Array, "k 4"]:
        """Numbers (1, e) of each node, times its share and radiance."""
        ones = jnp.ones((len(self.place), 1), self.place.dtype)
        scale = jnp.broadcast_to(self.radiance, self.share.shape) * self.share
        return scale[:, None] * jnp.concatenate([ones, self.place], 1)

    def total(self, weight: Many) -> tuple[Float[Array, " n"], Float[Array, "n 3"]]:
        """The sum of weights over nodes, and of weights times ways."""
        found = weight @ self.basis
        total, way = found[:, 0], found[:, 1:]
        if self.frame is not None:
            way = jnp.einsum("nij,nj->ni", self.frame, way)
        return total, way if self.offset is None else way + total[:, None] * self.offset


def light_frame(light: Light, x: Float[Array, "n 3"], up: Float[Array, "n 3"]) -> LightFrame:
    """Nodes of a light as points x with the base normals `up` see them."""
    if isinstance(light, Lamp):
        across = cross(light.u, light.v)
        share = light.area @ near_one(across) / dot(across, near_one(across))
        o = light.center - x
        place = light.position - light.center
        return LightFrame(light, place, share, light.radiance, None, o, None, -(o @ across))
    if isinstance(light, CosineSkyLight):
        local, frame = light.local, orthonormal_frame(up)
        nodes = LightFrame(local, local.way, -dot(local.area, local.way), jnp.ones(()), None, None,
                           frame, None)  # fmt: skip
        world = jnp.stack(nodes.ways)
        return nodes._replace(own=jax.vmap(jax.vmap(light.sky, 1), 1)(world))
    return LightFrame(light, light.way, jnp.maximum(-dot(light.area, light.way), 0.0),
                      light.radiance, None, None, None, None)  # fmt: skip


# --- terms ---------------------------------------------------------------------------------------


class _Weights(NamedTuple):
    """Light of each node at each point, without blockers, over the node's constants.

    Attributes:
        plain: F, zero where a node does not light the point.
        height: n.d.
        lobe: m, zero where the mirrored direction looks away.
        across: r.d, or 1 there.
        inverse: `1 / |d|^2`.
        above: whether it is above the surface itself.
    """

    plain: Many
    height: Many
    lobe: Many
    across: Many
    inverse: Many
    above: Array


def _weights(at: LightFrame, point: SurfacePoint, up, r, exponent) -> _Weights:
    far = at.place.T[:, None] if at.offset is None else at.ways
    squared = sum(a * a for a in far)
    inverse = 1.0 / jnp.where(squared > 0.0, squared, 1.0)
    height, across = at.along(point.normal), at.along(r)
    lit = (height > 0.0) & (squared > 0.0)
    plain = inverse
    if at.facing is not None:
        lit, plain = lit & (at.facing > 0.0)[:, None], plain * at.facing[:, None]
    plain = plain * inverse  # last: alone its square would leave the range of float32
    if at.own is not None:
        plain = plain * at.own
    ahead = lit & (across > 0.0)
    across = jnp.where(ahead, across, 1.0)
    lobe = jnp.exp(0.5 * exponent[:, None] * jnp.log(across * across * inverse))
    lobe = jnp.where(ahead, lobe, 0.0)
    return _Weights(
        *settled((jnp.where(lit, plain, 0.0), height, lobe, across, inverse)), at.along(up) > 0.0
    )


class _Sums(NamedTuple):
    """Sums over all nodes of what both lobes gather, and their gradients, of a block of points.

    Attributes:
        f: light of the diffuse lobe; f_x, f_n: its gradient in position and normal.
        g: light of the glossy lobe; g_x, g_n, g_r: its gradient in position, normal and mirror.
        moved: what moving shadows add to the gradients in position, by lobe.
    """

    f: Array
    f_x: Array
    f_n: Array
    g: Array
    g_x: Array
    g_n: Array
    g_r: Array
    moved: tuple[Array, Array]


def _sums(at: LightFrame, point: SurfacePoint, up, r, s, seen, depth) -> _Sums:
    w, n = _weights(at, point, up, r, s), point.normal
    plain = w.plain if seen is None else jnp.where(w.above, w.plain * seen, 0.0)
    both = settled((plain, plain * w.lobe))
    by_n, f_n = zip(*(at.total(a) for a in both), strict=True)
    by_r, g_r = at.total(s[:, None] * both[1] * w.height / w.across)
    f, g = (dot(n, a) for a in f_n)
    if at.facing is None or not isinstance(at.light, Lamp):
        f_x = g_x = jnp.zeros_like(n)
    else:
        toward = cross(at.light.u, at.light.v) / jnp.where(at.facing > 0.0, at.facing, 1.0)[:, None]
        near = [at.total(a * w.height * w.inverse)[1] for a in both]
        f_x = f[:, None] * toward - by_n[0][:, None] * n + 4.0 * near[0]
        g_x = g[:, None] * toward - by_n[1][:, None] * n - by_r[:, None] * r
        g_x = g_x + (4.0 + s)[:, None] * near[1]
    none = jnp.zeros_like(n)
    moved = (none, none) if seen is None else _moved(at, w, seen, depth)
    return _Sums(f, f_x, f_n[0], g, g_x, f_n[1], g_r, moved)


def light_terms(
    light: Light, at: SurfaceInteraction, seen: Many | None = None, depth: Many | None = None
) -> tuple[Terms, Float[Array, "n 2 2"]]:
    """R07's terms of a block of points under one light: of both lobes, and of moving shadows.

    Args:
        light: the light.
        at: points, all leaves with a leading axis.
        seen: whether each node is seen from each; None if all are, those below the surface
            too. Else what is below it is hidden by it, whatever is given.
        depth: where the others are hidden, as `_point_shading.node_occlusion` gives it.

    Returns:
        Light and gradients of the diffuse and of the glossy lobe, and what shadows that move add to
        both along t and b, zero for nodes that are not even.
    """
    up = jax.vmap(lambda point: point.base_normal)(at.point)
    r = jax.vmap(mirrored)(at.view.to_eye, at.point.normal)
    nodes = light_frame(light, at.point.position, up)
    found = _sums(nodes, at.point, up, r, at.lobe.exponent, seen, depth)
    return jax.vmap(_lobes)(found, at.point, r, at.lobe)


def _lobes(found: _Sums, point: SurfacePoint, r, lobe: SurfaceReflectance):
    """Terms of both lobes from the sums of one point, as `lobe_radiance` has them."""
    n, T = point.normal, point.tangents
    spread, polished = lobe_factors(lobe)
    zero, flat = jnp.zeros(3, T.dtype), jnp.zeros(2, T.dtype)
    grain = found.f / jnp.pi * lobe.slope @ T
    diffuse = LobeRadiance(spread * found.f, spread * found.f_x @ T, spread * cross(n, found.f_n),
                           point.spin, zero, grain)  # fmt: skip
    turned = 0.5 * cross(n, found.g_n) + cross(r, found.g_r)
    glossy = LobeRadiance(polished * found.g, polished * found.g_x @ T, polished * turned,
                          2.0 * point.spin, polished * found.g_r @ half_turn(n), flat)  # fmt: skip
    moved = jnp.stack([a * m @ T for a, m in zip((spread, polished), found.moved, strict=True)])
    return (diffuse, glossy), moved


# --- moving shadows ------------------------------------------------------------------------------


def _moved(at: LightFrame, w: _Weights, seen: Many, depth: Many) -> tuple[Array, Array]:
    """Gradients by shadows that move, for the diffuse and for the glossy lobe."""
    light = at.light
    zero = jnp.zeros((len(seen), 3), seen.dtype)
    if not light.even:
        return zero, zero
    shape = (len(seen), *light.shape)
    V = jnp.where(w.above, seen, 0.0).reshape(shape)
    depth = jnp.where(w.above, depth, 0.0).reshape(shape)
    sent = settled((w.plain * w.height, w.plain * w.height * w.lobe))
    total = [zero, zero]
    for axis in (0, 1):
        G = settled(_edge_weights(V, depth, axis + 1, axis == 1 and light.wraps, light.near))
        for k, flow in enumerate(sent):
            total[k] = total[k] + _slid(at, flow * G.reshape(flow.shape[0], -1), axis)
    return total[0], total[1]


def _slid(at: LightFrame, weight: Many, axis: int) -> Float[Array, "n 3"]:
    """Sum of weights times the nodes' rates of half-way shadows along rows or columns (`slide`)."""
    light = at.light
    if at.facing is None or not isinstance(light, Lamp):  # distant nodes slide alike everywhere
        rate = at.basis[:, :1] * light.slide(jnp.zeros(3, weight.dtype))[:, axis]
        found = weight @ rate
        return found if at.frame is None else jnp.einsum("nij,nj->ni", at.frame, found)
    m = cross(light.u, light.v)
    n = near_one(m)
    dual = (cross(light.v, n), cross(n, light.u))[axis] / dot(m, n)
    total, way = at.total(weight)
    reach = jnp.where(at.facing == 0.0, jnp.inf, -at.facing)
    along = (way @ dual) / reach
    return 0.5 * light.count * (total[:, None] * dual - along[:, None] * m)


def _edge_weights(V, depth, axis: int, wraps: bool, near: bool) -> Float[Array, "n r c"]:
    """Half of the jumps of V beside each node along an axis, times `edge_rate` of blockers."""
    count = V.shape[axis]
    place = jnp.arange(count).reshape([-1 if a == axis else 1 for a in range(3)])

    def next_(a, step=1):
        return jnp.roll(a, -step, axis)

    def at_edge(side: int):
        # Depth at its edge, from the last hidden node and the one before (`_area_lights._at_edge`).
        hidden = next_(V, -side) == 0.0
        if not wraps:
            hidden &= place != (0 if side == 1 else count - 1)
        change = jnp.where(hidden, TO_LIMB * (depth - next_(depth, -side)), 0.0)
        return depth + jnp.where(jnp.abs(change) < 0.25 * depth, change, 0.0)

    jump = next_(V) - V
    if not wraps:
        jump = jnp.where(place == count - 1, 0.0, jump)
    edge = jnp.where(jump < 0.0, next_(at_edge(-1)), at_edge(1))
    each = 0.5 * jump * edge_rate(edge, near)
    return each + next_(each, -1)
