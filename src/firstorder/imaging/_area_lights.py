r"""Shading by area lights, node by node, on curved, bumpy, glossy surfaces, with all gradients.

An area light is a sum over nodes of its surface. At a point with normal n, seen from a direction
that is mirrored to r, a node at d from the point, of area vector a and radiance L, gives

    diffuse   albedo / pi                f_0
    glossy    specular (s + 2) / (2 pi)  f_s        f_s = L (n.d) (r.d)^s (-a.d) / |d|^(4 + s)

with all three factors cut off at zero, times whether the node is seen. With g = L (..) for short,

    df_s/dx at fixed n and r = -f_s (n/(n.d) + s r/(r.d) + a/(a.d) - (4 + s) d/|d|^2)
    df_s/dn = f_s d/(n.d),    df_s/dr = s f_s d/(r.d)

R07 tells these apart: SV is the first; the others turn with the surface. A turn of the surface's
frame by a vector omega turns n by omega and r by 2 omega, so

    dB = SV . dx + DV . CV dx,      CV = k (n x dn/dx)
    DV = n x df/dn                  k = 1   (diffuse: follows the normal)
    DV = n x df/dn / 2 + r x df/dr  k = 2   (glossy: follows the mirror)

Cosines that are cut off are continuous, so that nothing is missed where a light sets; shadow edges
are the business of `shadow_edge_terms`.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_not_negative
from firstorder._display import Module
from firstorder.imaging._lamps import Direction, SampledLight
from firstorder.imaging._reflection import SurfacePoint, half_turn, mirrored
from firstorder.imaging.camera import PixelFootprint
from firstorder.numerics._vectors import cross, dot
from firstorder.typing import Scalar, as_float

Shares = Float[Array, " k"]


class SurfaceReflectance(Module):
    """Reflectance of a surface: a diffuse share, and a lobe about the mirrored direction.

    Attributes:
        albedo: reflected diffusely.
        specular: reflected about the mirrored direction, at normal incidence.
        exponent: s, of the cosine to the mirrored direction; not negative.
        slope: gradient in space of the albedo, where that is a texture [1/m].

    Raises:
        ValueError: if a share, the exponent or the slope is not finite, or the exponent negative.

    Example:
        >>> from firstorder.imaging import SurfaceReflectance
        >>> SurfaceReflectance(0.5, specular=0.25, exponent=20.0).albedo.item()
        0.5
    """

    albedo: Scalar = eqx.field(converter=as_float)
    specular: Scalar = eqx.field(converter=as_float, default=0.0)
    exponent: Scalar = eqx.field(converter=as_float, default=1.0)
    slope: Direction = eqx.field(converter=as_float, default=(0.0, 0.0, 0.0))

    def __check_init__(self):
        """Refuse a lobe without a height or a width."""
        for name in ("albedo", "specular", "slope"):
            check_finite(name, getattr(self, name))
        check_not_negative("exponent", self.exponent)


class LobeRadiance(Module):
    """Light that one lobe sends to the eye, and its gradient, term by term.

    Attributes:
        value: B [W/(m^2 sr)].
        SV: spatial variation of the light along t and b [per m].
        DV: directional variation: what a turn of the lobe about each axis of the world changes.
        CV: curvature: how the lobe turns along t and b, a vector each [1/m].
        angular: gradient in the direction to the eye, tangent there.
        TV: what the texture varies along t and b: `E rho_x` of R07 (20) [per m].
    """

    value: Scalar
    SV: Float[Array, "2"]
    DV: Direction
    CV: Float[Array, "3 2"]
    angular: Direction
    TV: Float[Array, "2"]

    @property
    def CDV(self) -> Float[Array, "2"]:
        """Curvature-weighted directional variation along t and b [per m]."""
        return self.DV @ self.CV

    @property
    def spatial(self) -> Float[Array, "2"]:
        """`B_t, B_b` with the eye's direction held fixed [per m]."""
        return self.SV + self.CDV + self.TV

    def image_gradient(self, view: PixelFootprint, point: SurfacePoint) -> Float[Array, "2"]:
        """Derivatives in px and py, as `imaging.camera.image_gradient` has them (R07 eq. 26)."""
        return self.spatial @ view.surface_D_p(point) + self.angular @ view.to_eye_D_p


