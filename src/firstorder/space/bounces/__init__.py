"""Light that bounces: radiosity, radiance maps, path tracing."""
