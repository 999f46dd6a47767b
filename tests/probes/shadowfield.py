"""Probes of shadows as a light field of the plane."""

import jax.numpy as jnp

from firstorder import flatland, shadowfield
from firstorder.conventions import Frame
from firstorder.fields import (
    Affine,
    Bars,
    BoxProfile,
    Constant,
    GaussianProfile,
    Grid,
    Separable,
    gaussian,
)
from firstorder.shadowfield import PLANE, TWO_PLANES


def light(s):
    return Separable(jnp.zeros(1), (GaussianProfile(0.5 + s, "y", PLANE),)).spectrum()


def slit(s):
    """A slit, and what it lets through at two depths."""
    one = Bars(Affine([1.0], 0.0, PLANE), jnp.stack([-s, 0.1]), [0.0, 1.0, 0.0])
    return shadowfield.planar_blockers([one, one], [0.3 + 0.1 * s, 0.6])


def fields(s):
    """Blockers, what they let through and what arrives."""
    even = Constant(1.0 + s, PLANE)
    edge = Bars(Affine([1.0], 0.0, PLANE), jnp.stack([s]), [0.0, 1.0])
    behind = shadowfield.planar_blocker(edge, 0.5)
    lamp = BoxProfile(0.5, "y", PLANE)
    return {
        "shadowfield.planar_blocker": behind(0.3, 0.2 * s),
        "shadowfield.planar_blockers": slit(s)(0.01 * s, 0.02),
        "shadowfield.to_two_planes": shadowfield.to_two_planes(1.0 + s).M,
        "shadowfield.FormFactor": shadowfield.FormFactor(1.0 + s)(s, 0.2),
        "shadowfield.mean_form_factor": shadowfield.mean_form_factor(even, 1.0, -s, s, 4)(0.1 * s),
        "shadowfield.factoring_bound": shadowfield.factoring_bound(
            even, 1.0, -s, s, jnp.stack([s]), 8
        ),
        "shadowfield.shadow_irradiance": shadowfield.shadow_irradiance(
            behind, lamp, 1.0, -0.5, 0.5
        )(0.1 * s),
    }


def spectra(s):
    """Spectra of shadows."""
    g = Separable(jnp.stack([s]), (GaussianProfile(0.3, "y", PLANE),)).spectrum()
    window = Separable(jnp.zeros(1), (GaussianProfile(3.0, "v", Frame(("v",))),)).spectrum()
    F = gaussian((0.0, 0.0), (0.5 + s, 0.5), frame=TWO_PLANES).spectrum()
    samples = jnp.cos(s * jnp.arange(8.0))
    square = jnp.cos(s * jnp.arange(16.0)).reshape(4, 4)
    return {
        "shadowfield.blocker_spectrum": shadowfield.blocker_spectrum(g, 0.5, window)(s, 0.3),
        "shadowfield.two_plane_spectrum": shadowfield.two_plane_spectrum(F, 1.0 + s)(0.1, s),
        "shadowfield.ShadowSpectrum": shadowfield.ShadowSpectrum(F, light(s), 4.0, 16)(s),
        "shadowfield.PlanarShadowSpectrum": shadowfield.PlanarShadowSpectrum(g, light(s), 1.0, 0.5)(
            s
        ),
        "shadowfield.power_spectrum": shadowfield.power_spectrum(samples, Grid((8,), (0.5,))),
        "shadowfield.energy_outside": shadowfield.energy_outside(samples**2, jnp.arange(8) > 3),
        "shadowfield.zero_outside": shadowfield.zero_outside(square, jnp.eye(4) > 0.0),
        "shadowfield.shadow_harmonic": shadowfield.shadow_harmonic(
            1, 1.0 + s, 0.5, light(s), 1.0, 0.5
        ),
    }


