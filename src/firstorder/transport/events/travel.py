"""Travel through free space: radiance is constant along a ray, so the light field shears."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_not_negative, check_one, is_concrete, nan_unless
from firstorder.conventions import Frame, slope, travel_sign
from firstorder.fields.field import Field
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.laws.warp import Map, Warp
from firstorder.numerics._host import hosted
from firstorder.numerics._small_matrices import identity_with
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Array, Ray, Scalar, as_float


class Travel(Event):
    """Light after a distance: `l'(x, v) = l(x -+ v d, v)`, minus for incoming light.

    In slopes this is a shear, exact at any angle, in flatland and in space; the spectrum shears
    the other way, `F(Omega_x, Omega_v + d Omega_x)` for incoming light. In angles it is a warp,
    `x -+ d tan(theta)`, whose linearisation at theta = 0 is that shear.

    Valid for rays that run towards the line, |theta| < pi / 2; in angles NaN answers for others, so
    reflect such light from above the line only (`AboveLine`, or
    `surface.reflect(light, above=True)`). The linearised angle is wrong by `d theta^3 / 3`.

    Args:
        d: distance along the normal of the reference line, not negative [m]. Zero is the identity.

    Raises:
        ValueError: if `d` is negative or not finite, or where light comes, no one number: map over
            many. A traced `d < 0` gives NaN.

    Called: transport, or travel in free space (D05 §3.1).

    Reference: D05 eqs. 2-3 (their printed primes are exchanged between the two).

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Travel
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> Travel(3.0)(L)(3.0, 1.0).item() == L(0.0, 1.0).item()
        True
    """

    d: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse to travel back."""
        check_not_negative("d", self.d)

    def law(self, frame: Frame) -> Law:
        """A move in slopes, a warp in angles."""
        fits = len(frame.positions) == len(frame.directions) > 0
        require_frame(fits, self, frame, "one direction for each position")
        check_one("d", self.d)
        _, d = hosted(self.d)
        shear = travel_sign(frame.sense) * nan_unless(d >= 0, d)
        require_frame(frame.uses_slopes or frame.dims == 2, self, frame, "slopes in space")
        if frame.uses_slopes or (is_concrete(d) and d == 0):  # a planar blocker travels nowhere
            rows, columns = np.array(frame.positions), np.array(frame.directions)
            return Move(identity_with(frame.dims, rows, columns, shear))
        return Warp(_AngularTravel(as_float(shear)))


class Arrival(Event):
    """Light that leaves one surface, seen as light that comes to a surface facing it.

    The facing surface's frame is turned by half a turn, so `x -> -x` while the slope, or angle, is
    kept, and outgoing light becomes incoming: `l_in(x, v) = l_out(-x, v)`. In space the turn is
    about the second position axis: `l_in(x, y, v, w) = l_out(-x, y, v, -w)`. It is its own inverse
    but for the sense: leaving a surface is not an event, so only outgoing light arrives.

    Travelling first and arriving then is arriving first and travelling then.

    Reference: the flip in front of D05 eq. 9.

    Raises:
        ValueError: if the light is incoming already.

    Example:
        >>> from firstorder.conventions import Frame
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Arrival
        >>> L = gaussian((0.5, 0.2), (1.0, 1.0), frame=Frame(("x", "v"), "outgoing"))
        >>> Arrival()(L)(-0.5, 0.2).item()
        1.0
    """

    def law(self, frame: Frame) -> Law:
        """A flip: the turn negates the plane that it turns in, and the ray's own direction."""
        require_frame(frame.sense == "outgoing", self, frame, "outgoing light")
        fits = len(frame.positions) == len(frame.directions) > 0
        require_frame(fits, self, frame, "one direction for each position")
        require_frame(frame.dims == 2 or frame.uses_slopes, self, frame, "slopes in space")
        signs = np.ones(frame.dims)
        signs[frame.positions[0]] = -1.0
        signs[list(frame.directions[1:])] = -1.0
        return Move(np.diag(signs), to=frame.turned())


class _AngularTravel(Map):
    """`(x + shear tan(theta), theta)`."""

    shear: Array

    def __call__(self, u: Ray) -> Ray:
        """The ray's position before it travelled."""
        return jnp.stack([u[0] + self.shear * slope(u[1]), u[1]])

    def derivatives(self, u: Ray):
        """`d tan / d theta = 1 + tan^2`, and `2 tan (1 + tan^2)`."""
        t = slope(u[1])
        J = jnp.eye(2, dtype=u.dtype).at[0, 1].set(self.shear * (1.0 + t**2))
        second = jnp.zeros((2, 2, 2), u.dtype)
        second = second.at[0, 1, 1].set(2.0 * self.shear * t * (1.0 + t**2))
        return self(u), J, second


def line_light(emission: Field, height) -> Field:
    """Light at the receiver from an emitter that fills a line at a height.

    `L(x, v) = emission(x - v height, v)` for incoming light: the emission seen along each ray,
    which is what travel says. In angles the position is `x - height tan(theta)`.

    Args:
        emission: light at the emitter's own line, labelled like the receiver's.
        height: distance between the two lines, in metres, not negative.

    Raises:
        ValueError: if `height` is negative, or no one number.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import GaussianProfile, spot_light
        >>> from firstorder.transport import line_light
        >>> spot = spot_light(0.0, 0.5, GaussianProfile(0.3, "v", FLATLAND_SLOPE))
        >>> line_light(spot, 2.0)(1.0, 0.5).item() == spot(0.0, 0.5).item()
        True
    """
    check_one("height", height)
    return Travel(height)(emission)
