"""Light that bounces: radiosity, path tracing, photon maps."""