def filters(s):
    """Filters, rates and bounds."""
    k = shadowfield.sheared_filter(1.0, 0.25, 0.3 + 0.3 * s, 2.0, 16.0 + s)
    corners = shadowfield.wedge_corners(1.0, 0.25, 0.3 + 0.3 * s, 8.0)
    rates = shadowfield.sampling_rates(k, corners)
    feet = jnp.stack([0.1 * s, -0.2, 0.3])
    return {
        "shadowfield.Wedge": shadowfield.Wedge(0.25, 0.3 + 0.3 * s).slopes(1.0),
        "shadowfield.RayFilter": (k.primal_matrix, k.kernel(0.1 * s, 0.2)),
        "shadowfield.sheared_filter": (k.width, k.shear),
        "shadowfield.axis_aligned_filter": shadowfield.axis_aligned_filter(s, 8.0).area,
        "shadowfield.reconstruct_irradiance": shadowfield.reconstruct_irradiance(
            k, GaussianProfile(0.3, "y", PLANE), jnp.stack([s]), (feet, feet, 1.0 + feet)
        ),
        "shadowfield.SamplingRates": rates.x,
        "shadowfield.sampling_rates": rates.y,
        "shadowfield.wedge_corners": corners,
        "shadowfield.receiver_rate": shadowfield.receiver_rate(k, corners),
        "shadowfield.light_rate": shadowfield.light_rate(k, corners),
        "shadowfield.light_rate_of_endless_wedge": shadowfield.light_rate_of_endless_wedge(
            1.0, 0.25, 0.3 + 0.3 * s, 2.0
        ),
        "shadowfield.samples_per_receiver": shadowfield.samples_per_receiver(k, rates),
        "shadowfield.average_occlusion_bound": shadowfield.average_occlusion_bound(
            s, 0.5, 1.0, 1.0, 0.5
        ),
        "shadowfield.coarsest_average_period": shadowfield.coarsest_average_period(
            0.1 * s, 0.5, 1.0, 1.0, 0.5
        ),
        "shadowfield.moire": shadowfield.moire(jnp.stack([s, 0.05]), 0.1 + s, 1.0, 0.25, 0.5),
        "shadowfield.moire_frequency": shadowfield.moire_frequency(0.5 + s, 1.0, 0.5, 0.75),
    }


def rays(s):
    """What rays see: whole numbers, which move with nothing, and the lengths that are seen."""
    ends = jnp.stack([0.4, 0.5]), jnp.stack([0.6 + s, 0.5])
    scene = flatland.Scene.of(flatland.primitive(flatland.Segments(*ends)))
    x = jnp.stack([0.1 * s, 0.5])
    return {
        "shadowfield.ray_visibility": s * shadowfield.ray_visibility(scene, x, 0.5),
        "shadowfield.ray_visibility_by_slope": s
        * shadowfield.ray_visibility_by_slope(scene, x, 0.0),
        "shadowfield.grid_visibility": s
        * shadowfield.grid_visibility(scene, Grid((2, 2), (0.5, 0.5))),
    }


def named(probe, *names):
    return dict.fromkeys((f"shadowfield.{name}" for name in names), probe)


PROBES = {
    **named(
        fields, "planar_blocker", "planar_blockers", "to_two_planes", "FormFactor",
        "mean_form_factor", "factoring_bound", "shadow_irradiance",
    ),
    **named(
        spectra, "blocker_spectrum", "two_plane_spectrum", "ShadowSpectrum",
        "PlanarShadowSpectrum", "power_spectrum", "energy_outside", "zero_outside",
        "shadow_harmonic",
    ),
    **named(
        filters, "Wedge", "RayFilter", "sheared_filter", "axis_aligned_filter",
        "reconstruct_irradiance", "SamplingRates", "sampling_rates", "wedge_corners",
        "receiver_rate", "light_rate", "light_rate_of_endless_wedge", "samples_per_receiver",
        "average_occlusion_bound", "coarsest_average_period", "moire", "moire_frequency",
    ),
    **named(rays, "ray_visibility", "ray_visibility_by_slope", "grid_visibility"),
}  # fmt: skip
