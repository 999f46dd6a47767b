"""Rotation by curvature: into the frame of each point's normal, and back."""

from __future__ import annotations

import equinox as eqx
import numpy as np

from firstorder._argument_checks import check_finite, check_shape
from firstorder.conventions import Frame
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.numerics._host import hosted
from firstorder.numerics._small_matrices import identity_with
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Array, as_float


class Curvature(Event):
    """Per-point rotation with a normal that turns linearly, `n(x) = kappa x`.

    Into the local frame: `L_local(x, theta) = L(x, theta + kappa x)`, a shear along the angle; the
    spectrum shears along space, `F(Omega_x - kappa Omega_theta, Omega_theta)`. `back=True` undoes
    it. In space `kappa` may be a 2 x 2 matrix. With the shape operator S of conventions it is `S`
    for angles that turn away from the axes, as the slopes of `Travel` do, and `-S` for angles that
    lean towards them. That is for light about the normal; aslant, see `Bend`.

    Args:
        kappa: curvature dn/dx in radians per metre, positive in a valley; a scalar, or a
            matrix (directions x positions).
        back: from the local frame to the global one instead.

    Raises:
        ValueError: if `kappa` is not finite, or its matrix does not fit the light.

    Called: per-point rotation (R07 step 1, D05 step 2), and back (R07 step 4, D05 step 6).

    Reference: R07 eqs. 9-11, 17, 50; D05 eqs. 11, 19 (their kappa has the other sign).

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Curvature
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> Curvature(0.5)(L)(2.0, 0.0).item() == L(2.0, 1.0).item()
        True
    """

    kappa: Array = eqx.field(converter=as_float)
    back: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse a curvature that is no number."""
        check_finite("kappa", self.kappa)

    def law(self, frame: Frame) -> Law:
        """The shear."""
        fits = len(frame.positions) == len(frame.directions) and not frame.uses_slopes
        require_frame(fits, self, frame, "angles, one for each position")
        half = len(frame.positions)
        if self.kappa.ndim:
            check_shape("kappa", self.kappa, (half, half))
        _, kappa = hosted(self.kappa)
        turn = kappa * np.eye(half, dtype=self.kappa.dtype) if self.kappa.ndim == 0 else kappa
        lower, left = slice(half, 2 * half), slice(None, half)  # a time, last, stands still
        return Move(identity_with(frame.dims, lower, left, -turn if self.back else turn))
