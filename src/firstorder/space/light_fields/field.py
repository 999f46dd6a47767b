"""The light field of a scene over a plane: radiance along rays, with the outlines as its edges.

With it a scene is light like any other: laws and events act on it, it can be sampled, transformed
and integrated. `irradiance` is one integral of it, computed faster.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import check_finite, check_shape, is_concrete
from firstorder.conventions import SPACE_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Edge, Field
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.fields.spectrum import Spectrum
from firstorder.numerics._small_matrices import inner
from firstorder.numerics._vectors import dot, unit
from firstorder.scene._arguments import check_asked
from firstorder.scene._questions import check_shines
from firstorder.space.intersect import first_shape
from firstorder.space.light_fields._edges import levels
from firstorder.space.receiver import Receiver
from firstorder.space.scene import BACK, FRONT, Scene
from firstorder.space.shapes.kinds import Point
from firstorder.typing import Ray, Scalar

# Number of the shape that is met, the point there, whether its front is met, direction of looking.
Sent = Callable[[Int[Array, ""], Point, Bool[Array, ""], Point], Float[Array, ""]]


class LightField(Field):
    """The field of `light_field`, which makes it.

    Attributes:
        scene: shapes and sky.
        plane: where x and y are measured.
        radiance: what the shapes send, or None for their emission.
        frame: coordinates and sense.
        axis: number of the coordinate along which a line of rays meets each edge once.
    """

    scene: Scene
    plane: Receiver
    radiance: Any
    frame: Frame = eqx.field(static=True, default=SPACE_SLOPE)
    axis: int = eqx.field(static=True, default=2)

    # --- one ray ---------------------------------------------------------------------------------

    @property
    def facing(self) -> float:
        """+1 if the eye looks along the label of a ray, -1 if against it (outgoing light)."""
        return 1.0 if self.frame.sense == "incoming" else -1.0

    def sight(self, u: Ray) -> tuple[Point, Point]:
        """Where a ray starts on the plane, and the unit vector to where its light comes from."""
        t, b, n = (self.plane.axes[:, i] for i in range(3))
        origin = self.plane.position + u[0] * t + u[1] * b
        return origin, unit(self.facing * (n - u[2] * t - u[3] * b))

    def seen(self, u: Ray) -> Int[Array, ""]:
        """Number of the shape from which a ray's light comes, -1 for the sky. No derivative."""
        origin, along = self.sight(u)
        return first_shape(self.scene, origin[None], along[None], self.plane.on)[0]

    def beside(self, u: Ray) -> tuple[Float[Array, "2 4"], Int[Array, "2"]]:
        """The rays just to either side, aslant in slopes, and the shapes that are seen there."""
        epsilon = jnp.finfo(u.dtype).eps ** 0.75 * jnp.asarray([0.0, 0.0, 1.0, 0.618], u.dtype)
        rays = jnp.stack([u - epsilon, u + epsilon])
        return rays, jax.vmap(self.seen)(rays)

    def sent(self, number: Int[Array, ""], u: Ray) -> Scalar:
        """Radiance that a shape, or for -1 the sky, sends along a ray that it is known to meet."""
        origin, along = self.sight(u)
        shape = jnp.maximum(number, 0)
        point, normal, t = self.scene.surface(shape, origin, along, self.plane.on)
        front = dot(normal, along) < 0.0
        if self.radiance is None:
            L = self.scene.material.emission[shape, jnp.where(front, FRONT, BACK)]
        else:
            L = self.radiance(shape, point, front, along)
        met = (number >= 0) & jnp.isfinite(t)  # search and hit may round a grazing ray differently
        return jnp.where(met, L, self.scene.sky(along)) + 0.0 * jnp.sum(u)  # NaN stays NaN

    # --- the field -------------------------------------------------------------------------------

    def at(self, u: Ray) -> Scalar:
        """Radiance of the first hit or the sky; on an edge the mean of its sides."""
        rays, numbers = self.beside(u)
        return jnp.mean(jax.vmap(self.sent)(numbers, rays))

    def jet(self, u: Ray) -> Jet:
        """Exact between edges: the hit is found without derivatives, then derived as it stands.

        Zeros where radiance is constant.
        """
        if self.radiance is None and not callable(self.scene.environment):
            n = u.size
            return Jet(self.at(u), jnp.zeros(n, u.dtype), jnp.zeros((n, n), u.dtype), self.frame)
        rays, numbers = self.beside(u)

        def one(k, ray):
            return autodiff_jet(lambda r: self.sent(k, r), ray, self.frame)

        return jax.tree.map(lambda leaf: jnp.mean(leaf, 0), jax.vmap(one)(numbers, rays))

    def edges(self) -> tuple[Edge, ...]:
        """The outlines of all shapes, some 4 to 12 for each; hidden ones jump by zero.

        Straight edges are met once along any coordinate, the halves of round ones once along
        `axis`; see `ray_levels`.
        """
        found = levels(self.scene, self.plane, self.frame, self.axis)
        return tuple(Edge(level, Jump(self, level, owner)) for owner, level in found)

    def spectrum(self) -> Spectrum:
        """Refused: it does not die out."""
        raise Refused(
            "the light of a scene dies out neither in position nor in slope, so its spectrum needs "
            "a window: SampledSpectrum.of(Multiply(window)(light), grid)"
        )

    def covariance(self) -> Covariance:
        """Refused: outlines are edges."""
        raise Refused(
            "an outline has an infinite covariance: sample the light under a window, "
            "Sampled.of(Multiply(window)(light), grid), whose step then limits the band"
        )


