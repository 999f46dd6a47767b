"""Incidence and outgoing frames: from the plane across a ray to the surface it meets, and back."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import _all, check_one, nan_unless
from firstorder.conventions import Frame
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.laws.warp import Map, Warp
from firstorder.numerics._small_matrices import identity_with
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Array, Ray, Scalar, as_float


class Incidence(Event):
    """Light across a central ray, seen from a surface that the ray meets at the angle theta0.

    `l_i(x, theta) = l(x cos(theta0), theta - theta0)`: the footprint grows by 1 / cos(theta0), the
    local angle is measured from the central ray. Spectrum:
    `exp(-2 pi i Omega_theta theta0) / |cos(theta0)| l(Omega_x / cos(theta0), Omega_theta)`.

    This is the first order in the neighbourhood of the ray. Exactly, the plane across the ray is
    met at `x cos(theta) / cos(theta - theta0)`: a warp (`exact=True`), from which the move differs
    by `x sin(theta0) (theta - theta0)`. Light that left another surface arrives first:
    `Arrival() >> Incidence(theta0)`, which flips x as D05 eq. 9 does.

    In space (x along the plane of incidence, the first angle in it, the second across it) only x
    is scaled.

    Args:
        theta0: angle of the central ray from the normal, |theta0| < pi / 2.
        exact: the warp instead of the move (flatland).

    Raises:
        ValueError: if the ray does not come from above the surface. A traced one gives NaN.

    Called: reparameterization into the tangent frame (D05 step 1).

    Reference: D05 eq. 9 and Table 1, which print `-Omega_x cos(theta0)` for the argument and
    drop the 2 pi of the phase.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Incidence
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> oblique = Incidence(jnp.pi / 3)(L)  # the footprint is twice as wide
        >>> round(oblique(2.0, jnp.pi / 3).item() - L(1.0, 0.0).item(), 12)
        0.0
    """

    theta0: Scalar = eqx.field(converter=as_float)
    exact: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse a ray that does not meet the surface from above."""
        _check_above("theta0", self.theta0)

    def law(self, frame: Frame) -> Law:
        """Scale in space by the cosine, shift in angle."""
        require_frame(frame.sense == "incoming", self, frame, "incoming light")
        check_one("theta0", self.theta0)
        angle = _checked(self, frame, self.theta0)
        if self.exact:
            return Warp(_Projection(angle, -1.0))
        return _scale_and_shift(frame, jnp.cos(angle), -angle)


class Outgoing(Event):
    """Light that leaves a surface, seen across a central ray that leaves at the angle theta1.

    `l(x, theta) = l_o(x / cos(theta1), theta + theta1)`: the inverse of `Incidence`. Spectrum:
    `exp(2 pi i Omega_theta theta1) |cos(theta1)| l_o(Omega_x cos(theta1), Omega_theta)`, so energy
    at Omega_x moves out to Omega_x / cos(theta1), as D05 §6.2 uses it.

    First order in the neighbourhood of the ray; exactly the surface is met at
    `x cos(theta) / cos(theta + theta1)` (`exact=True`).

    Args:
        theta1: angle of the central ray from the normal, |theta1| < pi / 2.
        exact: the warp instead of the move (flatland).

    Raises:
        ValueError: if the ray does not leave above the surface. A traced one gives NaN.

    Called: reparameterization out of the tangent frame (D05 step 7).

    Reference: D05 eq. 10 and Table 1, which print `Omega_x / cos(theta1)` for the argument and
    drop the 2 pi of the phase.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.conventions import Frame
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Outgoing
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=Frame(sense="outgoing"))
        >>> seen = Outgoing(jnp.pi / 3)(L)  # foreshortened by two
        >>> round(seen(1.0, -jnp.pi / 3).item() - L(2.0, 0.0).item(), 12)
        0.0
    """

    theta1: Scalar = eqx.field(converter=as_float)
    exact: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse a ray that does not leave above the surface."""
        _check_above("theta1", self.theta1)

    def law(self, frame: Frame) -> Law:
        """Scale in space by 1 / cosine, shift in angle."""
        require_frame(frame.sense == "outgoing", self, frame, "outgoing light")
        check_one("theta1", self.theta1)
        angle = _checked(self, frame, self.theta1)
        if self.exact:
            return Warp(_Projection(angle, 1.0))
        return _scale_and_shift(frame, 1.0 / jnp.cos(angle), angle)


def _check_above(name: str, angle) -> None:
    _all(name, angle, lambda a: np.abs(a) < 0.5 * np.pi, "lie above the surface, |angle| < pi/2")


def _checked(event: Incidence | Outgoing, frame: Frame, angle: Scalar) -> Scalar:
    """The angle, NaN if it is below the surface, in a frame that fits."""
    fits = len(frame.positions) == len(frame.directions) > 0 and not frame.uses_slopes
    require_frame(fits, event, frame, "angles, one for each position")
    require_frame(not event.exact or frame.dims == 2, event, frame, "flatland light to be exact")
    return nan_unless(jnp.abs(angle) < 0.5 * np.pi, angle)


def _scale_and_shift(frame: Frame, scale: Scalar, shift: Scalar) -> Move:
    """`x -> scale x` on the first position, `theta -> theta + shift` on the first direction."""
    x, theta = frame.positions[0], frame.directions[0]
    M = identity_with(frame.dims, x, x, scale)
    return Move(M, jnp.zeros(frame.dims, scale.dtype).at[theta].set(shift))


class _Projection(Map):
    """`(x, theta) -> (x cos(theta) / cos(theta + side angle), theta + side angle)`.

    With `side = -1` from the surface to the plane across the ray, with `+1` back.
    """

    angle: Scalar
    side: float = eqx.field(static=True)

    def __call__(self, u: Ray) -> Ray:
        """Point and local angle at which the ray meets the other line."""
        there = u[1] + self.side * self.angle
        return jnp.stack([u[0] * jnp.cos(u[1]) / jnp.cos(there), there])

    def derivatives(self, u: Ray) -> tuple[Array, Array, Array]:
        """`r = cos(theta) / cos(there)`, `r' = sin(side angle) / cos^2`, `r'' = 2 tan r'`."""
        x, theta = u
        there = theta + self.side * self.angle
        r = jnp.cos(theta) / jnp.cos(there)
        first = jnp.sin(self.side * self.angle) / jnp.cos(there) ** 2
        second = 2.0 * jnp.tan(there) * first
        J = jnp.stack([jnp.stack([r, x * first]), jnp.array([0.0, 1.0], u.dtype)])
        H = jnp.zeros((2, 2, 2), u.dtype).at[0, 0, 1].set(first).at[0, 1, 0].set(first)
        return self(u), J, H.at[0, 1, 1].set(x * second)
