"""Probes of caches: what records hold, how far they reach, and what they say."""

import jax
import jax.numpy as jnp

from firstorder import caching, flatland, space
from firstorder.imaging import pinhole


def held(s):
    """Two records on a plane."""
    at = jnp.stack([jnp.stack([0.1 * s, 0.0]), jnp.stack([0.7, s])])
    slopes = jnp.stack([at, 2.0 * at])
    return caching.Candidates.of(at, jnp.stack([s, 2.0]), at, slopes.swapaxes(0, 1))


def on_line(s):
    """Two records along a line, with derivatives up to the third."""
    x = jnp.stack([0.0 * s, 0.5 + s])
    return caching.Candidates.on_line(x, jnp.stack([jnp.cos(x + s), -x, x * s, 0.3 + x], -1))


def records(s):
    """What is done with records and the regions in which they count."""
    some, line, H = held(s), on_line(s), jnp.stack([s * jnp.eye(2), jnp.diag(jnp.stack([2.0, -s]))])
    region = caching.elliptic_regions(H, 0.1 + s, 0.05, 1.5)
    answer = caching.Cache(some, region, 2)(jnp.stack([0.2, 0.1 * s]))
    return {
        "caching.Candidates": line.third,
        "caching.Cache": answer.value,
        "caching.Lookup": (answer.value, answer.covered),
        "caching.ValidityRegion": region.radius,
        "caching.circular_regions": caching.circular_regions(some.value, 0.1, 1.0, dims=2).matrix,
        "caching.elliptic_regions": region.matrix,
        "caching.semi_axes": caching.semi_axes(H, 0.1 + s),
        "caching.derivative_norm": caching.derivative_norm(H, 2, "mean"),
        "caching.expected_error": caching.expected_error(H, region),
        "caching.geometric_bound": caching.geometric_bound(H),
        "caching.radius_for": caching.radius_for(some.value, 0.1 * s),
        "caching.largest_radiance": caching.largest_radiance(some.value),
        "caching.taylor": caching.taylor(
            some.value, some.gradient, some.hessian, jnp.stack([s, 0.2]), 2
        ),
        "caching.true_error": caching.true_error(
            lambda x: jnp.exp(s * x), line, caching.ValidityRegion(jnp.ones((2, 1, 1)) / s), nodes=8
        ),
    }


def lengths(s):
    """Regions from the lengths of rays, from events along a line, and from lines on a plane."""
    rays, at, jumps = jnp.stack([s, 1.0, 2.0 * s]), jnp.stack([0.1 - s]), jnp.stack([1.0 + s])
    place, start = jnp.stack([0.2 * s, 0.1]), jnp.stack([0.3 * s, -1.0])[None]
    lines = caching.EventLines(start, start + jnp.array([0.1, 2.0]), jumps, 0.5 * jumps)
    return {
        "caching.minimum_distance": caching.minimum_distance(rays),
        "caching.harmonic_mean_distance": caching.harmonic_mean_distance(rays),
        "caching.split_error": caching.split_error(s, 1.0 + s, 0.1 * s),
        "caching.split_radius": caching.split_radius(s, 0.1 * s, dims=2),
        "caching.split_change": caching.split_change(s, 1.0 + s, 0.1 * s),
        "caching.expected_error_with_events": caching.expected_error_with_events(
            1.0 + s, [s], at, jumps
        ),
        "caching.radius_with_events": caching.radius_with_events([s], 0.2, 0.01, 2.0, at, jumps),
        "caching.EventLines": lines,
        "caching.expected_error_with_lines": caching.expected_error_with_lines(
            1.0 + s, s, place, lines
        ),
        "caching.radius_with_lines": caching.radius_with_lines(s, 0.2, 0.01, 2.0, place, lines),
    }


def on_surfaces(s):
    """A record below a lamp, asked beside it, and the radii that a camera allows."""
    lamp = space.sphere((0.0, 0.0, 3.0), 1.0)
    scene = space.Scene.of(space.primitive(lamp, emission=s))
    at = space.Receiver.at(jnp.stack([jnp.stack([0.1 * s, 0.0, 1.0])]))
    beside = space.Receiver.at(jnp.stack([0.1 * s, 0.2, 0.95]), jnp.stack([0.1 * s, 0.1, 1.0]))
    found = jax.vmap(lambda at: space.derivatives(space.irradiance, scene, at))(at)
    with jax.ensure_compile_time_eval():
        camera = pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), gamma=2.0)
    return {
        "caching.SurfaceCache": caching.SurfaceCache(at, found, jnp.stack([s]), order=2)(beside),
        "caching.displacement": caching.displacement(at, beside),
        "caching.hessian_along": caching.hessian_along(found, s * jnp.eye(2)),
        "caching.screen_limits": caching.screen_limits(camera, at.position, 0.01),
        "caching.gradient_regions": caching.gradient_regions(
            found.gradient[:, :2], s, 0.05, 1.5
        ).matrix,
    }


def below(s):
    """Records on a floor below a lamp."""
    floor = flatland.primitive(flatland.Segments((-1.0, 0.0), (1.0, 0.0)))
    lamp = flatland.primitive(
        flatland.Segments(jnp.stack([0.5, 1.0]), jnp.stack([-0.5, 1.0 + s])), emission=s
    )
    scene = flatland.Scene.of(floor, lamp)
    return caching.scene_candidates(scene, 0, jnp.stack([0.3 + 0.1 * s]), derivatives=1, rays=8)


PROBES = {
    **dict.fromkeys(
        (
            "caching.Candidates", "caching.Cache", "caching.Lookup", "caching.ValidityRegion",
            "caching.circular_regions", "caching.elliptic_regions", "caching.semi_axes",
            "caching.derivative_norm", "caching.expected_error", "caching.geometric_bound",
            "caching.radius_for", "caching.largest_radiance", "caching.taylor",
            "caching.true_error",
        ),
        records,
    ),
    **dict.fromkeys(
        (
            "caching.minimum_distance", "caching.harmonic_mean_distance", "caching.split_error",
            "caching.split_radius", "caching.split_change", "caching.expected_error_with_events",
            "caching.radius_with_events", "caching.EventLines",
            "caching.expected_error_with_lines", "caching.radius_with_lines",
        ),
        lengths,
    ),
    **dict.fromkeys(
        (
            "caching.SurfaceCache", "caching.displacement", "caching.hessian_along",
            "caching.screen_limits", "caching.gradient_regions",
        ),
        on_surfaces,
    ),
    "caching.scene_candidates": below,
}  # fmt: skip
