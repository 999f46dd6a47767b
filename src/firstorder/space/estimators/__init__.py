"""Estimators of irradiance and its derivatives from rays: by area, by strata, triangulated."""

from firstorder.space.estimators._irradiance_forms import (
    Samples,
    stratified_estimate,
    surface_area_estimate,
    trace_strata,
)
from firstorder.space.estimators._triangulation import (
    HemisphereTriangulation,
    hemisphere_triangulation,
)
from firstorder.space.estimators.occlusion_aware import occlusion_aware_estimate
from firstorder.space.estimators.strata import Strata, hemisphere_strata

__all__ = [
    "Strata",
    "hemisphere_strata",
    "Samples",
    "trace_strata",
    "surface_area_estimate",
    "stratified_estimate",
    "HemisphereTriangulation",
    "hemisphere_triangulation",
    "occlusion_aware_estimate",
]
