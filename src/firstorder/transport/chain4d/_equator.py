"""Directions in space by longitude along an equator and latitude from it, and what turns them.

    direction(theta, phi) = (-sin(theta) cos(phi), -sin(phi), cos(theta) cos(phi))

in the axes (t, b, n) of a frame: both angles turn as flatland's do (away from the axis), so that
`Travel` in slopes and these angles name one ray. On the equator, phi = 0, the angles are as good as
plane ones. Every step is exact, or on request the move that touches it at the central ray, with
which D05 §5.2 reasons.
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_shape, nan_unless
from firstorder.conventions import SPACE, SPACE_SLOPE, Frame, slope
from firstorder.errors import Refused
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.laws.warp import Map, Warp
from firstorder.transport.event import Event, require_frame
from firstorder.transport.events.incidence import _check_above
from firstorder.transport.events.rotation import Curvature
from firstorder.typing import Ray, Scalar, as_float


def equator_direction(
    theta: Float[Array, "*#n"], phi: Float[Array, "*#n"]
) -> Float[Array, "*#n 3"]:
    """Unit vector at longitude theta and latitude phi, both turning away from the axes.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.transport.chain4d._equator import equator_direction
        >>> equator_direction(jnp.array(0.0), jnp.array(0.0)).tolist()
        [-0.0, -0.0, 1.0]
    """
    up = jnp.cos(phi)
    axes = -jnp.sin(theta) * up, -jnp.sin(phi), jnp.cos(theta) * up
    return jnp.stack(jnp.broadcast_arrays(*axes), axis=-1)


def equator_angles(w: Float[Array, "*n 3"]) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Longitude and latitude of a unit vector: the inverse of `equator_direction`.

    Undefined at the two poles, where its derivatives are not finite.
    """
    return jnp.arctan2(-w[..., 0], w[..., 2]), jnp.arcsin(-w[..., 1])


class ToEquator(Event):
    """Light in space relabelled from slopes to angles.

    `L(x, y, theta, phi) = l(x, y, tan(theta), tan(phi) / cos(theta))`. A warp, NaN for rays from
    below; to first order about the normal (`exact=False`) the identity, wrong by a third of the
    angle's third power.

    Args:
        exact: the warp, or its first order about the normal.

    Reference: D05 §2.1, §5.2.

    Example:
        >>> from firstorder.conventions import SPACE_SLOPE
        >>> from firstorder.fields import Gaussian
        >>> from firstorder.transport.chain4d._equator import FromEquator, ToEquator
        >>> l = Gaussian([0.0, 0.0, 0.1, 0.2], [[4.0, 0, 0, 0], [0, 4.0, 0, 0], [0, 0, 9.0, 0],
        ...     [0, 0, 0, 9.0]], 1.0, SPACE_SLOPE)
        >>> u = 0.1, 0.2, 0.3, -0.4
        >>> round((ToEquator() >> FromEquator())(l)(*u).item() - l(*u).item(), 14)
        0.0
    """

    exact: bool = eqx.field(static=True, default=True)

    def law(self, frame: Frame) -> Law:
        """The warp of both directions, or new names alone."""
        require_frame(frame.coordinates == SPACE_SLOPE.coordinates, self, frame, "slopes in space")
        to = dataclasses.replace(frame, coordinates=SPACE.coordinates)
        return Warp(_Slopes(), to) if self.exact else Move(jnp.eye(4), to=to)


class FromEquator(Event):
    """Light in space relabelled from angles to slopes: the inverse of `ToEquator`.

    `l(x, y, v, w) = L(x, y, arctan(v), arctan(w / sqrt(1 + v^2)))`; the identity to first order.

    Args:
        exact: the warp, or its first order about the normal.

    Reference: D05 §2.1, §5.2.
    """

    exact: bool = eqx.field(static=True, default=True)

    def law(self, frame: Frame) -> Law:
        """The warp of both directions, or new names alone."""
        require_frame(frame.coordinates == SPACE.coordinates, self, frame, "angles in space")
        to = dataclasses.replace(frame, coordinates=SPACE_SLOPE.coordinates)
        return Warp(_Angles(), to) if self.exact else Move(jnp.eye(4), to=to)


