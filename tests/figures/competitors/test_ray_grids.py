"""Grids of rays: any grid gives the sums of all pairs; finer ones weigh fewer rays."""

import numpy as np
import pytest

from figures.e11.competitors.ray_grids import query, ray_grid
from firstorder.shadowfield.rendering._weighted_sums import gather
from tests.shadowfield.rendering.test_weighted_sums import LAMP
from tests.shadowfield.rendering.test_weighted_sums import problem as weighed


def problem():
    """Rays and narrow filters, without weights."""
    table, local, sigma, shear, _ = weighed(count=100, rays=4000, without=0.0)
    return table, local, sigma, shear


def all_pairs(table, local, sigma, shear):
    """Sums of weights, and of those of free rays, as they are defined."""
    found = np.zeros((3, len(local)))
    y, v = table.y.astype(float), table.v.astype(float)
    for k, (x, s, steep) in enumerate(zip(local, sigma, shear, strict=True)):
        delta = x[:2] - y - v * x[2]
        q = np.sum(delta**2, 1) / s**2
        some = (q <= 9.0) & np.all(abs(y - steep * delta) <= LAMP.half, 1)
        some &= table.start >= 0.98 * x[2]
        w = np.exp(-0.5 * q[some])
        free = table.near[some] >= 0.98 * x[2]
        found[:, k] = w.sum(), w[free].sum(), some.sum()
    return found


GRIDS = [(1, 1), (7, 1), (32, 1), (8, 4), (16, 16)]


@pytest.mark.parametrize(("slopes", "feet"), GRIDS)
def test_every_grid_finds_all_rays_that_count(slopes, feet):
    table, local, sigma, shear = problem()
    found = query(ray_grid(LAMP, table, slopes, feet), LAMP, local, sigma, shear)
    true = all_pairs(table, local, sigma, shear)
    assert np.median(true[2]) > 20
    for a, b in zip(found[:3], true, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-5)


def test_finer_grids_weigh_fewer_rays_in_more_cells():
    table, local, sigma, shear = problem()
    each = [query(ray_grid(LAMP, table, *grid), LAMP, local, sigma, shear) for grid in GRIDS]
    touched = [q.touched.sum() for q in each]
    assert touched[0] == len(local) * len(table.y)
    assert touched == sorted(touched, reverse=True)
    visited = [q.visited.sum() for q in each]
    assert visited[0] < visited[1] < visited[2]
    assert visited[3] < visited[4]
    assert touched[-1] < 0.5 * touched[2]  # the finest 2D grid


@pytest.mark.parametrize("fault", ["short reach", "lamp too small"])
def test_fault_is_noticed(fault):
    table, local, sigma, shear = problem()
    true, lamp = all_pairs(table, local, sigma, shear), LAMP
    if fault == "short reach":
        sigma = 0.9 * sigma
    else:
        lamp = LAMP._replace(half=0.8 * LAMP.half)
    found = query(ray_grid(LAMP, table, 16, 8), lamp, local, sigma, shear)
    assert not np.allclose(found.total, true[0], rtol=1e-3)


def test_it_is_the_filter_that_the_library_runs():
    table, local, sigma, shear = problem()
    found = query(ray_grid(LAMP, table, 16, 4), LAMP, local, sigma, shear)
    ours = gather(LAMP, table, local, sigma, shear, 1)
    np.testing.assert_allclose(found.total, ours.total, rtol=1e-4)
    np.testing.assert_allclose(found.free, ours.free[:, 0], rtol=1e-3, atol=1e-3)
