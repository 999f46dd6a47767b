import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.shadowfield.rendering import sample_counts as counts
from firstorder.shadowfield import (
    SamplingRates,
    light_rate,
    light_rate_of_endless_wedge,
    receiver_rate,
    replicas_overlap,
    samples_per_receiver,
    sampling_rates,
    sheared_filter,
    wedge_corners,
)
from firstorder.shadowfield.plane.filters import RayFilter

HIGH, PIX = 1.0, 16.0


def scene(near=1 / 3, far=2 / 3, Omega_g=6.0):
    """Slopes 1/2 and 2, unless said otherwise."""
    return sheared_filter(1.0, near, far, HIGH, PIX), wedge_corners(1.0, near, far, Omega_g)


def test_a_blockers_wave_stands_where_its_plane_says():
    corners = np.asarray(wedge_corners(1.0, 0.25, 0.5, 8.0))
    np.testing.assert_allclose(corners, [[0, 0], [2, 6], [4, 4]], rtol=0.0, atol=1e-12)


@pytest.mark.smoke
def test_the_rate_along_the_receiver_is_the_papers():
    k, corners = scene(Omega_g=6.0)
    assert abs(receiver_rate(k, corners) - (6.0 * 2 / 3 + HIGH / 0.5)) < 1e-12


def test_the_printed_rate_along_the_light_lets_replicas_in():
    """a = 1/2, b = 2: the printed rate clears one corner, the other needs four times as much."""
    k, corners = scene(Omega_g=60.0)
    x, a, b = receiver_rate(k, corners), 0.5, 2.0
    printed = HIGH * (1.0 - a / b)
    right = light_rate_of_endless_wedge(1.0, 1 / 3, 2 / 3, HIGH)
    assert abs(right - HIGH * (b / a - 1.0)) < 1e-12
    assert replicas_overlap(k, corners, SamplingRates(x, printed), 4)
    assert replicas_overlap(k, corners, SamplingRates(x, 0.99 * right), 4)
    assert not replicas_overlap(k, corners, SamplingRates(x, right), 4)


@given(st.floats(0.1, 0.4), st.floats(0.05, 0.4), st.floats(0.5, 12.0))
def test_both_rates_keep_replicas_off_and_less_does_not(near, more, Omega_g):
    k, corners = scene(near, near + more, Omega_g)
    rates = SAMPLING(near, near + more, Omega_g)
    assert not replicas_overlap(k, corners, SamplingRates(1.0001 * rates.x, 1.0001 * rates.y), 3)
    assert replicas_overlap(k, corners, SamplingRates(1e6, 0.99 * rates.y), 3)


SAMPLING = jax.jit(lambda near, far, Omega_g: sampling_rates(*scene(near, far, Omega_g)))


def test_less_along_the_receiver_fails_for_some_rate_along_the_light():
    """A replica that is also slid along Omega_y to where the two extreme points are level."""
    k, corners = scene()
    rate = float(receiver_rate(k, corners))
    extreme = corners[np.argmax(corners[:, 0])]  # the wedge's tip, mirrored, meets the filter's
    slide = HIGH + float(extreme[1])
    assert replicas_overlap(
        k, corners, SamplingRates(0.97 * rate, slide / 1.0), 2
    ) or replicas_overlap(k, corners, SamplingRates(0.97 * rate, slide / 2.0), 3)
    assert not replicas_overlap(k, corners, SamplingRates(1.001 * rate, 1e6), 2)


def test_coarse_blockers_need_fewer_rays():
    endless = light_rate_of_endless_wedge(1.0, 1 / 3, 2 / 3, HIGH)
    rates = [float(SAMPLING(1 / 3, 2 / 3, g).y) for g in (0.5, 1.0, 2.0, 6.0, 60.0)]
    assert np.all(np.diff(rates) >= -1e-12)
    assert rates[0] < 0.6 * endless
    assert abs(rates[-1] - endless) < 1e-9


