"""The silhouettes of a scene as edges of its light field: levels, and the jumps across them.

All levels are positive on the counter-clockwise side. With the centre, or the point, at the place a
along the line and the height h above it, and `U = (a - x) cos(theta) + h sin(theta)` its distance
to the right of the ray:

    a point (end, crossing)    U = 0; in slopes `a - x + h v = 0`, a straight edge
    a circle                   U = +-radius, where it lies ahead of the eye
    an ellipse, an arc         likewise, in the frame in which it is part of the unit circle
    a curve                    theta - theta_k(x), the angle of its k-th silhouette

A level knows nothing of what hides it: the jump does, and is zero there.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder.conventions import Frame
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.flatland.light_fields.field import LightField, facing
from firstorder.flatland.shapes.kinds import (
    Arcs,
    Circles,
    Curves,
    Ellipses,
    Point,
    Segments,
    Shape,
)
from firstorder.flatland.visible import Receiver
from firstorder.numerics._planar import cross_2d, dot_2d, left
from firstorder.typing import Ray, Scalar, as_float

LIMB_STEP = 1e-3  # from how far outside a limb is looked at, as a share of its distance


def edges(light: LightField) -> tuple[Edge, ...]:
    """All edges of a light field, in the order of `Scene.silhouettes`, then the sky's breaks."""
    found, first, k = [], 0, 0
    scene, line = light.scene, light.line
    points, valid = scene.silhouettes(line.position, line.on)
    for group in scene.groups:
        for i in range(group.count):
            shape = jax.tree.map(lambda leaf, i=i: leaf[i], group)
            for limb, level in _levels(light, shape, line.on == first + i):
                if level is None:
                    level = point_level(light, points[k], valid[k])
                found.append(Edge(level, SilhouetteJump(light, k, first + i, limb)))
                k += 1
        first += group.count
    for j in range(scene.crossings.pairs.shape[0]):
        level = point_level(light, points[k + j], valid[k + j])
        found.append(Edge(level, SilhouetteJump(light, k + j, -1, False)))
    breaks = getattr(scene.environment, "breaks", None)
    breaks = jnp.zeros(0) if breaks is None else as_float(breaks)
    for j in range(breaks.shape[0]):
        found.append(Edge(_break_level(light, breaks[j]), BreakJump(light, j)))
    return tuple(found)


def _levels(light: LightField, shape: Shape, own: Bool[Array, ""]):
    """The silhouettes of one shape: whether each is a limb, and its level (None for a point's)."""
    if isinstance(shape, Segments):
        return [(False, None)] * 2
    if isinstance(shape, Curves):
        return [
            (True, CurveLevel(light.line, shape, own, jnp.array(j), light.frame))
            for j in range(shape.silhouette_count)
        ]
    sides = (1.0, -1.0)  # as `silhouettes` lists them
    limbs = [(True, limb_level(light, shape, own, side)) for side in sides]
    return [*limbs, (False, None), (False, None)] if isinstance(shape, Arcs) else limbs


# --- levels --------------------------------------------------------------------------------------


def point_level(light: LightField, point: Point, valid: Bool[Array, ""]) -> Field:
    """The rays through a point: straight in slopes. One that does not exist is never met."""
    line, sign = light.line, light.facing
    gap = point - line.position
    a, h = (jnp.where(valid, dot_2d(e, gap), 0.0) for e in (line.tangent, line.normal))
    one = jnp.where(valid, sign, 0.0)
    if not light.frame.uses_slopes:
        return PointLevel(one, sign * a, sign * h, jnp.where(valid, 0.0, 1.0), light.frame)
    offset = jnp.where(valid, sign * a, 1.0)
    return Affine(jnp.stack([-one, sign * h]), offset, light.frame)


