"""Everything that can be traced, compiled and differentiated in one number, in both precisions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._light import lamp
from firstorder import caching
from firstorder.caching import cache, ellipses
from firstorder.flatland import Scene, Segments, primitive

FLOOR = Segments((-1.0, 0.0), (1.0, 0.0))


def everything(s):
    """Results of every traceable export, by name; each depends on s."""
    x = jnp.stack([-0.5 + 0.1 * s, 0.1 * s, 0.5])
    some = caching.Candidates.along(lambda t: s * lamp(t), x)
    h = some.derivatives[:, 2]
    radii = caching.clamped(caching.radius_for(h, 0.02 * s), 0.05, 0.9)
    table = (x, 0.0 * x, some.derivatives, radii.radius, radii.clamp)
    near = jnp.stack([0.2 * s, -0.3 * s])
    start = some.derivatives[1]
    return {
        "Candidates": some.derivatives,
        "Cache": caching.Cache(*table, order=2)(x + 0.07).value,
        "clamped": radii.radius,
        "taylor": caching.taylor(some.derivatives, s, order=2),
        "_derivatives_of": cache._derivatives_of(lambda t: s * lamp(t), 0.2 * s, 3),
        "expected_error": caching.expected_error(h, s, definition="average squared"),
        "expected_error_with_events": caching.expected_error_with_events(s, [s], near, near),
        "radius_with_events": caching.radius_with_events([s], 0.1 * s, 0.01, 5.0, near, near),
        "split_circle_error": caching.split_circle_error(0.1 * s, s, 0.2 * s),
        "split_circle_change": caching.split_circle_change(0.1 * s, s, 0.2 * s),
        "minimum_distance": caching.minimum_distance(jnp.stack([s, 2.0 * s])),
        "harmonic_mean_distance": caching.harmonic_mean_distance(jnp.stack([s, 2.0 * s])),
        "true_error": caching.true_error(lambda t: lamp(t), 0.1 * s, start, 0.2 * s),
        **on_surfaces(s),
    }


def on_surfaces(s):
    """The same of those in space."""
    x = jnp.stack([jnp.stack([-0.5 + 0.1 * s, 0.1 * s]), jnp.stack([0.4 * s, 0.3])])
    some = caching.SurfaceCandidates.on(lambda t: s * jnp.sin(t[0] + t[0] * t[1] * s), x)
    H = some.hessian
    reach = caching.elliptic_regions(H, 0.02 * s, 0.05, 0.9)
    parts = (some.position, some.value, some.gradient, H)
    T = s * jnp.stack([H, 2.0 * H], axis=1)[0]
    return {
        "SurfaceCandidates": H,
        "SurfaceCache": caching.SurfaceCache(*parts, *reach, order=2)(x + 0.07).value,
        "surface_taylor": caching.surface_taylor(*(p[0] for p in parts[1:]), x[1], order=2),
        "circular_regions": caching.circular_regions(
            caching.radius_for(s, 0.1 * s, dims=2), 0.05, 0.9
        ).matrix,
        "elliptic_regions": reach.matrix,
        "hessian_norm": caching.hessian_norm(H, "mean"),
        "third_derivative_norm": caching.third_derivative_norm(T),
        "_principal": ellipses._principal(H)[0],
        "semi_axes": caching.semi_axes(H, 0.02 * s)[0],
        "_positive_part": ellipses._positive_part(H),
        "geometric_bound": caching.geometric_bound(H, s),
        "largest_radiance": caching.largest_radiance(jnp.stack([s, 0.5 * s])),
        "split_sphere_error": caching.split_sphere_error(0.1 * s, s**2, 0.2 * s),
        "split_sphere_change": caching.split_sphere_change(0.1 * s, s**2),
        "weighted_harmonic_length": caching.weighted_harmonic_length(
            jnp.stack([s, 3.0 * s]), jnp.stack([s, 1.0])
        ),
        "surface_expected_error": caching.surface_expected_error(H, reach.matrix),
        "surface_error": caching.surface_error(
            lambda t: jnp.sum(t**4), *(p[0] for p in parts), reach.matrix[0], nodes=4
        ),
    }


# On the host, or with answers that are not differentiated.
OTHERS = {
    "scene_candidates", "gradient_discontinuities", "Lookup", "Clamped", "CLAMPS", "DEFINITIONS",
    "fill", "Fit", "fit", "interpolate", "random_orders", "ideal_radius", "rms", "radius_for",
    "ValidityRegion", "SurfaceFit", "fill_surface", "fit_surface", "floats_per_record",
    "ideal_ellipse", "largest_set", "ssim", "neighbour_clamping", "OcclusionTable",
    "occlusion_table", "CandidateTable", "tabulate_candidates", "GatherDirections",
    "gather_directions",
}  # fmt: skip


def test_every_export_is_walked():
    found = {name for name in jax.eval_shape(everything, 1.0) if not name.startswith("_")}
    assert found | OTHERS == set(caching.__all__)
    assert not found & OTHERS


@pytest.mark.smoke
@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_compiled_and_differentiated_in_both_precisions(dtype):
    both = jax.jit(
        lambda s: jax.jvp(everything, (s,), (jnp.ones_like(s),)),
        compiler_options={"xla_backend_optimization_level": 0},  # it runs once
    )
    value, slope = both(dtype(1.3))
    for name, number in value.items():
        assert number.dtype == dtype, name
        assert np.all(np.isfinite(number)), name
        assert np.all(np.isfinite(slope[name])), name
        assert np.any(slope[name] != 0.0), name


def test_a_survey_is_differentiable_in_the_scene():
    def summed(y):
        ends = [jnp.stack([x + 0.0 * y, y]) for x in (0.5, -0.5)]
        scene = Scene.of(primitive(FLOOR), primitive(Segments(*ends), emission=1.0))
        return jnp.sum(
            caching.scene_candidates(scene, 0, jnp.array([0.3]), count=2, rays=8).derivatives
        )

    slope = jax.jit(jax.jacfwd(summed))(1.0)
    assert np.isfinite(slope)
    assert slope != 0.0
