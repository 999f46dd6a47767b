"""Occlusion: the light is multiplied by the transparency of what stands in its way."""

from __future__ import annotations

import equinox as eqx

from firstorder.conventions import Frame
from firstorder.errors import check_between
from firstorder.fields.field import Field
from firstorder.fields.mask import half_plane
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.multiply import Multiply
from firstorder.transport.event import Event, require
from firstorder.transport.travel import Travel
from firstorder.typing import Scalar, as_float


class Occlusion(Event):
    """`l'(x, v) = l(x, v) V(x, v)`, V the transparency in [0, 1].

    A planar blocker depends on x alone. One that stands `depth` behind the plane (towards where
    the light comes from) is sheared by the travel over that distance.

    Args:
        transparency: field V over the light's coordinates.
        depth: distance from the blocker to the plane, along the light; zero for a planar one.
        window: box for the spectrum (see `Multiply`).

    Reference: D05 eqs. 4-5.
    """

    transparency: Field
    depth: Scalar = eqx.field(converter=as_float, default=0.0)
    window: Grid | None = None

    def law(self, frame: Frame) -> Law:
        """Multiply by V, sheared to its depth."""
        same = self.transparency.frame.coordinates == frame.coordinates
        require(same, self, frame, f"light in {self.transparency.frame.coordinates}")
        shear = Travel(self.depth).law(frame)
        return Multiply(shear(self.transparency), self.window)


def half_plane_blocker(
    edge, frame: Frame, transparency=0.0, window: Grid | None = None
) -> Occlusion:
    """A half-plane that blocks `x < edge`, letting through the fraction `transparency`.

    Raises:
        ValueError: if `transparency` lies outside [0, 1].

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import half_plane_blocker
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> half_plane_blocker(0.5, L.frame)(L)(0.0, 0.0).item()
        0.0
    """
    check_between("transparency", transparency, 0.0, 1.0)
    mask = half_plane(edge, transparency, 1.0, frame.coordinates[0], frame)
    return Occlusion(mask, 0.0, window)