class PointLevel(Field):
    """`(a - one x) cos(theta) + h sin(theta) + never`: the rays through a point, in angles.

    Attributes:
        one: +1, -1 for outgoing light, 0 for a point that does not exist.
        a: place along the line, times that [m].
        h: height above it, times that [m].
        never: 1 for a point that does not exist, else 0.
    """

    one: Scalar
    a: Scalar
    h: Scalar
    never: Scalar
    frame: Frame = eqx.field(static=True)

    def at(self, u: Ray) -> Scalar:
        """Distance of the point to the right of the ray."""
        return (self.a - self.one * u[0]) * jnp.cos(u[1]) + self.h * jnp.sin(u[1]) + self.never

    def jet(self, u: Ray) -> Jet:
        """Closed form."""
        c, s, gap = jnp.cos(u[1]), jnp.sin(u[1]), self.a - self.one * u[0]
        U = gap * c + self.h * s
        gradient = jnp.stack([-self.one * c, self.h * c - gap * s])
        mixed = self.one * s
        hessian = jnp.stack([jnp.stack([0.0 * U, mixed]), jnp.stack([mixed, -U])])
        return Jet(U + self.never, gradient, hessian, self.frame)


def limb_level(light: LightField, shape: Shape, own: Bool[Array, ""], side: float) -> Field:
    """The rays that touch a circle, an ellipse, or the circle of an arc, on one side."""
    if isinstance(shape, Ellipses):
        semi, tilt = shape.semi, shape.tilt
    else:
        assert isinstance(shape, (Circles, Arcs))
        semi, tilt = jnp.stack([shape.radius, shape.radius]), jnp.zeros_like(shape.radius)
    line, sign = light.line, light.facing
    gap = shape.center - line.position
    # In the line's axes, looking along the label; the ellipse's own axes lean by tilt - n.
    a, h, lean = sign * dot_2d(line.tangent, gap), sign * dot_2d(line.normal, gap), tilt - line.n
    return LimbLevel(a, h, semi, lean, jnp.asarray(side, gap.dtype), own, sign, light.frame)


class LimbLevel(Field):
    """`U - side |extent|`: how far a ray passes a round shape by, on one side of it.

    In the frame in which the shape is the unit circle, with w from the centre to the eye and d
    along the ray, `U = -w x d` and the extent is |d|. A ray that leads away from the shape would
    touch it behind the eye; there U keeps its largest size, so that the level has one zero.

    Attributes:
        a, h: centre, along the line and above it; both negative for outgoing light [m].
        semi: semi-axes [m].
        lean: angle of the first one from the line [rad].
        side: +1 for the counter-clockwise limb, -1 for the other.
        own: whether the line lies on the shape, which then has no limb.
        sign: -1 for outgoing light.
    """

    a: Scalar
    h: Scalar
    semi: Float[Array, "2"]
    lean: Scalar
    side: Scalar
    own: Bool[Array, ""]
    sign: float = eqx.field(static=True)
    frame: Frame = eqx.field(static=True)

    def _unit(self, x: Scalar, y: Scalar) -> tuple[Scalar, Scalar]:
        """A vector in the frame of the unit circle; by components, which are fewer operations."""
        c, s, (first, second) = jnp.cos(self.lean), jnp.sin(self.lean), jnp.unstack(self.semi)
        return (c * x + s * y) / first, (c * y - s * x) / second

    def at(self, u: Ray) -> Scalar:
        """How far the ray passes the limb by, on its counter-clockwise side [1/m].

        For a circle that is the distance in metres over the radius squared, and in slopes times
        `sqrt(1 + v^2)`. It is 1 where there is no limb.
        """
        x, v = jnp.unstack(u)
        along = (-v, jnp.ones_like(v)) if self.frame.uses_slopes else (-jnp.sin(v), jnp.cos(v))
        dx, dy = self._unit(*along)
        gap = self.a - self.sign * x
        px, py = self._unit(gap, self.h)
        U, ahead, size = px * dy - py * dx, px * dx + py * dy > 0.0, jnp.sqrt(dx * dx + dy * dy)
        square = px * px + py * py
        away = square > 1.0
        reach = jnp.sqrt(jnp.where(away, square, 1.0)) * size
        right = jnp.where(self.h >= 0.0, U, gap) >= 0.0
        U = jnp.where(ahead, U, jnp.where(right, reach, -reach))
        return jnp.where(away & ~self.own, U - self.side * size, 1.0)

    def jet(self, u: Ray) -> Jet:
        """By autodiff."""
        return autodiff_jet(self.at, u, self.frame)


