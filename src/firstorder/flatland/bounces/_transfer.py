"""Irradiance from panels of known radiance, with exact visibility and exact derivatives.

Whole panels that are seen count by their own rule, panels of which a part is seen by interpolation
on that part. The constant part of the light on each is integrated in closed form (differences of
sines), so a closed room of one radiance is exact, however close the receiver.

Under automatic differentiation nodes stay where they are and the ends of what is seen move:
`E = sum + sum over ends of (d f + d^2 f_s / 2)`, d being how far an end has moved. That is exact
for value, first and second derivative, and costs no more than the kernel's own derivatives.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland.bounces._panels import Panels, legendre, resolution, to_legendre
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver, _in_own_unit, view
from firstorder.numerics._planar import dot_2d
from firstorder.numerics._quadrature import gauss_legendre


def panel_irradiance(
    scene: Scene, panels: Panels, L: Float[Array, "p k"], at: Receiver, moving: bool = True
) -> Float[Array, ""]:
    """Irradiance that radiance on panels gives a receiver [W/m].

    Args:
        scene: the shapes.
        panels: on them; sides without panels are black.
        L: radiance at the nodes [W/(m rad)].
        at: one receiver.
        moving: whether derivatives by the receiver are asked for.
    """
    scene, at, _ = _in_own_unit(scene, at)
    scene, here = jax.lax.stop_gradient((scene, at))
    gaps = _gaps(scene, panels, at if moving else here, moving)
    whole = _whole(panels, gaps)
    s, w = panels.rule()
    E = jnp.sum(_panel_light(scene, panels, at, s, w, L, whole))
    E = E + _parts(scene, panels, at, gaps, L)
    return E + _ends(scene, panels, at, here, gaps, L) if moving else E


class _Gaps(Module):
    """Visible pieces of surfaces: one piece of one sheet (shape and side) in each gap.

    Attributes:
        shape, sheet: number of the shape; twice that plus the side.
        span: first and last parameter that are seen, without derivative; snapped to ends of panels.
        moved: zero, with the derivatives of `span`.
        valid: whether a piece is there and has panels.
        panel: the panels that hold its ends.
    """

    shape: Int[Array, " g"]
    sheet: Int[Array, " g"]
    span: Float[Array, "g 2"]
    moved: Float[Array, "g 2"]
    valid: Bool[Array, " g"]
    panel: Int[Array, "g 2"]


def _gaps(scene: Scene, panels: Panels, at: Receiver, moving: bool) -> _Gaps:
    """The piece of a surface that a receiver sees in each gap, with the panels of its ends."""
    fixed = jax.lax.stop_gradient(at)
    seen = view(scene, at, cuts=_seams(scene))
    ends = jax.lax.stop_gradient(seen.angles)
    width = ends[1:] - ends[:-1]
    shape = jnp.maximum(seen.seen, 0)
    near, far, grazing = _insets(ends, shape == fixed.on)
    span, front, met, close = jax.vmap(_span, (None, None, 0, 0, 0, 0, 0))(
        scene, fixed, shape, ends[:-1], ends[1:], near, far
    )
    sheet = 2 * shape + jnp.where(front, 0, 1)
    span, panel, held = _on_panels(panels, sheet, span)
    wide = (width > 256.0 * jnp.finfo(width.dtype).eps) & (span[:, 1] > span[:, 0]) & ~grazing
    valid = (seen.seen >= 0) & met & held & wide
    if not moving:
        return _Gaps(shape, sheet, span, jnp.zeros_like(span), valid, panel)
    inset = jnp.where(close, near, far[:, None])
    low, high = seen.angles[:-1] + inset[:, 0], seen.angles[1:] - inset[:, 1]
    angles = jnp.stack([jnp.where(front, low, high), jnp.where(front, high, low)], -1)
    both = jax.vmap(_moved, (None, None, 0, 0, None, None, None))
    moved = jax.vmap(both, (None, 0, 0, 0, None, None, 0))(
        scene, shape, span, angles, at, fixed, valid
    )
    return _Gaps(shape, sheet, span, moved, valid, panel)


def _seams(scene: Scene) -> Float[Array, "c 2"] | None:
    """Where the parameters of closed shapes start again: there they are cut."""
    start = jax.vmap(lambda shape: shape.motion(jnp.zeros(()))[0])
    starts = [start(group) for group in scene.groups if group.closed]
    return jnp.concatenate(starts) if starts else None


def _insets(ends: Float[Array, " g_1"], own: Bool[Array, " g"]):
    """How far inside a gap its shape is looked for, at both ends; and further, if it is missed.

    Args:
        ends: angles between the gaps.
        own: whether a gap shows the shape on which the receiver lies.

    Returns:
        Angles, shape (g, 2); likewise (g,); and which gaps are grazing. These show the receiver's
        own shape so near to the horizon that it sends nothing, but its sines would be any.
    """
    eps, width = jnp.finfo(ends.dtype).eps, ends[1:] - ends[:-1]
    # On the very end of a gap a ray may miss the shape.
    near = jnp.maximum(512.0 * eps * width, 64.0 * eps)
    # Beside a corner, or along the receiver's own hollow shape, rounding reaches further.
    reach = 8.0 * eps**0.5
    far = jnp.minimum(reach, 0.25 * width)
    level = jnp.cos(ends) < reach
    near = jnp.where(own & jnp.stack([level[:-1], level[1:]]), far, near).T
    return near, far, own & (jnp.cos(0.5 * (ends[1:] + ends[:-1])) < reach)


def _span(scene: Scene, at: Receiver, i, a, b, near, far):
    """The piece of a shape in a gap, without derivatives.

    Args:
        scene: the shapes.
        at: the receiver.
        i: number of the shape.
        a: angle at which the gap starts.
        b: angle at which it ends.
        near: how far inside both are looked at, as `_insets` has it.
        far: and how far if nothing is met there.

    Returns:
        First and last parameter; whether the piece is seen from the front; whether it was met; and
        whether it was met at the first try, at both ends.
    """
    m = 0.5 * (a + b)
    angles = jnp.stack([m, a + near[0], b - near[1], a + far, b - far])
    t, s = jax.vmap(lambda angle: scene.hit(i, at.position, direction(at.n + angle), at.on))(angles)
    met = jnp.isfinite(t)
    sm, sa, sb = s[0], *jnp.where(met[1:3], s[1:3], s[3:])
    front = jnp.sum(scene.frame(i, sm).normal * direction(at.n + m)) < 0.0
    # Seen from the front the parameter grows with the angle. Closed shapes go on past 1.
    sa, sb = jnp.where(front, sa, sb), jnp.where(front, sb, sa)
    span = jnp.stack([sm - jnp.mod(sm - sa, 1.0), sm + jnp.mod(sb - sm, 1.0)])
    return span, front, met[0] & jnp.all(met[1:3] | met[3:]), met[1:3]


def _on_panels(panels: Panels, sheet: Int[Array, " g"], span: Float[Array, "g 2"]):
    """Pieces snapped to the ends of panels, the panels that hold their ends, and whether any do."""
    tolerance, span = resolution(span.dtype), jnp.clip(span, 0.0, 1.0)
    (k0, here0), (k1, here1) = (
        panels.holding(sheet, jnp.clip(s, 0.0, 1.0))
        for s in (span[:, 0] + tolerance, span[:, 1] - tolerance)
    )
    end = jnp.stack([panels.ends[k0, 0], panels.ends[k1, 1]], -1)
    span = jnp.where(jnp.abs(span - end) < tolerance, end, span)
    return span, jnp.stack([k0, k1], -1), here0 & here1


def _moved(scene: Scene, i, s, angle, at: Receiver, fixed: Receiver, valid):
    """Zero, with the derivatives of a piece's end: behind an edge, or at a point of tangency."""
    frame = scene.frame(i, s)
    u = direction(fixed.n + jax.lax.stop_gradient(angle))
    limb = jnp.abs(jnp.sum(frame.normal * u)) < 1e3 * jnp.finfo(s.dtype).eps ** 0.5
    # Behind an edge: the point of the shape in the direction of that edge.
    ray = direction(at.n + angle)
    _, met = scene.hit(
        i, jnp.where(limb, fixed.position, at.position), jnp.where(limb, u, ray), fixed.on
    )
    # A point of tangency: normal.(c - x) = 0, to first order, since the light vanishes there.
    slope = -frame.kappa * frame.speed * jnp.sum(frame.tangent * (frame.position - fixed.position))
    height = jnp.sum(frame.normal * (frame.position - at.position))
    height = height - jax.lax.stop_gradient(height)
    at_limb = jnp.where(slope == 0.0, 0.0, -height / jnp.where(slope == 0.0, 1.0, slope))
    moved = jnp.where(limb, at_limb, met - jax.lax.stop_gradient(met))
    return jnp.where(valid, moved, 0.0)