def lobe_radiance(
    lamp: SampledLight,
    seen: Shares,
    point: SurfacePoint,
    to_eye: Direction,
    lobe: SurfaceReflectance,
) -> tuple[LobeRadiance, LobeRadiance]:
    """Radiance reflected to the eye from one light, by the diffuse and by the glossy lobe.

    Valid when: nodes are dense on the scale of the distance to the lamp and of the lobe. Shadows
    only scale what nodes send; that they move is left out, as R07 §9 has it (`shadow_edge_terms`).

    Args:
        lamp: the light, near (`Lamp`) or distant, which has no SV (`imaging.sky_lights`).
        seen: whether each node is seen from the point, or the share of it that is.
        point: where, with the turning of its normal.
        to_eye: unit vector to where the light goes.
        lobe: of the surface.

    Reference: R07 §5.1-5.2, eq. 25, in space and for near light; §9.1 for shadows.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import Lamp, SurfaceReflectance, surface_point
        >>> from firstorder.imaging._area_lights import lobe_radiance
        >>> floor = surface_point(jnp.zeros(3), jnp.eye(3), jnp.zeros((2, 2)))
        >>> lamp = Lamp((3, 0, 3), (0, 1, 0), (1, 0, 0))
        >>> up = jnp.array([0.0, 0.0, 1.0])
        >>> diffuse, gloss = lobe_radiance(lamp, jnp.ones(64), floor, up, SurfaceReflectance(1.0))
        >>> bool(diffuse.SV[0] > 0), diffuse.CDV.tolist(), gloss.value.item()  # brighter that way
        (True, [0.0, 0.0], 0.0)
    """
    n, r = point.normal, mirrored(to_eye, point.normal)
    f, f_x, f_n, _ = _summed(_sent(lamp, point.position, n, r, None), seen)
    g, g_x, g_n, g_r = _summed(_sent(lamp, point.position, n, r, lobe.exponent), seen)
    spread, polished = lobe_factors(lobe)
    T, zero = point.tangents, jnp.zeros(3, f.dtype)
    grain = f / jnp.pi * lobe.slope @ T
    diffuse = LobeRadiance(
        spread * f, spread * f_x @ T, spread * cross(n, f_n), point.spin, zero, grain
    )
    turned = 0.5 * cross(n, g_n) + cross(r, g_r)
    angular = polished * g_r @ half_turn(n)
    SV, DV, none = polished * g_x @ T, polished * turned, jnp.zeros_like(grain)
    glossy = LobeRadiance(polished * g, SV, DV, 2.0 * point.spin, angular, none)
    return diffuse, glossy


def shadow_edge_terms(
    lamp: SampledLight,
    seen: Shares,
    depth: Shares,
    point: SurfacePoint,
    to_eye: Direction,
    lobe: SurfaceReflectance,
) -> tuple[Float[Array, "2"], Float[Array, "2"]]:
    """Contribution of shadow edges that move over the lamp to SV, from shadow rays already traced.

    Where of two neighbouring nodes one is seen, an edge crosses the lattice. A blocker at the share
    tau of the way moves its edge over the lamp by `-(1 - tau)/tau (I - d m^T/(m.d)) dx`, with m the
    lamp's normal, so

        dB/dx = integral of F (1 - tau)/tau (I - d m^T/(m.d))^T grad V dA

    and grad V is the difference between neighbours. Diffuse and glossy lobe apart. In front of
    distant light edges turn by `-(I - w w^T) dx / D`: 1/D of a blocker at the distance D stands in
    the place of `(1 - tau)/tau`.

    Valid as the lattice grows finer: an edge is known to half a cell, and beside an occluding
    contour the depth changes as the root of the distance, so it is continued to the edge from two
    hidden nodes. Exact gradients of analytic shapes: `space.irradiance`.

    Args:
        lamp: the light; `even`.
        seen: 1 for nodes that are seen, 0 for others.
        depth: where something hides the node: the share of the way to it, in (0, 1), or of distant
            light the distance [m]; 0 where nothing does.
        point: where.
        to_eye: unit vector to where the light goes.
        lobe: of the surface.

    Returns:
        Along t and b, for the two lobes [W/(m^2 sr) per m].

    Raises:
        ValueError: if the lamp's nodes are not even.

    Reference: R07 §8.1 (image space), with the lamp's plane in place of angles.
    """
    if not lamp.even:
        raise ValueError("Argument `lamp` must have even nodes for moving shadows, but has not.")
    slide = lamp.slide(point.position)
    n, r = point.normal, mirrored(to_eye, point.normal)
    found = []
    for scale, exponent in zip(lobe_factors(lobe), (None, lobe.exponent), strict=True):
        f = _sent(lamp, point.position, n, r, exponent).f
        moved = _jumps(lamp, f[:, None, None] * slide, depth, seen)
        found.append(scale * moved @ point.tangents)
    return found[0], found[1]


def _jumps(
    lamp: SampledLight, flow: Float[Array, "k 2 3"], depth: Shares, seen: Shares
) -> Direction:
    """Sum over pairs of neighbours of which one is seen: the flow between them times the jump."""
    flow, seen = flow.reshape(*lamp.shape, 2, 3), seen.reshape(lamp.shape)
    depth = depth.reshape(lamp.shape)
    total = jnp.zeros(3, flow.dtype)
    for axis in (0, 1):
        F, V, D = (jnp.moveaxis(a, axis, 0) for a in (flow[:, :, axis], seen, depth))
        round_ = axis == 1 and lamp.wraps
        after = (lambda a: jnp.roll(a, -1, 0)) if round_ else (lambda a: a[1:])
        here = (lambda a: a) if round_ else (lambda a: a[:-1])
        jump = after(V) - here(V)
        edges = (_at_edge(D, V, side, round_) for side in (-1, 1))
        edge = jnp.where(jump < 0.0, after(next(edges)), here(next(edges)))
        weight = 0.5 * jump * edge_rate(edge, lamp.near)
        total = total + jnp.sum(weight[..., None] * (after(F) + here(F)), (0, 1))
    return total