def test_the_count_has_no_unit():
    """All lengths ten times as long, all frequencies a tenth: the same number of rays."""
    counts = []
    for s in (1.0, 10.0):
        k = sheared_filter(s, s / 3, 2 * s / 3, HIGH / s, PIX / s)
        corners = wedge_corners(s, s / 3, 2 * s / 3, 6.0 / s)
        counts.append(float(samples_per_receiver(k, sampling_rates(k, corners))))
    assert abs(counts[0] / counts[1] - 1.0) < 1e-12
    assert counts[0] >= 1.0  # no lattice packs replicas denser than the filter is large


def test_a_rate_that_takes_one_corner_for_both_is_seen():
    k, corners = scene(Omega_g=60.0)
    wrong = float(light_rate(k, np.abs(corners))) * 0.25
    assert np.isfinite(wrong)
    assert replicas_overlap(k, corners, SamplingRates(receiver_rate(k, corners), wrong), 4)


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `Omega_y_max` must be positive, but is 0.0.$"):
        light_rate_of_endless_wedge(1.0, 0.3, 0.6, 0.0)
    with pytest.raises(ValueError, match=r"^Argument `Omega_g` must be positive, but is -1.0.$"):
        wedge_corners(1.0, 0.3, 0.6, -1.0)
    with pytest.raises(
        ValueError, match=r"^Argument `d1` must be greater than `d2_max` = 0.5, but"
    ):
        light_rate_of_endless_wedge(0.4, 0.25, 0.5, 1.0)


def test_among_the_blockers_no_traced_rate_is_a_number():
    rate = jax.jit(light_rate_of_endless_wedge)
    assert np.isnan(rate(0.4, 0.25, 0.5, 1.0))
    assert np.isnan(rate(0.5, 0.25, 0.5, 1.0))
    assert np.isnan(rate(1.0, 0.25, 0.5, -1.0))
    assert rate(1.0, 0.25, 0.5, 1.0) == light_rate_of_endless_wedge(1.0, 0.25, 0.5, 1.0)


def test_a_line_of_energy_overlaps_what_it_runs_through():
    k, _ = scene()
    for depth in (0.4, 0.5, 0.6):
        line, thin = (wedge_corners(1.0, depth, more * depth, 6.0) for more in (1.0, 1.000001))
        for rates in (SamplingRates(1.0, 1.0), SamplingRates(100.0, 2.0), SamplingRates(1e3, 1e3)):
            assert replicas_overlap(k, line, rates, 3) == replicas_overlap(k, thin, rates, 3)
    enough = sampling_rates(k, line)
    assert not replicas_overlap(k, line, enough, 3)
    assert replicas_overlap(k, line, SamplingRates(1e6, 0.99 * enough.y), 3)


def test_sets_that_touch_do_not_overlap_in_single_precision():
    depths = np.sort(np.random.default_rng(0).uniform(0.1, 0.9, (20, 2)), 1).tolist()
    with jax.enable_x64(False):
        for near, far in depths:
            k = sheared_filter(1.0, near, far, 2.0, 16.0)
            corners = wedge_corners(1.0, near, far, 8.0)
            assert corners.dtype == np.float32
            assert not replicas_overlap(k, corners, sampling_rates(k, corners), 4)


def test_counted_samples_notice_an_area_that_is_doubled(monkeypatch):
    assert counts.ours_against_counting() < 0.02
    plain = RayFilter.area.fget
    assert plain is not None
    monkeypatch.setattr(RayFilter, "area", property(lambda own: 2.0 * plain(own)))
    assert counts.ours_against_counting() > 0.3


def test_a_wedge_has_three_corners():
    k, wrong = sheared_filter(1.0, 0.25, 0.5, 2.0, 16.0), np.ones((2, 3))
    words = r"`corners` must have shape \(3, 2\)|violates type hint"
    for ask in (receiver_rate, light_rate, sampling_rates):
        with pytest.raises((ValueError, TypeError), match=words):
            ask(k, wrong)


@pytest.mark.parametrize("wrong", [-1.0, np.nan, np.inf])
def test_rates_are_not_negative(wrong):
    with pytest.raises(ValueError, match=r"^Argument `y` must not be negative, but is"):
        SamplingRates(1.0, wrong)
    with pytest.raises((ValueError, TypeError), match=r"`x` must be real|type hint"):
        SamplingRates(1j, 1.0)
    with pytest.raises((ValueError, TypeError), match=r"`x` must be one number|type hint"):
        SamplingRates(np.ones(2), 1.0)