class Jump(Field):
    """Radiance across an outline: where its level is positive less where it is negative.

    Zero where the outline is hidden, or does not belong to the shape that is seen on one side. What
    is seen beside a shape counts as cut off by it only if it goes on behind; if it ends there, an
    edge of its own says so. So shapes may touch and share edges: the jumps of all edges at one
    place add up to the light's.

    A ray beside the edge answers for the nearest ray on it. The sides are looked at a distance
    `4 sqrt(eps)` from it in slopes, so a radiance that varies along a shape is off by as much, and
    by the root of that beside a round outline.
    """

    light: LightField
    level: Field
    owner: Int[Array, ""] = eqx.field(converter=jnp.asarray)

    @property
    def frame(self) -> Frame:
        """Frame of the light."""
        return self.light.frame

    def at(self, u: Ray) -> Scalar:
        """The difference, from the first hits on both sides."""
        slopes = jax.value_and_grad(lambda s: self.level.at(jnp.concatenate([u[:2], s])))

        def newton(_, s):
            value, steep = slopes(s)
            square = inner(steep, steep)
            return s - value * steep / jnp.where(square > 0.0, square, 1.0)

        s = jax.lax.fori_loop(0, 3, newton, u[2:])  # to the edge, at the same place of the plane
        u = jnp.concatenate([u[:2], s])
        steep = jax.lax.stop_gradient(slopes(s)[1])
        square = inner(steep, steep)
        step = 4.0 * jnp.sqrt(jnp.finfo(u.dtype).eps / jnp.where(square > 0.0, square, 1.0))
        epsilon = jnp.concatenate([jnp.zeros_like(steep), step * steep])
        sides = jnp.stack([u + epsilon, u - epsilon])
        seen = jax.vmap(self.light.seen)(sides)
        sent = jax.vmap(self.light.sent)(seen, sides)
        own = seen == self.owner
        # What is beside the owner: does a ray on the owner's side meet it too, behind?
        origin, along = self.light.sight(jnp.where(own[0], sides[0], sides[1]))
        other = jnp.where(own[0], seen[1], seen[0])
        on = self.light.plane.on
        behind = self.light.scene.distance(jnp.maximum(other, 0), origin, along, on)
        cut = (other < 0) | jnp.isfinite(jax.lax.stop_gradient(behind))
        kept = jnp.where(own | cut, sent, 0.0)
        return jnp.where(own[0] != own[1], kept[0] - kept[1], 0.0)

    def jet(self, u: Ray) -> Jet:
        """By autodiff of the two hits."""
        return autodiff_jet(self.at, u, self.frame)