# A contour s cells away is first met at D_0 - c sqrt(s). With s anywhere in (0, 1) at the last
# hidden node and in (1, 2) at the one before, this share of their difference makes up for it on
# average.
TO_LIMB = 1.0 / (2.0 * float(np.sqrt(2.0)) - 2.0)


def _at_edge(
    depth: Float[Array, "r c"], V: Float[Array, "r c"], side: int, round_: bool
) -> Float[Array, "r c"]:
    """Depth of a blocker at its edge, from the last hidden node and the one before it."""
    before, hidden = jnp.roll(depth, side, 0), jnp.roll(V, side, 0) == 0.0
    first = jnp.arange(depth.shape[0])[:, None] == (0 if side == 1 else depth.shape[0] - 1)
    first &= not round_
    return at_limb(depth, before, hidden & ~first)


def at_limb(depth: Any, before: Any, hidden: Any) -> Any:
    """Depth of a blocker at its edge, from those of the last hidden node and of the one before.

    Args:
        depth: where the last hidden node is hidden, in any unit.
        before: of the node before it.
        hidden: whether there is one, and it is hidden. Arrays of NumPy or of JAX.
    """
    change = TO_LIMB * (depth - before) * hidden
    return depth + change * (abs(change) < 0.25 * depth)  # another blocker, if more


def edge_rate(depth: Any, near: bool) -> Any:
    """How fast an edge moves over a light when the point does: `(1 - tau) / tau`, or `1 / D`.

    Args:
        depth: of the blocker at its edge, as `shadow_edge_terms` has it: arrays of NumPy or of JAX.
            Neither what is behind a lamp moves an edge, nor a depth of 0.
        near: whether the light is; then depth is a share.
    """
    rate = (depth > 0.0) / (depth + (depth <= 0.0)) - near
    return rate * (rate > 0.0)


# --- nodes ---------------------------------------------------------------------------------------


class _Sent(Module):
    """Contributions of the nodes without blockers, and those over each of their factors."""

    d: Float[Array, "k 3"]
    area: Float[Array, "k 3"]
    axes: Float[Array, "2 3"]
    s: Scalar
    inverse: Shares
    f: Shares
    by_n: Shares
    by_r: Shares
    by_a: Shares
    near: bool = eqx.field(static=True)


def _sent(lamp: SampledLight, x: Direction, n: Direction, r: Direction, exponent) -> _Sent:
    d, area = lamp.toward(x)
    squared = dot(d, d)
    inverse = 1.0 / jnp.where(squared > 0.0, squared, 1.0)
    height, facing, across = d @ n, -dot(area, d), d @ r
    lit_up = (height > 0.0) & (facing > 0.0) & (squared > 0.0)
    s = jnp.zeros((), d.dtype) if exponent is None else exponent
    if exponent is not None:
        lit_up &= across > 0.0
    height, facing, across = (jnp.where(lit_up, a, 1.0) for a in (height, facing, across))
    short = jnp.sqrt(inverse)
    lobe = 1.0 if exponent is None else (across * short) ** s
    # Cosine times solid angle: the fourth power of a length would leave the range of float32.
    f = lamp.radiance * (height * short) * (facing * short * inverse) * lobe
    f = jnp.where(lit_up, f, 0.0)
    over = f / height, s * f / across, f / facing
    return _Sent(d, area, jnp.stack([n, r]), s, inverse, f, *over, lamp.near)


def _summed(sent: _Sent, seen: Shares) -> tuple[Scalar, Direction, Direction, Direction]:
    """The sum of f, and its gradients in x, n and r."""
    by_n, by_r, by_a, f = (seen * a for a in (sent.by_n, sent.by_r, sent.by_a, sent.f))
    n, r = sent.axes
    f_n, f_r = by_n @ sent.d, by_r @ sent.d
    if not sent.near:
        return jnp.sum(f), jnp.zeros_like(n), f_n, f_r
    f_x = by_a @ sent.area - jnp.sum(by_n) * n - jnp.sum(by_r) * r
    return jnp.sum(f), f_x + ((4.0 + sent.s) * f * sent.inverse) @ sent.d, f_n, f_r


def lobe_factors(lobe: SurfaceReflectance) -> tuple[Scalar, Scalar]:
    """Factors `albedo / pi` and `specular (s + 2) / (2 pi)` of the sums of the two lobes."""
    return lobe.albedo / jnp.pi, lobe.specular * (lobe.exponent + 2.0) / (2.0 * jnp.pi)