def _whole(panels: Panels, gaps: _Gaps) -> Bool[Array, " p"]:
    """Mask of the panels that are seen from end to end within one gap."""
    sheet = 2 * panels.shape + panels.side
    inside = (
        gaps.valid[:, None]
        & (gaps.sheet[:, None] == sheet)
        & (gaps.span[:, :1] <= panels.ends[:, 0])
        & (panels.ends[:, 1] <= gaps.span[:, 1:])
    )
    return jnp.any(inside, axis=0)


def _kernel(at: Receiver, place, normal):
    """`cos_x cos_y / r`, signed; 0 where the two points coincide."""
    way = place - at.position
    square = dot_2d(way, way)
    apart = square > 0.0
    r2 = jnp.where(apart, square, 1.0)
    a, b = dot_2d(at.normal, way), -dot_2d(normal, way)
    return jnp.where(apart, a * b / (r2 * jnp.sqrt(r2)), 0.0)


def _sine(at: Receiver, place):
    """Sine of the local angle of a point."""
    way = place - at.position
    square = dot_2d(way, way)
    apart = square > 0.0
    root = jnp.sqrt(jnp.where(apart, square, 1.0))
    return jnp.where(apart, -dot_2d(at.tangent, way) / root, 0.0)


def _turned(scene: Scene, shape, side, s):
    """Points of sides of shapes, their normals and speeds."""
    frame = jax.vmap(lambda i, row: jax.vmap(lambda t: scene.frame(i, t))(row))(shape, s)
    sign = jnp.where(side == 0, 1.0, -1.0)
    return frame.position, sign[:, None, None] * frame.normal, frame.speed, sign


