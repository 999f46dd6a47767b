"""A scene as a light field: radiance along a straight line, with the silhouettes for its edges.

One first hit answers for a ray. Between silhouettes the number of the shape that is hit is constant
and has no derivative; the light that this one shape sends along the ray is differentiated. So what
the laws of `firstorder.laws` do to a field (split at its edges, add boundary terms) they do to a
scene, and `irradiance` is the integral of this field under a cosine, computed faster.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from firstorder._argument_checks import check_finite, check_shape, nan_unless
from firstorder.conventions import FLATLAND, Frame, direction
from firstorder.errors import Refused
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Edge, Field
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.flatland.intersect import first_shape
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Point
from firstorder.flatland.visible import Receiver
from firstorder.numerics._planar import cross_2d
from firstorder.scene._arguments import check_asked
from firstorder.scene._primitives import BACK, FRONT
from firstorder.scene._questions import check_shines
from firstorder.typing import Ray, Scalar


def light_field(
    scene: Scene,
    line: Receiver,
    *,
    frame: Frame = FLATLAND,
    radiance: Callable | None = None,
) -> LightField:
    """The light that a scene sends through a straight line, as a field.

    `L(x, theta)`: the ray runs through `line.position + x line.tangent` at the angle theta from the
    line's normal (conventions, Flatland). *Incoming* light is what the first shape along
    `direction(n + theta)` sends, or the environment; *outgoing* light, labelled by where it goes,
    what the first shape along `-direction(n + theta)` sends. Over (x, v) with `v = tan(theta)`.

    Its edges are the scene's silhouettes, as smooth functions of the ray: in slopes the ends of
    shapes are straight edges, `v h = x - a` for a point at the height h above the line and the
    place a along it; a round shape's is the distance of the ray from its centre, less its extent
    across the ray. Differentiable in the ray, the line and every leaf of the scene.

    Valid when: no two silhouettes are in line (derivatives are then one-sided). Edges are those
    over the direction, told for |theta| < pi / 2 from the line's normal. On an edge, and within
    `eps^(3/4)` radians of it, the value is the mean of both sides.
    Wrong when: it is integrated over x across a place where a shape crosses the line, for the light
    jumps there and no edge says so; or when the edges of `Curves`, which are known on this very
    line, travel: ask for the field on the far line instead. Derivatives of a `radiance` that varies
    along a round shape are infinite at its limb: jets of integrals converge slowly in the gradient
    and not in the Hessian. There differentiate the integral's value, whose nodes move with limbs.

    Args:
        scene: shapes and environment, without point lights.
        line: a point of the line, where x = 0 [m], the angle of its normal [rad], and the number of
            the shape on which it lies, if any.
        frame: `("x", "theta")` or `("x", "v")`, incoming or outgoing.
        radiance: what the shapes send out, in place of their emission, as in `irradiance`: a
            function of the shape's number, the parameter on it, whether its front is seen, and the
            direction of sight.

    Raises:
        ValueError: if the line is not one line, the frame has other coordinates, the scene holds
            point lights (their field is a Dirac), or outgoing light is asked for on a shape.

    Reference: R07 §3 (the light field whose gradients it takes), §6.3; D05 §3.1; E11 §3.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Receiver, Scene, Segments, light_field, primitive
        >>> from firstorder.laws import Integrate, Multiply
        >>> from firstorder.fields import Function
        >>> lamp = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)
        >>> L = light_field(Scene.of(lamp), Receiver((0.0, 0.0), 0.0))
        >>> L(0.5, 0.0).item(), L(1.5, 0.0).item(), L(1.0, 0.0).item()
        (1.0, 0.0, 0.5)
        >>> weighted = Multiply(Function(lambda x, theta: jnp.cos(theta)))(L)
        >>> E = Integrate("theta", -jnp.pi / 2, jnp.pi / 2)(weighted)
        >>> round(E(0.0).item(), 6), round(E.jets(0.5).gradient.item(), 6)
        (1.414214, -0.544865)
    """
    check_asked(scene, Scene, line, Receiver, "line")
    if frame.coordinates not in (("x", "theta"), ("x", "v")):
        raise ValueError(
            f"Argument `frame` must be over (x, theta) or (x, v), but is over {frame.coordinates}."
        )
    check_shape("line.position", line.position, (2,))
    check_shape("line.n", line.n, ())
    check_finite("line.position", line.position)
    check_finite("line.n", line.n)
    if scene.points.intensity.shape[0]:
        raise ValueError(
            "Argument `scene` must hold no point lights, whose field is a Dirac: "
            "add their irradiance (`irradiance`) to the integral."
        )
    _refuse_own_light(line, frame)
    if radiance is None:
        check_shines(scene)
    elif not isinstance(radiance, eqx.Module):
        radiance = jax.tree_util.Partial(radiance)
    return LightField(scene, line, radiance, frame)


def _refuse_own_light(line: Receiver, frame: Frame) -> None:
    """Outgoing light on a shape would be that shape's own, which a ray from it does not meet."""
    on = line.on
    known = not isinstance(on, Tracer)
    if frame.sense == "outgoing" and known and bool(on >= 0):
        raise ValueError(
            f"Argument `line` must lie on no shape for outgoing light, but lies on {int(on)}: "
            "put the line before it."
        )


