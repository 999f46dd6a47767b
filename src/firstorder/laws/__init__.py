"""The five operators of light transport (R07 Fig. 2): move, warp, multiply, integrate, convolve."""

from firstorder.laws.base import FieldImage, Law, SpectrumImage
from firstorder.laws.convolve import Circle, Convolve, Domain, Hemisphere, Line
from firstorder.laws.integrate import Integrate
from firstorder.laws.move import Move
from firstorder.laws.multiply import Multiply
from firstorder.laws.warp import Linearisation, Map, Warp
from firstorder.laws.zonal import VonMisesFisher, Zonal, ZonalCosine, ZonalKernel

__all__ = [
    "Law",
    "FieldImage",
    "SpectrumImage",
    "Move",
    "Map",
    "Warp",
    "Linearisation",
    "Multiply",
    "Integrate",
    "Convolve",
    "Domain",
    "Line",
    "Circle",
    "Hemisphere",
    "Zonal",
    "ZonalKernel",
    "VonMisesFisher",
    "ZonalCosine",
]
