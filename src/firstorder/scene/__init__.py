"""Parts that scenes of both worlds share: primitives, intersection, the geometry term."""

from firstorder.scene._derivatives import Derivatives, derivatives, line_derivatives

__all__ = [
    "Derivatives",
    "derivatives",
    "line_derivatives",
]
