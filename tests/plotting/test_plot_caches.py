"""`Cache.plot`: what the cache answers where a record reaches, and nothing elsewhere."""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

from firstorder.caching import Cache, Candidates, circular_regions
from firstorder.plotting import panels
from firstorder.plotting._plot_caches import pieces


@pytest.fixture
def ax():
    return panels()[1][0, 0]


@pytest.fixture(scope="module")
def line():
    """Three records that overlap, one of which is raised and one cut, and one on its own."""
    some = Candidates.from_function(jnp.sin, jnp.array([0.0, 0.1, 1.0, 4.0]))
    return Cache.of(some, circular_regions(jnp.array([0.7, 0.01, 9.0, 0.5]), 0.2, 0.8))


@pytest.fixture(scope="module")
def plane():
    places = jnp.array([[0.0, 0.0], [1.0, 0.5]])
    some = Candidates.from_function(lambda x: 2.0 + x[0] * x[1], places)
    return Cache.of(some, circular_regions(jnp.array([0.5, 0.25]), 0.1, 1.0, dims=2))


@pytest.mark.smoke
def test_a_curve_says_what_the_cache_says_and_nothing_between_records(line, ax):
    plt.close("all")
    assert line.plot(ax) is ax
    (drawn,) = ax.lines
    x, E = np.asarray(drawn.get_xdata()), np.asarray(drawn.get_ydata())
    known = np.isfinite(E)
    found = line(x[known, None])
    assert bool(found.covered.all())
    np.testing.assert_allclose(E[known], found.value, rtol=1e-12)
    assert not np.any(known & (x > 1.8) & (x < 3.5))
    assert (x.min(), x.max()) == pytest.approx((-0.7, 4.5), abs=1e-5)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("arc length $x$ (m)", "irradiance $E$ (W/m)")
    assert plt.get_fignums() == []


def test_a_curve_is_broken_where_a_reach_ends(line):
    x, E = pieces(line, 600)
    ends = [-0.7, -0.1, 0.2, 0.3, 0.7, 1.8, 3.5, 4.5]
    gaps = x[np.isnan(E)]
    assert all(np.abs(gaps - end).min() < 1e-12 for end in ends[1:])
    steps = np.abs(np.diff(E))
    assert np.nanmax(steps) < 0.02
    # There are steps that a line through all places would have bridged.
    assert np.max(np.abs(np.diff(E[np.isfinite(E)]))) > 0.1


def test_records_stand_on_their_values_and_say_what_acted_on_them(line, ax):
    line.plot(ax)
    marks = {c.get_label(): np.asarray(c.get_offsets()) for c in ax.collections}
    np.testing.assert_allclose(
        marks["record"], [[0.0, 0.0], [4.0, np.sin(4.0)]], rtol=0.0, atol=1e-12
    )
    np.testing.assert_allclose(marks["radius raised"], [[0.1, np.sin(0.1)]])
    np.testing.assert_allclose(marks["radius cut"], [[1.0, np.sin(1.0)]])
    legend = ax.get_legend()
    assert legend is not None
    assert {t.get_text() for t in legend.get_texts()} == set(marks)
    free = Cache(line.records, line.region._replace(clamp=0))
    assert free.plot().get_legend() is None


def test_pixels_of_a_plane_are_what_the_cache_says_and_blank_beyond_its_records(plane, ax):
    plane.plot(ax)
    (image,) = ax.images
    values = np.ma.filled(image.get_array(), np.nan).T
    left, right, bottom, top = image.get_extent()
    assert (left, bottom) == pytest.approx((-0.5, -0.5))
    x, y = (
        np.linspace(a, b, n, endpoint=False) + 0.5 * (b - a) / n
        for a, b, n in zip((left, bottom), (right, top), values.shape, strict=True)
    )
    places = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    found = plane(places)
    np.testing.assert_array_equal(np.isfinite(values), found.covered)
    covered = np.asarray(found.covered)
    np.testing.assert_allclose(values[covered], np.asarray(found.value)[covered], rtol=1e-9)
    ellipses, dots = ax.collections
    np.testing.assert_allclose(ellipses.get_offsets(), [[0.0, 0.0], [1.0, 0.5]])
    np.testing.assert_allclose(ellipses.get_widths(), [1.0, 0.5])
    np.testing.assert_allclose(dots.get_offsets(), [[0.0, 0.0], [1.0, 0.5]])
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ (m)", "$y$ (m)")
    assert [a.get_ylabel() for a in ax.child_axes] == ["irradiance $E$ (W/m$^2$)"]


def test_what_cannot_be_drawn_is_refused_in_a_sentence(line):
    many = jax.tree.map(lambda leaf: jnp.stack([leaf] * 2), line)
    with pytest.raises(
        ValueError, match=r"must be one cache to be drawn, but is a batch of \(2,\)"
    ):
        many.plot()
    with pytest.raises(ValueError, match="must hold numbers to be drawn, but is traced"):
        jax.jit(lambda cache: [cache.plot(), 0.0][1])(line)