class Oblique(Event):
    """Light across a central ray, seen from a surface that the ray meets at the angle theta0.

    Incoming light goes to the surface, outgoing light leaves it; the plane of incidence holds the
    first axis. Longitudes shift by theta0 and latitudes stay, exactly, for the equator is the plane
    of incidence. Positions, for incoming light:

    `x' = x cos(theta) / cos(theta - theta0), y' = y - x sin(theta0) tan(phi) / cos(theta - theta0)`

    of which `Incidence` and `Outgoing` are the first order: x is scaled and y is not. What they
    miss is of second order in the distance from the central ray. NaN for rays that come from below
    the surface, or from below the plane across the central ray.

    Args:
        theta0: angle of the central ray from the normal, |theta0| < pi / 2; counter-clockwise.

    Raises:
        ValueError: if the ray does not run above the surface.

    Reference: D05 §5.2, "Tangent frame".
    """

    theta0: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse a ray that does not run above the surface."""
        _check_above("theta0", self.theta0)

    def law(self, frame: Frame) -> Law:
        """The warp."""
        require_frame(frame.coordinates == SPACE.coordinates, self, frame, "angles in space")
        return Warp(_Meeting(-self.theta0 if frame.sense == "incoming" else self.theta0))


class Bend(Event):
    """Into the frame of each point's normal, for light about a ray aslant: `Curvature` in space.

    The normal at x leans by the angles `S x`. It turns longitudes by just that, and latitudes only
    by their share at the ray's own longitude theta0:

    `L_local(x, theta, phi) = L(x, theta + (S x)_1, phi + cos(theta0) (S x)_2)`.

    D05 §5.2 leaves out the cosine, which is there at first order: it is the one of Coddington's
    equations for a mirror aslant. With `exact` the frame is turned rigidly from the first normal to
    that at `S x`; the move misses this by terms of second order.

    Args:
        S: shape operator `-dn` in the axes of the surface [1/m]; positive in a valley.
        theta0: longitude of the central ray in the surface's frame.
        back: from the local frame to the global one instead.
        exact: the rotation of the sphere instead of its first order.

    Raises:
        ValueError: if S is not a finite 2 x 2 matrix or theta0 not above the surface.

    Reference: D05 eq. 19 and §5.2, "Curvature".

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import SPACE
        >>> from firstorder.transport.chain4d._equator import Bend
        >>> M = Bend(jnp.eye(2), jnp.pi / 3).law(SPACE).M  # 60 degrees: half across the plane
        >>> round(M[2, 0].item(), 12), round(M[3, 1].item(), 12)
        (1.0, 0.5)
    """

    S: Float[Array, "2 2"] = eqx.field(converter=as_float)
    theta0: Scalar = eqx.field(converter=as_float, default=0.0)
    back: bool = eqx.field(static=True, default=False)
    exact: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse a matrix that is none."""
        check_shape("S", self.S, (2, 2))
        check_finite("S", self.S)
        _check_above("theta0", self.theta0)

    def law(self, frame: Frame) -> Law:
        """A shear, or the rotation of each point's sphere."""
        require_frame(frame.coordinates == SPACE.coordinates, self, frame, "angles in space")
        if self.exact:
            return Warp(_Lean(self.S, self.back))
        share = jnp.stack([jnp.ones_like(self.theta0), jnp.cos(self.theta0)])
        return Curvature(share[:, None] * self.S, self.back).law(frame)


class Turn(Event):
    """Light named from other axes: a rotation of the sphere, and of the plane of positions.

    `L'(x, w) = L(P x, R w)` with directions w as unit vectors, R from the new axes to the old ones.
    A warp of the angles. About a ray that lies on both equators it is, to first order, a plane
    rotation and a shift of the longitude, off by the third power of the distance from that ray.

    Args:
        R: rotation, new axes as columns in the old frame.
        positions: the same for positions, the identity if left out.
        at: longitude, in the new axes, of the ray on both equators about which the first order is
            taken; the warp itself if left out.

    Raises:
        ValueError: if a matrix has another shape or is not finite.

    Reference: D05 §5.2, "Recap of rotations".
    """

    R: Float[Array, "3 3"] = eqx.field(converter=as_float)
    positions: Float[Array, "2 2"]
    at: Scalar | None

    def __init__(self, R, positions=None, at=None):
        """Store both rotations; see the class."""
        self.R = as_float(R)
        still = jnp.eye(2, dtype=self.R.dtype)
        self.positions = still if positions is None else as_float(positions)
        self.at = None if at is None else as_float(at)
        check_shape("R", self.R, (3, 3))
        check_shape("positions", self.positions, (2, 2))
        check_finite("R", self.R)
        check_finite("positions", self.positions)

    def law(self, frame: Frame) -> Law:
        """The warp, or the move that touches it."""
        require_frame(frame.coordinates == SPACE.coordinates, self, frame, "angles in space")
        if self.at is None:
            return Warp(_Turned(self.R, self.positions))
        here = jnp.stack([self.at, jnp.zeros_like(self.at)])
        there = jnp.stack(equator_angles(self.R @ equator_direction(here[0], here[1])))
        plane = _tangents(there[0]).T @ self.R @ _tangents(here[0])
        M = jnp.zeros((4, 4), self.R.dtype).at[:2, :2].set(self.positions).at[2:, 2:].set(plane)
        return Move(M, jnp.concatenate([jnp.zeros(2, M.dtype), there - plane @ here]))


