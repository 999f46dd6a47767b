"""What E11's factoring is measured with: its own shading, halves of rays, sums over cells."""

import numpy as np
import pytest

from figures.e11.shared import glossy, space


@pytest.fixture(scope="module")
def ground():
    return glossy.ground(24, 8)


def shading_error(g):
    """Sums of the figure's own shading over the lamp, against the library's cells."""
    lamp, n = g.scene.lamp, 32
    x = (2.0 * np.arange(n) + 1.0) / n - 1.0
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    places = lamp.world(np.column_stack([p * lamp.half, np.zeros(len(p))]))
    points = g.points[::5]
    k = glossy.shading(points, np.tile(places, (len(points), 1, 1)), lamp)
    area = 4.0 * np.prod(lamp.half) / n**2
    worst = []
    for i in range(len(glossy.LOBES)):
        cells = (k[i] * space.falloff(p)).reshape(-1, 8, n // 8, 8, n // 8).sum((2, 4)) * area
        light = g.light[i][::5]
        worst.append(np.max(abs(cells.reshape(light.shape) - light)) / np.max(light))
    return max(worst)


def test_the_figures_shading_is_the_librarys(ground):
    """To what 4 x 4 midpoints of a cell of 1/30 rad leave of a lobe 1/9 rad wide."""
    assert shading_error(ground) < 2e-3


def test_a_fault_is_noticed(ground, monkeypatch):
    monkeypatch.setattr(space, "MIRROR_EYE", (0.2, -4.0, 4.0))
    assert shading_error(ground) > 2e-2


def test_free_lamps_leave_no_error_and_halves_agree(ground):
    free = np.all(ground.seen == 1.0, (0, 2))
    assert 0.1 < free.mean() < 0.9
    np.testing.assert_array_equal(ground.true[:, :, free], ground.whole[None, :, free].repeat(2, 0))
    for i in range(len(glossy.LOBES)):
        a, b = ground.true[:, i]
        assert np.max(abs(a - b)) > 0.0
        assert abs(np.mean(a - b)) < 4.0 * np.std(a - b) / np.sqrt(len(a))


def test_cells_are_merged_into_larger_ones(ground):
    """64 cells of an image that tells row and column, into 4; and factoring in one cell."""
    values = np.arange(64.0)
    assert glossy.merged(values, 2).tolist() == [
        values.reshape(8, 8)[i : i + 4, j : j + 4].sum() for i in (0, 4) for j in (0, 4)
    ]
    one = ground.factored(2, ground.seen[0], 1)
    np.testing.assert_allclose(one, ground.whole[2] * ground.visible[0], rtol=1e-12)


def test_one_cell_is_worse_than_many(ground):
    """Beyond what noise may make of nothing, for every lobe; a sharp one the most."""
    found = [
        [ground.rms(i, [ground.factored(i, s, c) for s in ground.seen])[0] for c in (1, 8)]
        for i in range(len(glossy.LOBES))
    ]
    coarse, fine = np.array(found).T
    assert np.all(fine < 0.5 * coarse)
    assert np.all(np.diff(coarse) > 0.0)
