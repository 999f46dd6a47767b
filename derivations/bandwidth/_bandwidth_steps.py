"""The steps of D05 Fig. 15, predicted by the library's events and traced by exact rays."""

from __future__ import annotations

import numpy as np

from derivations.reconstruction import tracer
from firstorder.checks.tolerance import normwise

STEPS = ("environment", "curvature", "mirror", "cutoff", "outwards", "leaving", "eye")


def predicted_points(d, k, theta, cutoff=1.0):
    """End point of the library's band limit after every step, from its events."""
    bands = predicted_bands(d, k, theta, cutoff, environment=cutoff)
    return {name: np.asarray(band.farthest(np.array([0.0, 1.0]))) for name, band in bands.items()}


def predicted_bands(d, k, theta, cutoff=1.0, environment=2.0, factor=None):
    """Band limit after every step of Fig. 15, from the library's events and an ideal lobe.

    Args:
        d: distance from the mirror to the eye.
        k: curvature.
        theta: angle of the view.
        cutoff: of the lobe.
        environment: band of the environment.
        factor: band of what multiplies the light before the lobe.
    """
    import jax.numpy as jnp

    from firstorder.bandwidth import BandLimit, band_limit_after
    from firstorder.transport import Curvature, Incidence, Mirror, Outgoing, ToSlope, Travel

    def met(band, *events):
        for event in events:
            band = band_limit_after(event.law(band.frame), band)
        return band

    bands = {"environment": met(BandLimit.box((0.0, environment)), Incidence(theta))}
    bands["curvature"] = met(bands["environment"], Curvature(k))
    shaded = bands["curvature"] + BandLimit.box((0.0, factor)) if factor else bands["curvature"]
    bands["mirror"] = met(shaded, Mirror())
    bands["cutoff"] = bands["mirror"].cut("theta", cutoff)
    bands["outwards"] = met(bands["cutoff"], Curvature(k, back=True))
    bands["leaving"] = met(bands["outwards"], Outgoing(theta))
    slopes = ToSlope().linearised(jnp.zeros(2))
    bands["eye"] = met(bands["leaving"], slopes, Travel(d))
    return bands


def traced_points(d, k, theta):
    """Phase gradients of one wave of the environment, by differences of exact rays."""

    def local_normal(x):
        x = np.asarray(x, float)
        P = (
            np.stack([np.sin(k * x), 1.0 - np.cos(k * x)], -1) / k
            if k
            else np.stack([x, 0 * x], -1)
        )
        return tracer.angle(tracer.normal(P, k))

    def across(start):
        """The environment's angle seen along (y, t), y across the central ray at `start`."""

        def light(y, t):
            E = start + np.asarray(y)[..., None] * np.array([np.cos(theta), np.sin(theta)])
            w = -tracer.direction(np.asarray(t, float))
            P = tracer.hit(E, w, k)
            return tracer.angle(tracer.reflect(w, tracer.normal(P, k)))

        return light

    height = 0.01 / (1.0 + abs(k))
    above = tracer.eye(height, theta)  # just off the mirror, on the central ray
    lights = {
        "environment": (lambda x, t: t + 0.0 * x, 0.0),
        "curvature": (lambda x, t: t + local_normal(x), 0.0),
        "mirror": (lambda x, t: local_normal(x) - t, 0.0),
        "outwards": (lambda x, t: local_normal(x) - (t - local_normal(x)), 0.0),
        "eye": (across(tracer.eye(d, theta)), theta),
    }
    h = 0.02 * np.cos(theta) ** 2 / (1.0 + abs(k) * (1.0 + d))

    def gradient(light, at):
        """Along the line, and along the angle."""
        along = tracer.rate(lambda x: light(x, at), 0.0, h)
        return np.array([along, tracer.rate(lambda t: light(0.0, t), at, h)])

    points = {name: gradient(*light) for name, light in lights.items()}
    # The line through the mirror's point cannot be traced from: shear back from just above it.
    near = gradient(across(above), theta)
    points["leaving"] = near - np.array([0.0, height * near[0]])
    points["cutoff"] = points["mirror"]
    return points


def step_error(*names: str) -> float:
    """Largest error of the predicted end points against traced phases, relative to their size."""
    worst = 0.0
    for d, k, theta in ((1.3, 0.8, 0.5), (0.6, -1.7, -0.9), (2.0, 0.0, 0.3)):
        predicted, traced = predicted_points(d, k, theta), traced_points(d, k, theta)
        for name in names:
            both = (
                predicted[name] * np.sign(predicted[name][1] or 1.0),
                traced[name] * np.sign(traced[name][1] or 1.0),
            )
            worst = max(worst, normwise(*both))
    return worst


def spectrum_error(name: str) -> float:
    """How far the library's spectrum of a windowed wave is from peaking at the end point.

    A wave under a Gaussian window has its largest spectral density, the integral of the window,
    exactly at its point of energy, and keeps it under every linear step.
    """
    import jax.numpy as jnp

    from firstorder.fields import Function, Grid, SampledSpectrum

    d, k, theta = 1.3, 0.8, 0.5
    point = predicted_points(d, k, theta)[name]
    shape = {"curvature": (0.0, k), "mirror": (0.0, k), "outwards": (0.0, 2.0 * k)}[name]
    sign = 1.0 if name == "curvature" else -1.0

    def wave(x, t):  # the wave after the step, written out; real, so each peak has half the energy
        angle = sign * t + shape[1] * x
        return jnp.exp(-0.5 * (x**2 + t**2)) * jnp.cos(2.0 * jnp.pi * angle)

    grid = Grid.spanning((97, 96), (7.0, 7.0))
    F = SampledSpectrum.of(Function(wave), grid)
    return abs(float(jnp.abs(F(*point))) / np.pi - 1.0)
