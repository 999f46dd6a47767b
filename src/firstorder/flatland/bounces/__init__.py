"""Indirect light in flatland: radiosity, path tracing, photon maps."""

from firstorder.flatland.bounces._panels import Discretization
from firstorder.flatland.bounces.pathtrace import path_irradiance, path_radiance, tree_irradiance
from firstorder.flatland.bounces.photonmap import (
    PhotonMap,
    final_gather,
    photon_irradiance,
    photon_map,
    photon_radiance,
)
from firstorder.flatland.bounces.photons import Photons, split_photons, trace_photons
from firstorder.flatland.bounces.radiosity import (
    RadiositySolution,
    corner_exponent,
    solve_radiosity,
)
from firstorder.sampling._density import DensityEstimator

__all__ = [
    "Discretization",
    "RadiositySolution",
    "solve_radiosity",
    "corner_exponent",
    "path_irradiance",
    "path_radiance",
    "tree_irradiance",
    "Photons",
    "trace_photons",
    "split_photons",
    "PhotonMap",
    "photon_map",
    "DensityEstimator",
    "photon_irradiance",
    "photon_radiance",
    "final_gather",
]
