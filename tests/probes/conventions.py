"""Probes of what is agreed once."""

import jax.numpy as jnp

from firstorder import conventions

PROBES = {
    "conventions.azimuth_axes": conventions.azimuth_axes,
    "conventions.cylindrical": lambda s: conventions.cylindrical(s, 2.0 * s, 1.0 - s),
    "conventions.direction": conventions.direction,
    "conventions.fourier_kernel": lambda s: conventions.fourier_kernel(
        jnp.stack([s, 0.5]), jnp.stack([1.0, s])
    ),
    "conventions.mirror_direction": lambda s: conventions.mirror_direction(s, 0.5),
    "conventions.normal_rate": lambda s: conventions.normal_rate(
        s * jnp.eye(2), jnp.stack([1.0, s])
    ),
    "conventions.polar": lambda s: conventions.polar(s, 2.0 * s),
    "conventions.shape_operator": lambda s: conventions.shape_operator(
        s * jnp.eye(3)[:, :2], jnp.eye(3)[:, :2]
    ),
    "conventions.slope": conventions.slope,
    "conventions.to_global": lambda s: conventions.to_global(s, 2.0 * s),
    "conventions.to_local": lambda s: conventions.to_local(s, 2.0 * s),
}
