"""Where to look: strata, distributions, and estimates that know their own error."""

from firstorder.sampling.distributions import Cosine, Lobe, Pick, Piecewise, Uniform
from firstorder.sampling.estimates import Estimate, Moments, combine, estimate
from firstorder.sampling.strata import jittered, midpoints

__all__ = [
    "jittered",
    "midpoints",
    "Uniform",
    "Cosine",
    "Lobe",
    "Pick",
    "Piecewise",
    "Estimate",
    "Moments",
    "estimate",
    "combine",
]