def light_field(
    scene: Scene,
    plane: Receiver,
    *,
    frame: Frame = SPACE_SLOPE,
    radiance: Sent | None = None,
    axis: str = "v",
) -> LightField:
    """The light that a scene sends through a plane, as a field.

    `L(x, y, v, w)`: the ray runs through `position + x t + y b` and along `n - v t - w b`, with the
    plane's axes (t, b, n) (conventions, Sense). *Incoming* light is what the first shape along that
    vector sends, or the sky; *outgoing* light, labelled by where it goes, what the first shape the
    other way sends.

    Its edges are the outlines of the shapes. The line of a straight edge is passed where a function
    of first degree in each coordinate is zero, so any line of rays along one meets it once. The
    outline of a round shape is met twice: it is cut into two halves, each of which a line of rays
    along `axis` meets once. So `Integrate` over `axis` splits there, and its nodes carry the
    boundary terms of every derivative. Differentiable in the ray, the plane and every leaf of the
    scene.

    Valid when: shapes of unlike radiance do not run into each other, but for planes (their common
    line is no outline: values are right there, edges miss it); the plane is outside of all closed
    shapes. On an edge the value is the mean of both sides, within `eps^(3/4)` in slopes.
    Wrong when: a line of rays along another coordinate than `axis` passes one half of a round
    outline twice, which `Edge.crossing` does not see. A second integral has kinks where
    outlines have corners and ends, and converges slowly unless they are among its `breaks`.

    A spectrum needs a window, and samples: `SampledSpectrum.of`, `discrete_transform` or
    `Sampled.of` on a `Grid` of four axes. Edges alias, so the error falls slowly with the step.

    Args:
        scene: shapes and sky.
        plane: a point of the plane, where x = y = 0, its axes, and the number of the shape on which
            it lies, if any, which no ray meets.
        frame: `("x", "y", "v", "w")`, incoming or outgoing.
        radiance: what the shapes send, in place of their emission: a function of the shape's
            number, the point that is seen [m], whether its front is seen, and the direction of
            sight.
        axis: name of the coordinate along which each half of a round outline is met once.

    Raises:
        ValueError: if the plane is not one plane, frame or axis have other coordinates, or outgoing
            light is asked for on a shape.

    Reference: R07 §3 (the light field whose gradients it takes); D05 §3.1.

    Example:
        >>> from firstorder.space import Scene, light_field, receiver, rectangle, primitive
        >>> lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> L = light_field(Scene.of(primitive(lamp, emission=3.0)), receiver((0.0, 0.0, 0.0)))
        >>> L([0.0, 0.8, 0.8, 0.5], 0.0, [0.1, 0.1, 0.5, 0.0], 0.0).tolist()
        [3.0, 0.0, 3.0, 1.5]
    """
    check_asked(scene, Scene, plane, Receiver, "plane")
    if frame.coordinates != SPACE_SLOPE.coordinates:
        raise ValueError(
            f"Argument `frame` must be over (x, y, v, w), but is over {frame.coordinates}."
        )
    check_shape("plane.position", plane.position, (3,))
    check_finite("plane.position", plane.position)
    if frame.sense == "outgoing" and is_concrete(plane.on) and bool(plane.on >= 0):
        raise ValueError(
            f"Argument `plane` must lie on no shape for outgoing light, but lies on "
            f"{int(plane.on)}: put the plane before it."
        )
    if radiance is None:
        check_shines(scene)
    elif not isinstance(radiance, eqx.Module):
        radiance = jax.tree_util.Partial(radiance)
    return LightField(scene, plane, radiance, frame, frame.axis(axis))
