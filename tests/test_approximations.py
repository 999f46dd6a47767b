"""Errors that come with answers are bounds, and no more than some times the true errors."""

import dataclasses
import inspect

import numpy as np
import pytest

from tests.approximations import CASES, hessians_behind_kinks, judged, measured
from tests.documentation import names


@pytest.mark.parametrize("name", CASES)
def test_the_error_is_a_bound_and_not_far_above_the_true_one(name):
    found = measured(name)
    assert found.size >= 100
    assert found.clear > 0.2
    assert found.bound >= 0.99
    assert 1.0 < found.ratio <= 10.0


def test_a_second_derivative_behind_a_kink_that_nobody_declared_has_no_bound():
    """As the docstring of `Approximation` warns: it lacks a Dirac, for any number of nodes."""
    assert judged(*hessians_behind_kinks(np.random.default_rng(0))).bound < 0.95


def test_an_error_that_is_too_small_or_too_large_is_seen():
    truth = np.linspace(1.0, 2.0, 100)
    value, error = truth + 1e-3, np.full(100, 4e-3)
    assert judged(value, error, truth).bound == 1.0
    assert judged(value, 0.01 * error, truth).bound == 0.0
    assert judged(value, 3.0 * error, truth).ratio > 10.0


# --- who tells ---------------------------------------------------------------------------------

# Arguments that say how finely something is computed.
COUNTS = {"nodes", "inner", "turns", "window", "fineness", "samples", "azimuths"}
# What takes one of them and tells no error, by the reason.
UNTOLD = {
    "its field or spectrum tells": (
        "shadowfield.mean_form_factor", "shadowfield.shadow_irradiance", "symbolic.FactorEvent",
        "symbolic.event", "transport.AngularFactor", "transport.Cosine", "transport.Gather",
        "transport.DifferentialIrradiance", "transport.Occlusion", "transport.PlanarBlockers",
        "transport.Reflection", "transport.Texture", "transport.comb_blocker", "transport.diffuse",
        "transport.fresnel_reflection", "transport.grating_blocker",
        "transport.half_plane_blocker", "transport.pit_blockers", "transport.refraction",
        "transport.separable", "transport.slit_blocker",
    ),
    "exact: the window is part of the question": (
        "flatland.light_fields.series_in", "flatland.light_fields.spectrum_in",
        "shadowfield.blocker_spectrum",
    ),
    "of samples that are given: nothing finer is known": (
        "fields.SampledSpectrum", "fields.covariance_of_samples", "fields.discrete_transform",
        "reconstruction.HermiteInterpolant", "reconstruction.quadtree_image",
        "shadowfield.power_spectrum",
        "shadowfield.reconstruct_irradiance", "shadowfield.zero_outside",
    ),
    "of samples: an `Estimate`, or one sample of a `RepeatedEstimate`": (
        "checks.sampler_p_value", "flatland.estimators.arc_length_estimate",
        "flatland.estimators.corrected_estimate", "flatland.estimators.stratified_estimate",
        "sampling.estimate", "space.estimators.stratified_estimate",
        "space.estimators.surface_area_estimate",
    ),
    "a rule, and no answer": (
        "flatland.bounces.Discretization", "flatland.estimators.gap_quadrature",
        "space.VisibleSilhouettes",
    ),
    "found by search: counts bracket, and roots are then right to rounding": (
        "flatland.Caustic", "flatland.Curves", "flatland.closed_curve", "shadowfield.depth_range",
        "caching.ideal_region",
    ),
    "another meaning: how a normal turns from pixel to pixel": (
        "bandwidth.screen_diffuse_bandwidth", "bandwidth.screen_glossy_bandwidth",
    ),
    "its error is the filter's, not the nodes'": ("shadowfield.sheared_reflection",),
    "pictures, tables and commands": (
        "checks.agreements.Sizes", "cli.Render", "cli.Scene", "plotting.curve_of",
        "plotting.receiver_curve", "rendering.light_rig", "rendering.world_from_scene",
    ),
}  # fmt: skip


def silent():
    """Public names that take a count and tell no error."""
    for name in names():
        thing = name.thing
        if inspect.isclass(thing):
            fields = dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ()
            counts = COUNTS - set(getattr(thing, "REFINED", ()))
            if counts & {field.name for field in fields}:
                yield name.name.removeprefix("firstorder.")
        elif thing is not None:
            arguments = set(inspect.signature(thing).parameters)
            if arguments & COUNTS and "with_error" not in arguments:
                yield name.name.removeprefix("firstorder.")


def test_whoever_takes_a_count_tells_its_error_or_has_a_reason():
    excused = [name for reason in UNTOLD.values() for name in reason]
    assert len(excused) == len(set(excused))
    assert sorted(silent()) == sorted(excused)