def _panel_light(scene, panels: Panels, at: Receiver, s, w, L, whole):
    """Irradiance from whole panels; the mean of L by differences of sines, the rest by the rule."""
    place, normal, speed, sign = _turned(scene, panels.shape, panels.side, s)
    ends, *_ = _turned(scene, panels.shape, panels.side, panels.ends)
    return jnp.where(whole, _piece(at, place, normal, speed * w, ends, sign, L), 0.0)


def _piece(at, place, normal, weight, ends, sign, L):
    """Light from pieces with nodes along the last axis, exact for a constant."""
    mean = jnp.mean(L, axis=-1, keepdims=True)
    sines = _sine(at, ends)
    exact = sign * (sines[..., 1] - sines[..., 0])
    return mean[..., 0] * exact + jnp.sum(weight * (L - mean) * _kernel(at, place, normal), -1)


def _parts(scene, panels: Panels, at: Receiver, gaps: _Gaps, L):
    """Irradiance from panels of which a gap shows a part: its first and last one at most."""
    t, w = (jnp.asarray(a, L.dtype) for a in gauss_legendre(panels.count))
    first, last = gaps.panel[:, 0], gaps.panel[:, 1]
    low, high = gaps.span[:, 0], gaps.span[:, 1]
    one = first == last
    a = jnp.stack([low, jnp.where(one, high, panels.ends[last, 0])], -1).ravel()
    b = jnp.stack([jnp.where(one, high, panels.ends[first, 1]), high], -1).ravel()
    k = jnp.stack([first, last], -1).ravel()
    full = (a <= panels.ends[k, 0]) & (b >= panels.ends[k, 1])
    use = jnp.repeat(gaps.valid, 2) & (b > a) & ~full
    half = 0.5 * (b - a)[:, None]
    s = 0.5 * (a + b)[:, None] + half * t
    place, normal, speed, sign = _turned(scene, panels.shape[k], panels.side[k], s)
    ends, *_ = _turned(scene, panels.shape[k], panels.side[k], jnp.stack([a, b], -1))
    values = _interpolated(panels, k, s, L)
    light = _piece(at, place, normal, speed * half * w, ends, sign, values)
    return jnp.sum(jnp.where(use, light, 0.0))


def _interpolated(panels: Panels, k, s, L):
    """L at parameters s (g, n) of panels k (g)."""
    a, b = panels.ends[k, 0][:, None], panels.ends[k, 1][:, None]
    value, _ = legendre(panels.count, 2.0 * (s - a) / (b - a) - 1.0)
    coefficients = L[k] @ jnp.asarray(to_legendre(panels.count), L.dtype).T
    return jnp.einsum("gnc,gc->gn", value, coefficients)


def _ends(scene, panels: Panels, at: Receiver, here: Receiver, gaps: _Gaps, L):
    """Contribution of the moving ends: zero, with the right first and second derivatives."""

    def end(i, k, s, moved):
        def f(s, eye):
            frame = scene.frame(i, s)
            sign = jnp.where(panels.side[k] == 0, 1.0, -1.0)
            light = jnp.sum(panels.basis(k, jax.lax.stop_gradient(s))[0] * L[k])
            slope = jnp.sum(panels.basis(k, jax.lax.stop_gradient(s))[1] * L[k])
            light = light + slope * (s - jax.lax.stop_gradient(s))
            return light * frame.speed * _kernel(eye, frame.position, sign * frame.normal)

        _, slope = jax.jvp(lambda s: f(s, here), (s,), (jnp.ones_like(s),))
        return moved * f(s, at) + 0.5 * moved**2 * slope

    both = jax.vmap(jax.vmap(end, (None, 0, 0, 0)))(gaps.shape, gaps.panel, gaps.span, gaps.moved)
    return jnp.sum(jnp.where(gaps.valid, both[:, 1] - both[:, 0], 0.0))
