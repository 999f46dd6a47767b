"""Weighted sums of shared shadow rays beside their floor, and beside the way without numba.

The floor is what pairs of a receiver and a ray that count must cost: 45 operations each, at the
rate of a matrix product on the same core. What is lost on the way to it: pairs that are weighed
and do not count (a run is as wide as its widest row), and weights that are added to bins one by
one. One process, one core.
"""

import time

import numpy as np
import pytest

from firstorder.numerics._native import HAVE_NATIVE
from firstorder.shadowfield import lamp_frame, trace_shadow_rays
from firstorder.shadowfield.rendering import _weighted_sums as sums
from firstorder.shadowfield.rendering._filter_shape import filter_shape
from firstorder.shadowfield.rendering.depth_bounds import blocker_depths

SIDE, OPERATIONS = 128, 45


def slats(a, b):
    """Bars in two layers, 1 and 2 m below a lamp 4 m up: depths of first and last."""
    depths = []
    for k, depth in enumerate((1.0, 2.0)):
        at = (b + 0.25 * depth * (a - b))[:, k]
        depths.append(np.where(np.sin(9.0 * at) > 0.0, 0.25 * depth, np.nan))
    none = np.isnan(depths).all(0)
    low, high = np.fmin(*depths), np.fmax(*depths)
    return np.where(none, np.inf, low), np.where(none, -np.inf, high)


def problem():
    """A floor of pixels under bars, with 1 shared ray each."""
    lamp = lamp_frame((0.0, 0.0, 4.0), (0.0, 0.6, 0.0), (0.6, 0.0, 0.0))
    x = (np.arange(SIDE) + 0.5) / SIDE * 3.0 - 1.5
    floor = np.stack([*np.meshgrid(x, x), np.zeros((SIDE, SIDE))], -1).reshape(-1, 3)
    table, _ = trace_shadow_rays(lamp, floor, 1, slats)
    pixel, local = 3.0 / SIDE, lamp.local(floor)
    near, far = blocker_depths(lamp, table, floor, pixel)
    shape = filter_shape(local[:, 2], near, far, 1.5, pixel, 0.6)
    return lamp, table, local, shape.sigma, shape.shear


def counted(lamp, table, local, sigma, shear):
    """How many pairs count, from every 37th receiver."""
    y, v, found, some = table.y, table.v, 0, np.flatnonzero(np.isfinite(sigma))[::37]
    for k in some:
        delta = local[k, :2] - (y + v * local[k, 2])
        on = np.all(abs(y - shear[k] * delta) <= lamp.half, 1)
        found += np.sum(on & (np.sum(delta**2, 1) <= (sums.REACH * sigma[k]) ** 2))
    return found * np.isfinite(sigma).sum() / len(some)


def seconds(call, repeats=3):
    best = np.inf
    for _ in range(repeats):
        begin = time.process_time()
        call()
        best = min(best, time.process_time() - begin)
    return best


@pytest.mark.benchmark(group="images")
@pytest.mark.skipif(not HAVE_NATIVE, reason="no numba")
def test_sums(capsys, monkeypatch):
    about = problem()
    pairs = counted(*about)
    a = np.ones((512, 512), np.float32)
    rate = 2.0 * 512**3 / seconds(lambda: a @ a, 9)
    sums.gather(*about, 4)
    rows = seconds(lambda: sums.gather(*about, 4))
    monkeypatch.setattr(sums, "HAVE_NATIVE", False)
    groups = seconds(lambda: sums.gather(*about, 4))
    floor = pairs * OPERATIONS / rate
    each = [1e9 * t / pairs for t in (rows, groups, floor)]
    with capsys.disabled():
        print(f"\nshared rays: {pairs / 1e6:.1f} M pairs count; {each[0]:.1f} ns for each by rows, "
              f"{each[1]:.1f} by groups, floor {each[2]:.2f} ({1e-9 * rate:.0f} Gflop/s): "
              f"{rows / floor:.1f} times the floor")  # fmt: skip
    assert groups > 3.0 * rows
