"""Probes of flatland's parts: reflected light, samples of a hemicircle, its library."""

import jax
import jax.numpy as jnp

from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Grid
from firstorder.flatland import (
    Receiver,
    Scene,
    Segments,
    bounces,
    discontinuities,
    estimators,
    library,
    light_field,
    light_fields,
    primitive,
)
from tests.probes.flatland import above, shadowed


def scaled(s, tree):
    """A scene whose numbers are constants, times a number: what it was built in shows."""
    leaves = [leaf for leaf in jax.tree.leaves(tree) if jnp.issubdtype(leaf.dtype, jnp.floating)]
    return [s * leaf for leaf in leaves]


def scenes(s):
    """The scenes of the library, by the number that they are made from where there is one."""
    grounds = library.SineBumps(0.1 * s, 1.0), library.ChirpBumps(0.5 * s, 1.0, 2.0)
    return {
        "flatland.library.scene_a": library.scene_a(s).material.emission,
        "flatland.library.scene_b": library.scene_b(s).material.emission,
        "flatland.library.scene_c": library.scene_c(s, 2.0 * s).material.albedo,
        "flatland.library.scene_d": library.scene_d(s, 2.0 * s, 0.1 * s).groups,
        "flatland.library.fig14": scaled(s, library.fig14()),
        "flatland.library.fig15": library.fig15(s).material.albedo,
        "flatland.library.r07_fig09": scaled(s, library.r07_fig09()),
        "flatland.library.r07_fig16": scaled(s, library.r07_fig16(24)),
        "flatland.library.r07_fig17": scaled(s, library.r07_fig17(24)),
        "flatland.library.SineBumps": grounds[0].height(s),
        "flatland.library.ChirpBumps": grounds[1].heights(s),
        "flatland.library.bumpy_ground": library.bumpy_ground(grounds[0], -1.0, 1.0, 4),
    }


def gathered(s):
    """Rays through the strata of a hemicircle, and derivatives that are made of them."""
    scene, at = shadowed(s), above(s)
    where = estimators.hemicircle_strata(4, jax.random.key(0))
    rays = estimators.trace_strata(scene, at, where=where)
    share = jnp.full((2, 3), 1.0 / 3.0)
    return {
        "flatland.estimators.Strata": s * where.weights,
        "flatland.estimators.hemicircle_strata": s * where.angles,
        "flatland.estimators.gap_quadrature": estimators.gap_quadrature(jnp.stack([-s, 0.1, s]), 4),
        "flatland.estimators.Samples": (rays.radiance, rays.cosine),
        "flatland.estimators.trace_strata": (rays.normal, rays.s),
        "flatland.estimators.arc_length_estimate": estimators.arc_length_estimate(rays),
        "flatland.estimators.stratified_estimate": estimators.stratified_estimate(rays),
        "flatland.estimators.arc_length_sum": estimators.arc_length_sum(
            scene, at, s=0.1 + share * s, weights=share
        ),
        "flatland.discontinuities.extrapolation_error": discontinuities.extrapolation_error(
            s, 2.0 * s, 0.5, 1.5
        ),
    }


def integrated(s):
    """The arc-length form by quadrature, and the one that knows of edges."""
    scene, at = shadowed(s), above(s)
    where = estimators.hemicircle_strata(4)
    rays = estimators.trace_strata(scene, at, where=where)
    return {
        "flatland.estimators.arc_length_integral": estimators.arc_length_integral(
            scene, at, nodes=4
        ),
        "flatland.estimators.corrected_estimate": estimators.corrected_estimate(
            scene, at, samples=rays, breaks=2, halvings=4
        ),
    }


def traced(s):
    """Paths and photons: drawn, so that no derivative comes from them; the map has a place."""
    with jax.ensure_compile_time_eval():
        scene, key = library.scene_c(), jax.random.key(0)
    at = Receiver(jnp.stack([jnp.stack([0.3 + 0.2 * s, 0.0])]), jnp.zeros(1), jnp.zeros(1, int))
    ray = jnp.stack([jnp.stack([s, 0.5])]), jnp.array([[0.0, -1.0]]) + 0.0 * s
    photons, how = bounces.trace_photons(scene, key, 32, 1), bounces.DensityEstimator(k=4)
    with jax.ensure_compile_time_eval():  # sorted on the host
        mapped = bounces.photon_map(scene, bounces.trace_photons(scene, key, 32, 1))
    where = jnp.array([0]), jnp.array([True]), jnp.stack([s])
    out = jnp.stack([0.6 * s / s]), jnp.stack([0.8 * s / s])
    return {
        "flatland.bounces.path_irradiance": bounces.path_irradiance(
            scene, at, key=key, paths=4, bounces=1, lanes=4
        ).mean,
        "flatland.bounces.path_radiance": bounces.path_radiance(
            scene, *ray, key=key, paths=4, bounces=1, lanes=4
        ).mean,
        "flatland.bounces.tree_irradiance": bounces.tree_irradiance(
            scene, at, key=key, branches=(2,), runs=2
        ).mean,
        "flatland.bounces.Photons": s * photons.flux,
        "flatland.bounces.trace_photons": s * photons.s,
        "flatland.bounces.DensityEstimator": s * how.excess,
        "flatland.bounces.photon_irradiance": bounces.photon_irradiance(mapped, how, *where),
        "flatland.bounces.photon_radiance": bounces.photon_radiance(
            mapped, how, lambda out, into: s + 0.0 * into[0], *where, out
        ),
        "flatland.bounces.final_gather": bounces.final_gather(
            scene, at, photons=mapped, how=how, rays=4
        ),
    }


def windowed(s):
    """The spectrum of a lamp's light in a window, as sums over its edges."""
    lamp = Segments(jnp.stack([1.0, 2.0]), jnp.stack([-1.0, 2.0 + 0.1 * s]))
    line = Receiver((0.0, 0.0), 0.0)
    light = light_field(Scene.of(primitive(lamp, emission=s)), line, frame=FLATLAND_SLOPE)
    window = Grid.spanning((8, 8), (5.0, 1.0))
    return {
        "flatland.light_fields.spectrum_in": light_fields.spectrum_in(light, window)(0.1 * s, 0.2),
        "flatland.light_fields.series_in": light_fields.series_in(light, window).coefficients,
    }


def named(folder, probe, *names):
    return dict.fromkeys((f"flatland.{folder}.{name}" for name in names), probe)


PROBES = {
    **named(
        "library", scenes, "scene_a", "scene_b", "scene_c", "scene_d", "fig14", "fig15",
        "r07_fig09", "r07_fig16", "r07_fig17", "SineBumps", "ChirpBumps", "bumpy_ground",
    ),
    **named(
        "estimators", gathered, "Strata", "hemicircle_strata", "gap_quadrature", "Samples",
        "trace_strata", "arc_length_estimate", "stratified_estimate", "arc_length_sum",
    ),
    **named("discontinuities", gathered, "extrapolation_error"),
    **named("estimators", integrated, "arc_length_integral", "corrected_estimate"),
    **named(
        "bounces", traced, "path_irradiance", "path_radiance", "tree_irradiance", "Photons",
        "trace_photons", "DensityEstimator", "photon_irradiance",
        "photon_radiance", "final_gather",
    ),
    **named("light_fields", windowed, "spectrum_in", "series_in"),
}  # fmt: skip
