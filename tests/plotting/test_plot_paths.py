"""`Path.plot`: which steps it shows, over which windows, and what it refuses."""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Function, Grid, gaussian
from firstorder.laws import Integrate
from firstorder.plotting._plot_paths import SIZE, plot_path
from firstorder.plotting._windows import frequencies_of, window_of
from firstorder.transport import Event, Path, ToAngle, Travel, half_plane_blocker

SOURCE = gaussian((0.2, 0.1), (0.5, 0.3), frame=FLATLAND_SLOPE)
FAR = SOURCE >> Travel(2.0)


class Across(Event):
    """All directions at once."""

    def law(self, frame):
        return Integrate("v", -1.0, 1.0)


def box(ax):
    return np.array(ax.images[0].get_extent()).reshape(2, 2)


def box_of(grid):
    half = 0.5 * np.array(grid.extent)
    return np.stack([grid.center - half, grid.center + half], -1)


def hull(a, b):
    return np.stack([np.minimum(a[:, 0], b[:, 0]), np.maximum(a[:, 1], b[:, 1])], -1)


@pytest.mark.smoke
def test_a_path_is_a_strip_with_a_column_for_each_step():
    plt.close("all")
    axes = FAR.plot().axes
    assert [ax.get_title(loc="left") for ax in axes[:2]] == ["source", "Travel"]
    assert [ax.get_title(loc="left") for ax in axes[6:]] == ["spectrum", "spectrum"]
    assert len(axes) == 2 * 4
    assert plt.get_fignums() == []


def test_pixels_are_the_light_of_the_step_in_the_window():
    window = Grid.spanning((7, 4), (1.0, 0.5), (0.2, 0.1))
    _, far = FAR.plot(window=window, rows=["value"]).axes
    values = FAR.light(window.axis(0)[:, None], window.axis(1))
    np.testing.assert_allclose(np.asarray(far.images[0].get_array()).T, values, rtol=1e-12)
    np.testing.assert_allclose(box(far), box_of(window))


def test_a_window_that_nobody_states_holds_the_light_of_all_steps():
    one, two = FAR.plot(rows=["value"]).axes
    np.testing.assert_allclose(box(one), box(two), rtol=1e-12)
    both = hull(*(box_of(window_of(field, SIZE)) for field in FAR.steps))
    np.testing.assert_allclose(box(one), both, rtol=1e-12)


def test_frequencies_hold_the_energy_of_all_steps():
    _, two = FAR.plot(rows=["spectrum"]).axes
    both = hull(*(box_of(frequencies_of(F, SIZE)) for F in FAR.spectra))
    np.testing.assert_allclose(box(two), both, rtol=1e-12)


def test_steps_over_other_coordinates_have_windows_of_their_own():
    path = FAR >> ToAngle().linearised(jnp.zeros(2))
    one, _, last = path.plot(rows=["value"]).axes
    assert [ax.get_ylabel() for ax in (one, last)] == ["$v$", r"$\theta$ (rad)"]
    np.testing.assert_allclose(box(last), box_of(window_of(path.light, SIZE)), rtol=1e-12)


def test_a_spectrum_without_a_closed_form_is_that_of_the_samples():
    bump = Function(lambda x, v: jnp.exp(-(x**2) - v**2), FLATLAND_SLOPE)
    window = Grid.spanning((8, 8), (2.0, 4.0))
    figure = (Path(bump) >> half_plane_blocker(0.1, FLATLAND_SLOPE)).plot(
        window=window, rows=["spectrum"]
    )
    assert {ax.get_title(loc="left") for ax in figure.axes} == {"source", "Occlusion"}
    np.testing.assert_allclose(box(figure.axes[1]), [(-1.0, 1.0), (-0.5, 0.5)])


def test_light_that_is_not_over_two_coordinates_is_refused_in_a_sentence():
    with pytest.raises(ValueError, match=r"two coordinates .* its step 2, Across, is over \(x\)\."):
        (FAR >> Across()).plot()
    with pytest.raises(ValueError, match="`window` must be over the 2 coordinates x, v, but has 1"):
        FAR.plot(window=Grid((4,), (1.0,)))


def test_a_traced_path_a_batch_and_a_row_that_is_none_are_refused_in_a_sentence():
    with pytest.raises(ValueError, match="`path` must hold numbers to be drawn, but is traced"):
        jax.jit(lambda path: [plot_path(path), 0.0][1])(FAR)
    many = jax.vmap(lambda d: SOURCE >> Travel(d))(jnp.arange(3.0))
    with pytest.raises(ValueError, match="must be one path to be drawn, but is a batch of 3"):
        many.plot()
    with pytest.raises(ValueError, match="must hold value, dx, dtheta or spectrum, but has 'jet'"):
        FAR.plot(rows=["jet"])