class LightField(Field):
    """The field of `light_field`, which makes it.

    Attributes:
        scene: the shapes.
        line: where x is measured.
        radiance: what the shapes send, or None for their emission.
        frame: coordinates and sense.
    """

    scene: Scene
    line: Receiver
    radiance: Any
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    # --- one ray ---------------------------------------------------------------------------------

    @property
    def facing(self) -> float:
        """The sign of the light's way along the line of sight, from the function `facing`."""
        return facing(self.frame)

    def angle(self, u: Ray) -> Scalar:
        """Angle of a ray from the line's normal [rad]."""
        return jnp.arctan(u[1]) if self.frame.uses_slopes else u[1]

    def eye(self, x: Scalar) -> Point:
        """The point of the line at x [m]."""
        return self.line.position + x * self.line.tangent

    def sight(self, theta: Scalar) -> Point:
        """Unit vector to where the light of a ray comes from."""
        return self.facing * direction(self.line.n + theta)

    def beside(
        self, x: Scalar, theta: Scalar, far: Scalar | None = None
    ) -> tuple[Int[Array, "2"], Float[Array, "2"]]:
        """The shapes seen just clockwise and just counter-clockwise of a ray, and those angles.

        The numbers, -1 for none, have no derivative. Where the distance to an edge is known the
        rays pass it by more than the rounding of the place from which they start [m].
        """
        eps = jnp.finfo(theta.dtype).eps
        epsilon = eps**0.75
        if far is not None:
            rounding = 16.0 * eps * jnp.max(jnp.abs(self.eye(x)))
            epsilon = jnp.maximum(epsilon, jax.lax.stop_gradient(rounding / far))
        angles = theta + epsilon * np.array([-1.0, 1.0], theta.dtype)
        along = jax.vmap(self.sight)(angles)
        origins = jnp.broadcast_to(self.eye(x), along.shape)
        return first_shape(self.scene, origins, along, self.line.on), angles

    def sent(self, number: Int[Array, ""], x: Scalar, theta: Scalar) -> Scalar:
        """Radiance that a shape, or for -1 the sky, sends along a ray that it is known to meet."""
        shape, along, here = jnp.maximum(number, 0), self.sight(theta), self.eye(x)
        asked = (self.scene, here, along)
        scene, origin, way = jax.lax.stop_gradient(asked) if self.radiance is None else asked
        _, s = scene.hit(shape, origin, way, self.line.on)
        return self.shone(number, s, self.front(shape, s, way), x, theta)

    def met(self, number: Int[Array, ""], x: Scalar, theta: Scalar) -> tuple[Scalar, Scalar]:
        """Where a ray meets a shape: distance [m], infinity for a miss, and parameter."""
        shape = jnp.maximum(number, 0)
        return self.scene.hit(shape, self.eye(x), self.sight(theta), self.line.on)

    def front(self, shape: Int[Array, ""], s: Scalar, along: Point) -> Array:
        """Whether a ray along a direction meets the side that the normal is on."""
        _, tangent, _ = jax.lax.stop_gradient(self.scene).motion(shape, jax.lax.stop_gradient(s))
        return cross_2d(tangent, along) < 0.0

    def shone(self, number, s: Scalar, front: Array, x: Scalar, theta: Scalar) -> Scalar:
        """The light from a known point of a shape, or from the environment."""
        shape = jnp.maximum(number, 0)
        if self.radiance is None:
            L = self.scene.material.emission[shape, jnp.where(front, FRONT, BACK)]
        else:
            L = self.radiance(shape, s, front, self.sight(theta))
        L = jnp.where(number >= 0, L, 0.0) + 0.0 * x
        if self.scene.environment is not None:
            turned = 0.0 if self.facing > 0 else jnp.pi
            sky = self.scene.sky(self.line.n + theta + turned)
            L = L + jnp.where(number < 0, sky, 0.0)
        sound = jnp.isfinite(self.line.n) & jnp.all(jnp.isfinite(self.line.position))
        return nan_unless(sound & ~self.scene.unsound, L)

    # --- the field -------------------------------------------------------------------------------

    def at(self, u: Ray) -> Scalar:
        """Radiance of the first hit or the environment; on an edge the mean of its sides."""
        x, theta = u[0], self.angle(u)
        numbers, angles = self.beside(x, theta)
        return jnp.mean(jax.vmap(lambda k, angle: self.sent(k, x, angle))(numbers, angles))

    def jet(self, u: Ray) -> Jet:
        """Derivatives of the light that the shapes seen here send, by autodiff of that one hit.

        Zeros for emission, which is the same in all directions.
        """
        if self.radiance is None and self.scene.environment is None:
            n = u.size
            flat = jnp.zeros(n, u.dtype), jnp.zeros((n, n), u.dtype)
            return Jet(self.at(u).astype(u.dtype), *flat, self.frame)
        theta = self.angle(u)
        numbers, angles = self.beside(u[0], theta)

        def one(k, turn):
            return autodiff_jet(lambda u: self.sent(k, u[0], self.angle(u) + turn), u, self.frame)

        turns = jax.lax.stop_gradient(angles - theta)
        return jax.tree.map(lambda leaf: jnp.mean(leaf, 0), jax.vmap(one)(numbers, turns))

    def edges(self) -> tuple[Edge, ...]:
        """Every silhouette, crossing and break of the environment; hidden ones jump by zero.

        The common end of two segments is an edge of each of them, with the same jump.
        """
        from firstorder.flatland.light_fields._edges import edges

        return edges(self)

    def spectrum(self) -> Spectrum:
        """Refused: a scene's light does not die out along an endless line."""
        raise Refused(
            "a scene's light never dies out along a line, so its spectrum needs a window: take "
            "spectrum_in(grid), Multiply(field, grid), or discrete_transform of grid.sample(field)"
        )

    def covariance(self) -> Covariance:
        """Refused: every silhouette has an infinite one."""
        raise Refused("a silhouette has an infinite covariance: soften it, or state a window")

    def spectrum_in(self, window: Grid) -> Spectrum:
        """Transform of the light in a box of (x, v), in closed form: `light_fields.spectrum_in`.

        Args:
            window: the box; its size does not matter.
        """
        from firstorder.flatland.light_fields.spectrum import spectrum_in

        return spectrum_in(self, window)

    def series(self, window: Grid) -> Series:
        """Closed form over slopes where every silhouette is a point and the light is uniform."""
        from firstorder.flatland.light_fields.spectrum import series_in

        return series_in(self, window)


def facing(frame: Frame) -> float:
    """+1 if the eye looks along the label of a ray, -1 if against it (outgoing light).

    Example:
        >>> from firstorder.conventions import FLATLAND
        >>> from firstorder.flatland.light_fields import facing
        >>> facing(FLATLAND), facing(FLATLAND.turned())
        (1.0, -1.0)
    """
    return 1.0 if frame.sense == "incoming" else -1.0