class CurveLevel(Field):
    """`theta - theta_k(x)`, or the slopes of both, for the k-th tangent from the eye to a curve.

    Attributes:
        line: where x is measured.
        shape: one curve.
        own: whether the line lies on it.
        k: which tangent.
    """

    line: Receiver
    shape: Curves
    own: Bool[Array, ""]
    k: Int[Array, ""]
    frame: Frame = eqx.field(static=True)

    def at(self, u: Ray) -> Scalar:
        """Angle, or slope, past the silhouette; 1 if there is none."""
        eye = self.line.position + u[0] * self.line.tangent
        points, valid = self.shape.silhouettes(eye, self.own)
        point, valid = points[self.k], valid[self.k]
        theta = _seen_at(self.line, facing(self.frame), eye, point, valid)
        if not self.frame.uses_slopes:
            return jnp.where(valid, u[1] - theta, 1.0)
        valid = valid & (jnp.cos(theta) > 0.0)
        return jnp.where(valid, u[1] - jnp.tan(jnp.where(valid, theta, 0.0)), 1.0)

    def jet(self, u: Ray) -> Jet:
        """By autodiff of the polished root."""
        return autodiff_jet(self.at, u, self.frame)


def _near(t: Scalar, other: Scalar) -> Bool[Array, ""]:
    """Whether two hits of one shape, a hair apart in angle, are hits of the same part of it.

    On a limb they differ by the root of that hair, 1e-6; parts that hide each other by more.
    """
    t, other = jax.lax.stop_gradient((t, other))
    found = jnp.isfinite(t) & jnp.isfinite(other)
    gap = jnp.abs(jnp.where(found, t - other, jnp.inf))
    return gap < jnp.finfo(t.dtype).eps ** 0.1875 * jnp.where(found, t, 1.0)


def _seen_at(line: Receiver, sign: float, eye: Point, point: Point, valid) -> Scalar:
    """The label of the ray from a point to the eye, in (-pi, pi]; 0 for one that is not there."""
    w = jnp.where(valid, sign * (point - eye), line.normal)
    away = jnp.sum(jnp.abs(w)) != 0.0
    up, side = dot_2d(line.normal, w), cross_2d(line.normal, w)
    return jnp.arctan2(jnp.where(away, side, 1.0), jnp.where(away, up, 0.0))


def _break_level(light: LightField, angle: Scalar) -> Affine:
    """The rays from the direction in which the sky breaks: none of them depends on x."""
    theta = _sky_angle(light, angle)
    zero = jnp.zeros_like(theta)
    if light.frame.uses_slopes:
        return Affine(jnp.stack([zero, jnp.cos(theta)]), -jnp.sin(theta), light.frame)
    return Affine(jnp.stack([zero, zero + 1.0]), -theta, light.frame)


def _sky_angle(light: LightField, angle: Scalar) -> Scalar:
    """The label of rays from a world angle, in [-pi, pi) from the line's normal."""
    back = 0.0 if light.facing > 0 else jnp.pi
    return jnp.mod(angle - light.line.n - back + jnp.pi, 2.0 * jnp.pi) - jnp.pi


# --- jumps ---------------------------------------------------------------------------------------


