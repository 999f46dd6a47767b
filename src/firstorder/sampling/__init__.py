"""Random sampling: strata, distributions, and estimates that know their own error."""

from firstorder.sampling._density import ExpectedDensity, expected_fixed_radius, expected_k_nearest
from firstorder.sampling._distributions import (
    CosineDirections,
    CosinePowerLobe,
    Discrete,
    PiecewiseConstant,
    UniformDirections,
)
from firstorder.sampling.estimates import Estimate, Moments, combine, estimate
from firstorder.sampling.strata import jittered, midpoints

__all__ = [
    "jittered",
    "midpoints",
    "UniformDirections",
    "CosineDirections",
    "CosinePowerLobe",
    "Discrete",
    "PiecewiseConstant",
    "Estimate",
    "Moments",
    "estimate",
    "combine",
    "ExpectedDensity",
    "expected_fixed_radius",
    "expected_k_nearest",
]
