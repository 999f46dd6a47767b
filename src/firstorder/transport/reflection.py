"""BRDF convolution: each point blurs the mirrored light over angle."""

from __future__ import annotations

import equinox as eqx

from firstorder.conventions import Frame
from firstorder.fields.kernel import Kernel
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.convolve import Convolve, Domain, Line
from firstorder.transport.event import Event, require


class Reflection(Event):
    """`B_s(x, theta) = int L_m(x, omega) rho(theta - omega) d omega`.

    Args:
        lobe: BRDF as a kernel of the angle between outgoing and mirror direction.
        domain: line, circle or hemisphere (see `Convolve`).
        nodes: quadrature nodes per smooth piece.
        window: for a lobe that varies in x.

    Reference: R07 eqs. 14-16; D05 eqs. 15-16.
    """

    lobe: Kernel
    domain: Domain = Line()
    nodes: int = eqx.field(static=True, default=64)
    window: Grid | None = None

    def law(self, frame: Frame) -> Law:
        """Convolve along the lobe's angle."""
        require(frame.sense == "outgoing", self, frame, "mirrored light")
        return Convolve(self.lobe, self.domain, self.nodes, self.window)
