r"""Radiance of a pixel under area lights and its image gradient, and nothing else.

`_area_lights.lobe_radiance` tells R07's terms apart. Here they are summed before the nodes are.
With d the way to a node of area vector a, `W = L (-a.d) / |d|^4` where it is seen, h = n.d, c = r.d
and `m = (c / |d|)^s`, the light of both lobes is

    B = sum_k W h (D + G m)            D = albedo / pi,   G = specular (s + 2) / (2 pi)

and when the point moves by dx, its normal by dn and its mirrored direction by dr,

    dB = sum_k U (dn.d - n.dx) + U h/(-a.d) a.dx + X d.dx + R (dr.d - r.dx) + dD sum_k W h

    U = W (D + G m),   X = W h (4 D + (4 + s) G m) / |d|^2,   R = s W h G m / c

dx, dn and dr are those of one pixel for all of its nodes. So the sums are taken first, moments of
nodes with the weights U, U h/(-a.d), X and R, and each node costs a few products more than its
value does, whatever a bump or a camera does to the point. Distant nodes move along: dx is zero for
them.

A shadow's edge between two nodes moves too (`_area_lights.shadow_edge_terms`); it is asked for each
edge alone, by `edge_radiance`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder._display import Module
from firstorder.imaging._area_lights import Shares, lobe_factors
from firstorder.imaging._interaction import SurfaceInteraction
from firstorder.imaging._lamps import SampledLight
from firstorder.imaging._reflection import mirrored
from firstorder.numerics._vectors import dot
from firstorder.typing import Scalar

Direction = Float[Array, "3"]
Moved = Float[Array, "3 2"]
Factors = Float[Array, "2"]
Seen = Shares | Bool[Array, " k"]


class ShadingPoint(Module):
    """All of a pixel's surface point on which its light depends.

    Attributes:
        position: where [m].
        base_normal: of the surface; what is below it is hidden by it.
        normal: of the shading.
        mirror: the mirrored direction to the eye.
        exponent: s.
    """

    position: Direction
    base_normal: Direction
    normal: Direction
    mirror: Direction
    exponent: Scalar


class PointMotion(Module):
    """How a pixel's surface point moves with px and py, in the last axis.

    Attributes:
        position: dx [m per unit of the image].
        normal: dn of the shading normal, bumps included.
        mirror: dr of the mirrored direction.
        diffuse: of `albedo / pi`, where that is a texture.
    """

    position: Moved
    normal: Moved
    mirror: Moved
    diffuse: Float[Array, "2"]


def shading_point(at: SurfaceInteraction) -> tuple[ShadingPoint, Factors]:
    """The surface point as light needs it, and the factors D and G of its lobes."""
    n, lobe = at.point.normal, at.lobe
    r = mirrored(at.view.to_eye, n)
    point = ShadingPoint(at.point.position, at.point.base_normal, n, r, lobe.exponent)
    return point, jnp.stack(jnp.broadcast_arrays(*lobe_factors(lobe)))


def point_motion(at: SurfaceInteraction) -> PointMotion:
    """How that moves with the pixel: along the surface by the footprint, and with the eye."""
    point, n, v = at.point, at.point.normal, at.view.to_eye
    step = at.view.surface_D_p(point)
    x, dn, dv = point.tangents @ step, point.turning @ step, at.view.to_eye_D_p
    dr = 2.0 * (n[:, None] * (v @ dn + n @ dv) + dot(n, v) * dn) - dv
    return PointMotion(x, dn, dr, at.lobe.slope @ x / jnp.pi)


class _Nodes(NamedTuple):
    """Nodes of a light as a point sees them; those that send nothing have no weight.

    Attributes:
        anchor: position of each node, or the way to it if it is distant.
        area: area vectors.
        inverse: `1 / |d|^2`.
        height: n.d.
        facing: -a.d.
        across: r.d, 1 where it is not positive.
        weight: W.
        lobe: m.
    """

    anchor: Float[Array, "k 3"]
    area: Float[Array, "k 3"]
    inverse: Shares
    height: Shares
    facing: Shares
    across: Shares
    weight: Shares
    lobe: Shares


def _nodes(light: SampledLight, seen: Seen, point: ShadingPoint, some=slice(None)) -> _Nodes:
    """The nodes, or some of them; a component at a time, so that sums over them run in lanes."""
    x = point.position
    anchor, area = (a[some] for a in light.toward(jnp.zeros_like(x)))
    d = [anchor[:, i] - x[i] if light.near else anchor[:, i] for i in range(3)]

    def along(n):
        return d[0] * n[0] + d[1] * n[1] + d[2] * n[2]

    squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    height, across = along(point.normal), along(point.mirror)
    facing = -(area[:, 0] * d[0] + area[:, 1] * d[1] + area[:, 2] * d[2])
    lit = (height > 0.0) & (facing > 0.0) & (squared > 0.0) & (along(point.base_normal) > 0.0)
    inverse = 1.0 / jnp.where(squared > 0.0, squared, 1.0)
    radiance = light.radiance[some] if jnp.ndim(light.radiance) else light.radiance
    weight = jnp.where(lit, seen * radiance * facing * inverse * inverse, 0.0)
    ahead = across > 0.0
    across = jnp.where(ahead, across, 1.0)
    lobe = jnp.exp(0.5 * point.exponent * jnp.log(across * across * inverse))
    facing = jnp.where(lit, facing, 1.0)
    return _Nodes(
        anchor, area, inverse, height, facing, across, weight, jnp.where(ahead, lobe, 0.0)
    )


def radiance(light: SampledLight, seen: Seen, point: ShadingPoint, factors: Factors) -> Scalar:
    """Light that a point sends to the eye, from one lamp.

    Args:
        light: its nodes.
        seen: whether each is seen from the point, or the share of it that is; those below its
            surface are not, whatever is given.
        point: where.
        factors: D and G.
    """
    at = _nodes(light, seen, point)
    each = at.weight * at.height * (factors[0] + factors[1] * at.lobe)
    return each @ jnp.ones_like(each)


def radiance_gradient(
    light: SampledLight,
    seen: Seen,
    point: ShadingPoint,
    factors: Factors,
    motion: PointMotion,
) -> tuple[Scalar, Float[Array, "2"]]:
    """Light that a point sends to the eye, and its gradient along px and py; shadows stand still.

    Args:
        light: as in `radiance`.
        seen: as in `radiance`.
        point: where.
        factors: D and G.
        motion: how the point moves.

    Reference: R07 §5.1-5.3, eqs. 25-27, in space, for near light; terms not told apart.
    """
    at, n, r, x = _nodes(light, seen, point), point.normal, point.mirror, point.position
    diffuse, gloss = factors[0], factors[1] * at.lobe
    plain = at.weight * at.height
    U = at.weight * (diffuse + gloss)
    R = point.exponent * plain * gloss / at.across
    ones = jnp.ones_like(plain)
    basis = jnp.concatenate([at.anchor, ones[:, None]], 1)
    each = U * at.height
    from_n, from_r = U @ basis, R @ basis
    if light.near:
        X = plain * at.inverse * (4.0 * diffuse + (4.0 + point.exponent) * gloss)
        from_x = X @ basis
        still = from_x[:3] - from_x[3] * x - from_n[3] * n - from_r[3] * r
        still = (still + (each / at.facing) @ at.area) @ motion.position
        from_n, from_r = (a[:3] - a[3] * x for a in (from_n, from_r))
    else:
        still, from_n, from_r = jnp.zeros(2, x.dtype), from_n[:3], from_r[:3]
    gradient = still + from_n @ motion.normal + from_r @ motion.mirror
    return each @ ones, gradient + (plain @ ones) * motion.diffuse


def edge_radiance(
    light: SampledLight,
    nodes: tuple[Int[Array, ""], Int[Array, ""]],
    axis: Int[Array, ""],
    point: ShadingPoint,
    moved: Moved,
) -> Float[Array, "2 2"]:
    """Light that a shadow's edge between two neighbouring nodes uncovers as the pixel moves.

    The mean over both nodes of what they send times the rate at which half-way shadows slide over
    them; times the jump of visibility and the blocker's `(1 - tau) / tau` it is one summand of
    `_area_lights.shadow_edge_terms`.

    Args:
        light: `even`.
        nodes: numbers of the two.
        axis: along which they are neighbours: 0 for rows, 1 for columns.
        point: where.
        moved: how it moves with px and py.

    Returns:
        For unit factors of the diffuse and of the glossy lobe, along px and py.
    """
    before, after = (_slid(light, node, axis, point, moved) for node in nodes)
    return 0.5 * (before + after)


def _slid(light, node, axis, point: ShadingPoint, moved: Moved) -> Float[Array, "2 2"]:
    """Light of one node by each lobe, times how half-way shadows slide over it."""
    at = _nodes(light, jnp.ones(1, moved.dtype), point, node[None])
    slide = light.slide(point.position, node[None])[0, axis] @ moved
    sent = (at.weight * at.height)[0]
    return jnp.stack([sent, sent * at.lobe[0]])[:, None] * slide
