import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching import Cache, Candidates, ValidityRegion, circular_regions
from firstorder.plotting import draw_expansions, draw_records, panels
from firstorder.plotting.caches import show_cache


@pytest.fixture
def cache():
    some = Candidates.from_function(jnp.square, jnp.array([0.0, 1.0, 2.0]))
    return Cache.of(some, circular_regions(jnp.array([0.01, 0.5, 9.0]), 0.1, 1.0), order=2)


def test_records_stand_where_they_are_and_reach_as_far_as_they_do(cache):
    ax = panels()[1][0, 0]
    draw_records(ax, cache, height=1.0, step=0.5, origin=-1.0)
    bars, *marks = ax.collections
    segments = np.array(bars.get_segments())
    np.testing.assert_allclose(segments[:, :, 0], [[-1.1, -0.9], [-0.5, 0.5], [0.0, 2.0]])
    np.testing.assert_allclose(segments[:, 0, 1], [1.0, 0.5, 0.0])
    assert len(marks) == 3  # raised, free and cut have a mark each
    places = sorted(float(m.get_offsets()[0, 0]) for m in marks)
    np.testing.assert_allclose(places, [-1.0, 0.0, 1.0])


def test_expansions_are_drawn_over_their_reach(cache):
    ax = panels()[1][0, 0]
    draw_expansions(ax, cache)
    draw_expansions(ax, cache, order=1)
    parabola, line = ax.lines[2], ax.lines[5]
    x = np.asarray(parabola.get_xdata())
    assert (x.min(), x.max()) == (1.0, 3.0)
    np.testing.assert_allclose(parabola.get_ydata(), x**2, rtol=1e-12)
    np.testing.assert_allclose(line.get_ydata(), 4.0 * x - 4.0, rtol=1e-12)


def test_ellipses_lie_where_the_records_reach():
    """One that leans by 30 degrees, drawn at its full size over an image of errors."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    Q = np.array([[c, s], [-s, c]])
    M = Q.T @ np.diag([1 / 0.4, 1 / 0.1]) @ Q
    place = jnp.array([[0.25, 0.75]])
    cache = Cache(
        Candidates.of(place, jnp.ones(1), 0 * place), ValidityRegion(jnp.asarray(M)[None])
    )
    ax = panels()[1][0, 0]
    image = show_cache(ax, cache, np.eye(4), top=0.5, scale=1.0)
    ellipse = ax.collections[0]
    np.testing.assert_allclose(ellipse.get_offsets(), place)
    np.testing.assert_allclose(ellipse.get_widths(), 0.8)
    np.testing.assert_allclose(ellipse.get_heights(), 0.2)
    np.testing.assert_allclose(ellipse.get_angles(), 30.0)
    assert image.get_clim() == (0.0, 0.5)
    assert (ax.get_xlim(), ax.get_ylim()) == ((0.0, 1.0), (0.0, 1.0))


@pytest.mark.parametrize(
    ("draw", "dims", "words"),
    [(draw_records, 2, "along a line"), (draw_expansions, 2, "along a line"),
     (lambda ax, cache: show_cache(ax, cache, np.zeros((3, 3))), 1, "on a plane")],
)  # fmt: skip
def test_records_of_another_place_are_refused(draw, dims, words):
    x = jnp.zeros((1, dims))
    reach = circular_regions(jnp.array([0.5]), 0.1, 1.0, dims=dims)
    cache = Cache.of(Candidates.of(x, jnp.ones(1), x), reach)
    with pytest.raises(ValueError, match=f"`cache` must have its records {words}, but has not"):
        draw(panels()[1][0, 0], cache)
