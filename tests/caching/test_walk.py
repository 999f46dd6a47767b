"""Everything that can be traced, compiled and differentiated in one number, in both precisions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._light import lamp
from firstorder import caching
from firstorder.caching import ellipses, radii
from firstorder.flatland import Scene, Segments, primitive

FLOOR = Segments((-1.0, 0.0), (1.0, 0.0))


def everything(s):
    """Results of every traceable export, by name; each depends on s."""
    near = jnp.stack([0.2 * s, -0.3 * s])
    lines = caching.EventLines(near[None], 2.0 * near[None] + 1.0, near[:1], near[1:])
    H = s * jnp.array([[2.0, 0.3], [0.3, -1.0]], jnp.asarray(s).dtype)
    return {
        "expected_error_with_events": caching.expected_error_with_events(s, [s], near, near),
        "radius_with_events": caching.radius_with_events([s], 0.1 * s, 0.01, 5.0, near, near),
        "EventLines": lines.end,
        "expected_error_with_lines": caching.expected_error_with_lines(s, s, near, lines),
        "radius_with_lines": caching.radius_with_lines(s, 0.1 * s, 0.01, 5.0, near, lines),
        "minimum_distance": caching.minimum_distance(jnp.stack([s, 2.0 * s])),
        "harmonic_mean_distance": caching.harmonic_mean_distance(jnp.stack([s, 2.0 * s])),
        "_weighted": caching.harmonic_mean_distance(jnp.stack([s, 3.0 * s]), jnp.stack([s, 1.0])),
        "elliptic_regions": caching.elliptic_regions(H, 0.02 * s, 0.05, 0.9).matrix,
        "gradient_regions": caching.gradient_regions(near, 0.2 * s, 0.05, 0.9).matrix,
        "semi_axes": caching.semi_axes(H, 0.02 * s)[0],
        "_principal": ellipses._principal(H)[0],
        "_positive_part": radii._positive_part(H),
        "geometric_bound": caching.geometric_bound(H[None], s),
        "largest_radiance": caching.largest_radiance(jnp.stack([s, 0.5 * s])),
        "split_change": caching.split_change(0.1 * s, s, 0.2 * s),
        "_split_change": caching.split_change(0.1 * s, s**2, dims=2),
        **in_dimensions(s, 1),
        **{f"_{name}": found for name, found in in_dimensions(s, 2).items()},
    }


def in_dimensions(s, d):
    """What is written once: along a line, and on a plane."""
    x = jnp.stack([jnp.stack([-0.5 + 0.1 * s, 0.1 * s])[:d], jnp.stack([0.4 * s, 0.3 + 0 * s])[:d]])

    def E(t):
        return s * lamp(t[0]) + s * jnp.sin(t[0] * t[-1] * s)

    some = caching.Candidates.from_function(E, x, derivatives=3, tilt=0.1 * x)
    H, T = some.derivative(2), some.derivative(3)
    size = caching.derivative_norm(H, 2, "mean")
    region = caching.circular_regions(caching.radius_for(size, 0.02 * s, dims=d), 0.01, 2.0, d)
    options = {"order": 2, "definition": "average squared"}
    return {
        "Candidates": H,
        "Cache": caching.Cache(some, region, order=2)(x + 0.07, 0.1 * x).value,
        "circular_regions": region.matrix,
        "ValidityRegion": region.radius,
        "derivative_norm": caching.derivative_norm(T, 3, "rms"),
        "taylor": caching.taylor(some.value, some.gradient, H, x, order=2),
        "expected_error": caching.expected_error(T, region, **options),
        "true_error": caching.true_error(E, some, region, nodes=4),
        "split_error": caching.split_error(0.1 * s, s**2, 0.2 * s, d),
        "split_radius": caching.split_radius(s**2, 0.2 * s, d),
    }


# On the host, or with answers that are not differentiated.
OTHERS = {
    "scene_candidates", "gradient_discontinuities", "Lookup", "CLAMPS", "DEFINITIONS", "fill",
    "Fit", "fit", "random_orders", "ideal_region", "rms", "radius_for", "floats_per_record",
    "largest_set", "ssim", "neighbour_clamping", "OcclusionTable", "occlusion_table",
    "CandidateTable", "tabulate_candidates", "GatherDirections", "gather_directions",
    "fill_surface",
    # On surfaces in space: with the walk over all packages.
    "SurfaceCache", "displacement", "hessian_along", "screen_limits",
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
        some = caching.scene_candidates(scene, 0, jnp.array([0.3]), derivatives=1, rays=8)
        return jnp.sum(some.value) + jnp.sum(some.gradient)

    slope = jax.jit(jax.jacfwd(summed))(1.0)
    assert np.isfinite(slope)
    assert slope != 0.0
