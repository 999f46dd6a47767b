"""Indirect light in space: radiosity, radiance maps, path tracing, photon maps."""

from firstorder.sampling._density import DensityEstimator
from firstorder.space.bounces._radiance_maps import (
    RadianceMaps,
    face_layout,
    refine_maps,
    trace_maps,
)
from firstorder.space.bounces.pathtrace import path_irradiance, path_radiance
from firstorder.space.bounces.photonmap import (
    PhotonMap,
    final_gather,
    photon_irradiance,
    photon_map,
    photon_radiance_maps,
    photon_radiances,
)
from firstorder.space.bounces.photons import Photons, trace_photons
from firstorder.space.bounces.radiosity import rectangle_irradiance, solve_radiosity

__all__ = [
    "path_irradiance",
    "path_radiance",
    "rectangle_irradiance",
    "solve_radiosity",
    "RadianceMaps",
    "face_layout",
    "trace_maps",
    "refine_maps",
    "Photons",
    "trace_photons",
    "PhotonMap",
    "photon_map",
    "DensityEstimator",
    "photon_irradiance",
    "photon_radiances",
    "photon_radiance_maps",
    "final_gather",
]
