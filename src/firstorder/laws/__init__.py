"""What mathematics does: the five operators of light transport (R07 Fig. 2)."""

from firstorder.laws.base import Image, Law, SpectrumImage
from firstorder.laws.convolve import Circle, Convolve, Domain, Hemisphere, Line
from firstorder.laws.integrate import Integrate
from firstorder.laws.move import Move
from firstorder.laws.multiply import Multiply
from firstorder.laws.warp import Linearisation, Map, Warp
from firstorder.laws.zonal import VonMisesFisher, Zonal, ZonalCosine, ZonalKernel

__all__ = [
    "Circle",
    "Convolve",
    "Domain",
    "Hemisphere",
    "Image",
    "Integrate",
    "Law",
    "Line",
    "Linearisation",
    "Map",
    "Move",
    "Multiply",
    "SpectrumImage",
    "VonMisesFisher",
    "Warp",
    "Zonal",
    "ZonalCosine",
    "ZonalKernel",
]
