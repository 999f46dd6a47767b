"""Sums under the filter in both ways, against a loop over receivers that looks at every ray."""

import numpy as np
import pytest

from firstorder.numerics._native import HAVE_NATIVE
from firstorder.shadowfield.rendering import _weighted_sums as module
from firstorder.shadowfield.rendering._weighted_sums import gather
from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import RayTable

LAMP = lamp_frame((0.0, 0.0, 4.0), (0.0, 0.8, 0.0), (0.5, 0.0, 0.0))
CELLS = 3


def problem(count=300, rays=5000, without=0.2):
    """Receivers at many depths with filters of many widths, a share without; unlike weights."""
    rng = np.random.default_rng(3)
    local = np.column_stack([rng.uniform(-1, 1, (count, 2)), rng.uniform(3.0, 4.5, count)])
    y = rng.uniform(-1, 1, (rays, 2)) * LAMP.half
    v = (rng.uniform(-1, 1, (rays, 2)) - y) / 4.0
    near = np.where(rng.random(rays) < 0.5, rng.uniform(2.0, 4.5, rays), np.inf)
    start = rng.uniform(3.0, 5.0, rays)
    table = RayTable(*(a.astype(np.float32) for a in (y, v, near, -near, start)))
    sigma = np.where(rng.random(count) < without, np.inf, rng.uniform(0.03, 0.3, count))
    return table, local, sigma, rng.uniform(0.2, 1.5, count), rng.uniform(0.5, 2.0, rays)


def direct(table, local, sigma, shear, weights):
    """The sums as they are defined, in double precision."""
    mass, free = np.zeros((2, len(local), CELLS**2))
    square = np.zeros(len(local))
    y, v = table.y.astype(float), table.v.astype(float)
    for k in np.flatnonzero(np.isfinite(sigma)):
        delta = local[k, :2] - (y + v * local[k, 2])
        r2 = np.sum(delta**2, 1)
        foot = (y - shear[k] * delta) / LAMP.half
        some = (r2 <= (3.0 * sigma[k]) ** 2) & np.all(abs(foot) <= 1.0, 1)
        some &= table.start >= 0.98 * local[k, 2]
        w = np.exp(-0.5 * r2[some] / sigma[k] ** 2) * weights[some]
        i, j = np.minimum((0.5 * (foot[some] + 1.0) * CELLS).astype(int), CELLS - 1).T
        np.add.at(mass[k], i * CELLS + j, w)
        np.add.at(free[k], i * CELLS + j, w * (table.near[some] >= 0.98 * local[k, 2]))
        square[k] = np.sum(w**2)
    return mass, free, square


def largest_error(without=0.2):
    table, local, sigma, shear, weights = problem(without=without)
    found = module.gather(LAMP, table, local, sigma, shear, CELLS, weights)
    true = direct(table, local, sigma, shear, weights)
    assert np.median(true[0].sum(1)) > 5.0
    return max(np.max(abs(a - b)) for a, b in zip(found, true, strict=True)) / true[0].max()


WAYS = [
    pytest.param(False, id="groups"),
    pytest.param(True, id="rows", marks=pytest.mark.skipif(not HAVE_NATIVE, reason="no numba")),
]


@pytest.mark.smoke
@pytest.mark.parametrize("rows", WAYS)
def test_both_ways_give_the_direct_sums(monkeypatch, rows):
    """To rounding in double precision, by rows to the exponential's; in single, but for borders."""
    monkeypatch.setattr(module, "HAVE_NATIVE", rows)
    monkeypatch.setattr(module, "PRECISION", np.float64)
    assert largest_error() < (5e-8 if rows else 1e-13)
    monkeypatch.setattr(module, "PRECISION", np.float32)
    table, local, sigma, shear, weights = problem()
    found = gather(LAMP, table, local, sigma, shear, CELLS, weights)
    true = direct(table, local, sigma, shear, weights)
    for a, b in zip(found, true, strict=True):
        off = abs(a - b) / true[0].max()
        assert np.quantile(off, 0.98) < 1e-5
        assert np.max(off) < 0.2  # one ray's weight changed cells


@pytest.mark.skipif(not HAVE_NATIVE, reason="no numba")
@pytest.mark.parametrize(("rows", "slab"), [(1, 1.3), (3, 1.01), (4096, 9.0)])
def test_rows_and_slabs_change_nothing(monkeypatch, rows, slab):
    """Runs of all rays, longer than a block, and depths far apart that share rows."""
    monkeypatch.setattr(module, "PRECISION", np.float64)
    monkeypatch.setattr(module, "ROWS", rows)
    monkeypatch.setattr(module, "SLAB", slab)
    assert largest_error() < 5e-8


def test_chunks_and_groups_change_nothing(monkeypatch):
    monkeypatch.setattr(module, "HAVE_NATIVE", False)
    monkeypatch.setattr(module, "PRECISION", np.float64)
    monkeypatch.setattr(module, "CHUNK", 96)
    for group in (8, 32):
        monkeypatch.setattr(module, "GROUP", group)
        assert largest_error() < 1e-13
        assert largest_error(without=0.0) < 1e-13  # so that rays are left out


FAULTS = ("short reach", "lost chunk", "half the candidates", "no level", "starts anywhere")


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_noticed(monkeypatch, fault):
    monkeypatch.setattr(module, "HAVE_NATIVE", False)
    monkeypatch.setattr(module, "PRECISION", np.float64)
    right = module.narrowed
    if fault == "short reach":
        monkeypatch.setattr(module, "REACH", 2.0)
        module._weighed.clear_cache()
    if fault == "no level":
        monkeypatch.setattr(module, "LEVEL", 0.0)
    if fault == "starts anywhere":
        anywhere = problem()[0].start + np.float32(9.0)
        monkeypatch.setattr(
            module, "gather", lambda lamp, t, *a: gather(lamp, t._replace(start=anywhere), *a)
        )
    if fault == "lost chunk":
        chunks = module._all_chunks
        monkeypatch.setattr(module, "_all_chunks", lambda h, r, *a: chunks(h, r[1:], *a))
    if fault == "half the candidates":

        def fewer(*about):
            yield from ((rows, some[::2]) for rows, some in right(*about))

        monkeypatch.setattr(module, "narrowed", fewer)
    assert largest_error() > 1e-3
    if fault == "short reach":
        monkeypatch.undo()
        module._weighed.clear_cache()


def test_cells_without_rays_take_the_mean_of_all():
    sums = module.Sums(np.array([[2.0, 0.0]]), np.array([[1.0, 0.0]]), np.array([2.0]))
    np.testing.assert_array_equal(sums.seen, [[0.5, 0.5]])
    np.testing.assert_array_equal(sums.samples, [2.0])
