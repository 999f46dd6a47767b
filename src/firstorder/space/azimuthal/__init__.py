"""Integration by azimuth: critical azimuths, slices, integrands (R07 section 7)."""

from firstorder.space.azimuthal.transport import (
    AzimuthalIntegral,
    irradiance_by_azimuth,
    transport_by_azimuth,
    visibility_by_azimuth,
)

__all__ = [
    "AzimuthalIntegral",
    "visibility_by_azimuth",
    "irradiance_by_azimuth",
    "transport_by_azimuth",
]