class SilhouetteJump(Field):
    """Light on the counter-clockwise side of a silhouette, less that on the other.

    The shapes seen a hair to either side are found without derivatives, and asked what they send
    along the ray that grazes the silhouette of this x. Zero where both see the same place (a hidden
    silhouette), where there is none, and for rays that lead away from it.

    Attributes:
        light: the field.
        k: which of `Scene.silhouettes`.
        owner: number of the shape that ends here, -1 for a crossing.
        limb: whether it ends by turning away, so that a ray just inside meets it at no angle.
    """

    light: LightField
    k: Int[Array, ""] = eqx.field(converter=jnp.asarray)
    owner: Int[Array, ""] = eqx.field(converter=jnp.asarray)
    limb: bool = eqx.field(static=True)

    @property
    def frame(self) -> Frame:
        """Frame of the light."""
        return self.light.frame

    def at(self, u: Ray) -> Scalar:
        """The jump."""
        light, x = self.light, u[0]
        points, valid = light.scene.silhouettes(light.eye(x), light.line.on)
        point = points[self.k]
        theta = _seen_at(light.line, light.facing, light.eye(x), point, valid[self.k])
        numbers, angles = light.beside(x, theta)
        low, high = (light.met(k, x, angle) for k, angle in zip(numbers, angles, strict=True))
        sides = [
            self._side(number, hit, x, angle, theta, point, sign)
            for number, hit, angle, sign in zip(
                numbers, (low, high), angles, (-1.0, 1.0), strict=True
            )
        ]
        fronts = [
            light.front(jnp.maximum(number, 0), s, light.sight(angle))
            for number, (_, s), angle in zip(numbers, (low, high), angles, strict=True)
        ]
        near = _near(low[0], high[0]) & (fronts[0] == fronts[1])
        same = (numbers[0] == numbers[1]) & ((numbers[0] < 0) | near)
        there = valid[self.k] & (jnp.cos(light.angle(u) - theta) > 0.0)
        return jnp.where(there & ~same, sides[1] - sides[0], 0.0)

    def _side(self, number, hit, x, angle, theta, point, sign) -> Scalar:
        """Radiance seen on one side of an edge.

        A ray just inside a limb meets it so flat that its parameter has no useful derivative: the
        limb's own point is found by a ray across the sight instead.
        """
        light, (t, s) = self.light, hit
        if not self.limb or light.radiance is None:
            return light.sent(number, x, angle)
        front = light.front(jnp.maximum(number, 0), s, light.sight(angle))
        outward = -sign * left(light.sight(theta))
        gap = point - light.eye(x)
        far = jnp.sqrt(jax.lax.stop_gradient(dot_2d(gap, gap)))
        start = point + LIMB_STEP * far * outward
        _, limb = light.scene.hit(self.owner, start, -outward, light.line.on)
        s = jnp.where((number == self.owner) & _near(t, far), limb, s)
        return light.shone(number, s, front, x, theta)

    def jet(self, u: Ray) -> Jet:
        """By autodiff along the silhouette."""
        return autodiff_jet(self.at, u, self.frame)


class BreakJump(Field):
    """Jump of the environment in the direction in which it breaks; zero where a shape hides it."""

    light: LightField
    j: Int[Array, ""] = eqx.field(converter=jnp.asarray)

    @property
    def frame(self) -> Frame:
        """Frame of the light."""
        return self.light.frame

    def at(self, u: Ray) -> Scalar:
        """The jump."""
        light, x = self.light, u[0]
        breaks = getattr(light.scene.environment, "breaks", None)
        theta = _sky_angle(light, as_float(breaks)[self.j])
        numbers, angles = light.beside(x, theta)
        low, high = (light.sent(numbers[i], x, angles[i]) for i in range(2))
        sky = (numbers[0] < 0) & (numbers[1] < 0)
        return jnp.where(sky & (jnp.cos(light.angle(u) - theta) > 0.0), high - low, 0.0)

    def jet(self, u: Ray) -> Jet:
        """By autodiff."""
        return autodiff_jet(self.at, u, self.frame)