def _tangents(theta: Scalar) -> Float[Array, "3 2"]:
    """Derivatives of a direction on the equator by longitude and by latitude: unit vectors."""
    zero = jnp.zeros_like(theta)
    along = jnp.stack([-jnp.cos(theta), zero, -jnp.sin(theta)])
    return jnp.stack([along, jnp.stack([zero, zero - 1.0, zero])], axis=-1)


class Roll(Event):
    """Axes turned about the normal: positions and slopes alike, exactly.

    `l'(x, v) = l(Q x, Q v)` with the new axes as the columns of Q.

    Args:
        angle: from the old first axis to the new one, towards the second axis.

    Reference: D05 §5.2, "Recap of rotations": the plane of incidence becomes the first axis.
    """

    angle: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse an angle that is none."""
        check_finite("angle", self.angle)

    def law(self, frame: Frame) -> Law:
        """The rotation of both planes."""
        require_frame(frame.coordinates == SPACE_SLOPE.coordinates, self, frame, "slopes in space")
        Q = plane_rotation(self.angle)
        return Move(jnp.zeros((4, 4), Q.dtype).at[:2, :2].set(Q).at[2:, 2:].set(Q))


def plane_rotation(angle: Scalar) -> Float[Array, "2 2"]:
    """Axes turned by an angle, as columns."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    return jnp.stack([jnp.stack([c, -s]), jnp.stack([s, c])])


# --- the maps ------------------------------------------------------------------------------------


class _Slopes(Map):
    """`(x, y, tan(theta), tan(phi) / cos(theta))`."""

    def __call__(self, u: Ray) -> Ray:
        """Slopes of the angles."""
        return jnp.stack([u[0], u[1], slope(u[2]), slope(u[3]) / jnp.cos(u[2])])


class _Angles(Map):
    """`(x, y, arctan(v), arctan(w / sqrt(1 + v^2)))`."""

    def __call__(self, u: Ray) -> Ray:
        """Angles of the slopes."""
        return jnp.stack(
            [u[0], u[1], jnp.arctan(u[2]), jnp.arctan(u[3] / jnp.sqrt(1.0 + u[2] ** 2))]
        )


class _Meeting(Map):
    """Map from rays of one plane to those of another that is turned about the second axis.

    NaN for a ray that does not run upwards from both.
    """

    angle: Scalar

    def __call__(self, u: Ray) -> Ray:
        """Position in the other plane; longitudes shift by the angle."""
        x, y, theta, phi = u
        there = theta + self.angle
        above = (jnp.cos(theta) > 0) & (jnp.cos(there) > 0) & (jnp.cos(phi) > 0)
        across = y + x * jnp.sin(self.angle) * jnp.tan(phi) / jnp.cos(there)
        met = jnp.stack([x * jnp.cos(theta) / jnp.cos(there), across, there, phi])
        return nan_unless(above, met)


class _Lean(Map):
    """Directions turned by the rotation that takes the first normal to the one at `S x`."""

    S: Array
    back: bool = eqx.field(static=True)

    def __call__(self, u: Ray) -> Ray:
        """The turned angles; positions stay."""
        lean = self.S @ u[:2]
        n = equator_direction(lean[0], lean[1])
        # Rodrigues about n0 x n, which is (-n_y, n_x, 0): no angle is needed.
        k = jnp.stack([-n[1], n[0], jnp.zeros_like(n[0])])
        if self.back:
            k = -k
        w = equator_direction(u[2], u[3])
        once = jnp.cross(k, w)
        theta, phi = equator_angles(w + once + jnp.cross(k, once) / (1.0 + n[2]))
        return jnp.stack([u[0], u[1], theta, phi])


class _Turned(Map):
    """`(P x, R w)`."""

    R: Array
    positions: Array

    def __call__(self, u: Ray) -> Ray:
        """Position and angles in the old frame."""
        theta, phi = equator_angles(self.R @ equator_direction(u[2], u[3]))
        return jnp.concatenate([self.positions @ u[:2], jnp.stack([theta, phi])])


class ComposedMove(Event):
    """Several events that are all moves, multiplied into one: short to compile.

    Raises:
        Refused: if one of them is no move.
    """

    events: tuple[Event, ...]

    def law(self, frame: Frame) -> Move:
        """Product of their matrices, the first event's leftmost."""
        M, c = jnp.eye(frame.dims), jnp.zeros(frame.dims)
        for event in self.events:
            law = event.law(frame)
            if not isinstance(law, Move):
                raise Refused(f"{type(event).__name__} is no move: take its first order")
            # f(M1 u + c1) read at u = M2 u' + c2
            M, c, frame = M @ law.M, M @ law.c + c, law.frame(frame)
        return Move(M, c, frame)
