"""Integration by azimuth: critical azimuths, slices, integrands (R07 section 7)."""
