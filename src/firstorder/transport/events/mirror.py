"""Mirror reparameterisation: light labelled by the direction it would be reflected to."""

from __future__ import annotations

import numpy as np

from firstorder.conventions import Frame
from firstorder.laws.base import Law
from firstorder.laws.move import Move
from firstorder.transport.event import Event, require_frame


class Mirror(Event):
    """`L_m(x, theta) = L(x, -theta)` in the local frame: incoming light becomes outgoing.

    All directions change sign, so does their gradient; the spectrum is
    `F(Omega_x, -Omega_theta)`.

    Called: mirror reparameterization (R07 step 2, D05 step 4).

    Reference: R07 eqs. 12-13; D05 eq. 14.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Mirror
        >>> L = gaussian((0.0, 0.5), (1.0, 1.0))
        >>> Mirror()(L)(0.0, -0.5).item()  # the peak is on the other side
        1.0
    """

    def law(self, frame: Frame) -> Law:
        """The flip of every direction."""
        require_frame(frame.sense == "incoming", self, frame, "incoming light")
        signs = np.array([-1.0 if i in frame.directions else 1.0 for i in range(frame.dims)])
        return Move(np.diag(signs), to=frame.turned())
