"""Two layers of blockers with a filter each: which rule puts them together right."""

import numpy as np
import pytest

from firstorder.shadowfield.rendering import layers as module
from firstorder.shadowfield.rendering.layers import _split_at_depth, layered_shadow
from firstorder.shadowfield.rendering.ray_table import RayTable, trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow
from tests.shadowfield.cards import HIGH, LAMP, PIXEL, bad_receivers, cards, floor

SIDE = 32
X = np.arange(-3.0, 3.0, 0.3)
INNER = np.zeros((SIDE, SIDE), bool)
INNER[8:-8, 8:-8] = True
PLACES = 0.8 * ((2.0 * np.arange(512) + 1.0) / 512 - 1.0)


def bars(z, axis):
    if axis == 0:
        return tuple((z, (x, -9.0), (x + 0.13, 9.0)) for x in X)
    return tuple((z, (-9.0, x), (9.0, x + 0.13)) for x in X)


PARALLEL = bars(2.8, 0) + bars(1.0, 0)
CROSSED = bars(2.8, 0) + bars(1.0, 1)


def free(x, z):
    """Along one axis: which places on the lamp the bars at a height leave to a receiver."""
    p = x * (1.0 - z / HIGH) + PLACES * z / HIGH
    return ~np.any((p[:, None] >= X) & (p[:, None] <= X + 0.13), 1)


def truth(crossed):
    """By the lamp's places one by one: of crossed bars it is a product, of parallel ones not."""
    R = floor(SIDE)
    upper = {x: free(x, 2.8) for x in np.unique(R[:, :2])}
    lower = {x: free(x, 1.0) for x in np.unique(R[:, :2])}
    if crossed:
        return np.array([upper[x].mean() * lower[y].mean() for x, y, _ in R])
    return np.array([(upper[x] & lower[x]).mean() for x, _, _ in R])


def error(rule, crossed, rays, Omega=1.5):
    R = floor(SIDE)
    table, _ = trace_shadow_rays(LAMP, R, rays, cards(*(CROSSED if crossed else PARALLEL)))
    if rule == "one filter":
        found = sheared_shadow(LAMP, table, R, Omega, PIXEL, np.zeros(len(R))).visible
    else:
        found = layered_shadow(LAMP, table, R, 2.0, Omega, PIXEL, rule)
    return np.sqrt(np.mean((found - truth(crossed))[INNER.ravel()] ** 2))


@pytest.mark.smoke
@pytest.mark.parametrize("crossed", [False, True])
def test_two_filters_beat_one(crossed):
    assert error("covariance", crossed, 1) < 0.75 * error("one filter", crossed, 1)


def test_a_product_takes_parallel_bars_for_crossed_ones():
    """Its error stays however many rays there are; that of the covariance falls."""
    assert error("product", False, 16) > 0.8 * error("product", False, 1)
    assert error("covariance", False, 16, 4.0) < 0.6 * error("covariance", False, 1, 4.0)
    assert error("covariance", False, 16, 4.0) < 0.85 * error("product", False, 16, 4.0)


def test_a_minimum_takes_crossed_bars_for_nested_ones():
    assert error("minimum", True, 4) > 3.0 * error("covariance", True, 4)


@pytest.mark.parametrize("depth", [0.5, 3.5])
def test_where_all_blockers_are_in_one_layer_there_is_one_filter(depth):
    """Bars at two heights, so that the nearest and the farthest differ; the other layer is free."""
    R = floor(SIDE)
    table, _ = trace_shadow_rays(LAMP, R, 2, cards(*bars(1.0, 0), *bars(2.8, 1)))
    found = layered_shadow(LAMP, table, R, depth, 1.5, PIXEL)
    one = sheared_shadow(LAMP, table, R, 1.5, PIXEL, np.zeros(len(R))).visible
    np.testing.assert_allclose(found[INNER.ravel()], one[INNER.ravel()], rtol=1e-12)


@pytest.mark.parametrize("rule", ["covariance", "product", "minimum"])
def test_receivers_that_no_lamp_can_light_are_nan_and_alone(rule):
    table, _ = trace_shadow_rays(LAMP, floor(SIDE), 1, cards(*PARALLEL))
    receivers, bad = bad_receivers(floor(SIDE))
    right = layered_shadow(LAMP, table, floor(SIDE), 2.0, 1.5, PIXEL, rule)
    found = layered_shadow(LAMP, table, receivers, 2.0, 1.5, PIXEL, rule)
    assert np.all(np.isnan(found[bad]))
    np.testing.assert_array_equal(np.delete(found, bad), right)


@pytest.mark.parametrize("rule", ["covariance", "product", "minimum"])
def test_among_the_blockers_nothing_is_known(rule):
    """Two sheets hide everything, one of them 2 cm above the floor: no light, and none is made up.

    Where no blocker is known the answer is light, and where the lower sheet ends it is dark.
    """
    wide = (-9.0, -9.0), (9.0, 9.0)
    table, _ = trace_shadow_rays(LAMP, floor(SIDE), 2, cards((0.02, *wide), (2.8, *wide)))
    assert np.all(np.isnan(layered_shadow(LAMP, table, floor(SIDE), 2.0, 1.5, PIXEL, rule)))
    table, _ = trace_shadow_rays(LAMP, floor(SIDE), 2, cards((0.02, *wide)))
    assert np.all(np.isnan(layered_shadow(LAMP, table, floor(SIDE), 2.0, 1.5, PIXEL, rule)))
    table, _ = trace_shadow_rays(LAMP, floor(SIDE), 2, cards())
    np.testing.assert_array_equal(
        layered_shadow(LAMP, table, floor(SIDE), 2.0, 1.5, PIXEL, rule), 1.0
    )
    table, _ = trace_shadow_rays(LAMP, floor(SIDE), 2, cards((1.0, *wide), (2.8, *wide)))
    np.testing.assert_array_equal(
        layered_shadow(LAMP, table, floor(SIDE), 2.0, 1.5, PIXEL, rule), 0.0
    )


def test_split_rays_are_hidden_by_either_layer():
    table, _ = trace_shadow_rays(LAMP, floor(SIDE), 2, cards(*PARALLEL))
    upper, lower = _split_at_depth(table, 2.0)
    np.testing.assert_array_equal(table.free, upper.free & lower.free)
    assert np.all(upper.far < 2.0)
    assert np.all(lower.near >= 2.0)
    whole = _split_at_depth(table, 100.0)
    np.testing.assert_array_equal(whole.upper.far, table.far)
    assert np.all(whole.lower.free)
    assert isinstance(upper, RayTable)


def test_a_fault_is_noticed(monkeypatch):
    """Layers told apart at a depth above both: all blockers are one layer."""
    right = error("covariance", True, 1)
    monkeypatch.setattr(module, "_split_at_depth", lambda table, depth: _split_at_depth(table, 0.1))
    assert error("covariance", True, 1) > 1.3 * right


def test_rules_have_names():
    with pytest.raises(ValueError, match="must be covariance, product or minimum"):
        layered_shadow(LAMP, split_nothing(), floor(2), 2.0, 1.0, PIXEL, rule="sum")


def split_nothing():
    return trace_shadow_rays(LAMP, floor(2), 1, cards())[0]
