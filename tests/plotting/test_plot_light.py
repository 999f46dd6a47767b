"""`Field.plot` and `Spectrum.plot`: samples where they belong, jumps, and places of no value."""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.fields import (
    Affine,
    Constant,
    Edge,
    Field,
    Function,
    Grid,
    SampledSpectrum,
    Spline,
    gaussian,
    half_plane,
)
from firstorder.flatland import Circles, Receiver, Scene, Segments, light_field, primitive
from firstorder.laws import Integrate, Multiply
from firstorder.plotting import panels
from firstorder.plotting._windows import frequencies_of, window_of
from firstorder.symbolic import UnknownField
from firstorder.transport import Travel

LINE = Frame(("x",))
LIGHT = gaussian((0.2, 0.1), (0.5, 0.3))


class Stairs(Field):
    """Steps at -0.5 by 1 and at 0.25 by -3, one at 0.6 that is hidden, over a slope of 1."""

    frame: Frame = LINE

    def at(self, u):
        return u[0] + jnp.where(u[0] > -0.5, 1.0, 0.0) - jnp.where(u[0] > 0.25, 3.0, 0.0)

    def jet(self, u):
        raise NotImplementedError

    def edges(self):
        one = jnp.ones(1)
        return tuple(
            Edge(Affine(one, -place, LINE), Constant(height, LINE))
            for place, height in ((-0.5, 1.0), (0.25, -3.0), (0.6, 0.0))
        )


@pytest.fixture
def ax():
    return panels()[1][0, 0]


def image_of(ax):
    (image,) = ax.images
    values = image.get_array()
    return image, np.ma.filled(values, np.nan).T


def scale_of(ax):
    (scale,) = ax.child_axes
    return scale.get_ylabel()


@pytest.mark.smoke
def test_pixels_are_the_fields_values_at_their_middles(ax):
    plt.close("all")
    window = Grid.spanning((7, 4), (1.0, 0.5), (0.2, 0.1))
    assert LIGHT.plot(ax, window=window) is ax
    image, values = image_of(ax)
    np.testing.assert_allclose(values, LIGHT(window.axis(0)[:, None], window.axis(1)), rtol=1e-12)
    np.testing.assert_allclose(image.get_extent(), (-0.8, 1.2, -0.4, 0.6))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ (m)", r"$\theta$ (rad)")
    assert scale_of(ax) == "radiance $L$"
    assert plt.get_fignums() == []


def test_a_window_that_nobody_states_lies_around_the_light():
    found = window_of(LIGHT, 8)
    np.testing.assert_allclose(found.center, [0.2, 0.1], rtol=1e-12)
    np.testing.assert_allclose(found.extent, [7.0 * 0.5, 7.0 * 0.3], rtol=1e-12)
    far = window_of(
        (gaussian((0.2, 0.1), (0.5, 0.3), frame=FLATLAND_SLOPE) >> Travel(2.0)).light, 8
    )
    np.testing.assert_allclose(far.extent[0], 7.0 * np.hypot(0.5, 2.0 * 0.3), rtol=1e-12)
    np.testing.assert_allclose(far.center[0], 0.2 + 2.0 * 0.1, rtol=1e-12)
    nowhere = window_of(half_plane(0.0), 8)
    np.testing.assert_allclose(nowhere.extent, [2.0, np.pi], rtol=1e-12)


def test_the_window_of_a_scenes_light_spans_the_scene():
    scene = Scene.of(
        primitive(Segments((3.0, 1.0), (1.0, 1.0)), emission=1.0), primitive(Circles((0, 2), 0.5))
    )
    light = light_field(scene, Receiver((1.0, 0.0), 0.0))
    for field in (light, Multiply(Constant(2.0))(light)):
        found = window_of(field, 8)
        np.testing.assert_allclose(found.center, [0.25, 0.0], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(found.extent, [3.5, np.pi], rtol=1e-12)
    turned = window_of(light_field(scene, Receiver((1.0, 0.0), np.pi / 2)), 8)
    np.testing.assert_allclose(turned.extent[0], 1.5, rtol=1e-12)
    np.testing.assert_allclose(turned.center[0], 1.75, rtol=1e-12)
    aslant = window_of(light_field(scene, Receiver((0.0, 0.0), -np.pi / 4)), 8)
    ends = np.array([-0.5 - 2.5, 3.0 - 1.0]) / np.sqrt(2.0)  # a corner of the ball's box
    np.testing.assert_allclose(aslant.center[0], ends.mean(), rtol=1e-12)
    np.testing.assert_allclose(aslant.extent[0], np.ptp(ends), rtol=1e-12)


def test_a_curve_is_broken_where_it_jumps_and_nowhere_else(ax):
    Stairs().plot(ax, window=Grid.spanning((40,), (1.0,)))
    (line,) = ax.lines
    x, values = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    (gaps,) = np.nonzero(np.isnan(values))
    np.testing.assert_allclose(x[gaps], [-0.5, 0.25], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(x[gaps - 1], x[gaps], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(x[gaps + 1], x[gaps], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(values[gaps - 1], [-0.5, 1.25], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(values[gaps + 1], [0.5, -1.75], rtol=0.0, atol=1e-6)
    rises = np.diff(values) - np.diff(x)  # a bridge would rise by a step
    np.testing.assert_allclose(rises[np.isfinite(rises)], 0.0, rtol=0.0, atol=1e-12)
    assert np.all(np.diff(x) > 0.0)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ (m)", "light $L$")
    assert ax.get_xlim() == (-1.0, 1.0)


def test_a_jump_on_a_sample_is_a_jump_too(ax):
    """Where the field itself says the mean of both sides."""
    both = Multiply(half_plane(0.0, 1.0, 3.0, frame=LINE))(Constant(1.0, LINE))
    both.plot(ax, window=Grid.spanning((5,), (1.0,)))
    values = np.asarray(ax.lines[0].get_ydata())
    np.testing.assert_array_equal(values, [1.0, 1.0, 1.0, np.nan, 3.0, 3.0, 3.0])


@pytest.fixture(scope="module")
def ball():
    """A lamp over an opaque ball and one of glass, side by side."""
    return Scene.of(
        primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0),
        primitive(Circles([(-0.5, 0.0), (0.5, 0.0)], [0.25, 0.25]), ior=np.array([0.0, 1.5])),
    )


def test_inside_of_an_opaque_body_there_is_no_value(ball, ax):
    light = light_field(ball, Receiver((0.0, 0.0), 0.0))
    window = Grid.spanning((40, 6), (1.0, 1.0))
    light.plot(ax, window=window)
    _, values = image_of(ax)
    within = np.abs(window.axis(0) + 0.5) < 0.25
    assert within.sum() == 10
    np.testing.assert_array_equal(np.isnan(values), within[:, None] & np.ones(6, bool))
    assert ax.patch.get_hatch() == "////"
    assert scale_of(ax) == "radiance $L$ (W/(m rad))"


def test_what_keeps_the_places_keeps_what_is_blank_and_what_moves_them_does_not(ball, ax):
    light = light_field(ball, Receiver((0.0, 0.0), 0.0), frame=FLATLAND_SLOPE)
    window = Grid.spanning((40, 4), (1.0, 0.2))
    Multiply(Constant(2.0))(light).plot(ax, window=window)
    assert np.isnan(image_of(ax)[1]).any(-1).sum() == 10
    far = panels()[1][0, 0]
    (light >> Travel(0.0)).light.plot(far, window=window)
    assert not np.isnan(image_of(far)[1]).any()
    assert far.patch.get_hatch() is None


def test_beyond_the_ends_of_samples_there_is_no_value(ax):
    spline = Spline.of(LIGHT, Grid((8, 8), (0.1, 0.1)), "open")
    window = Grid.spanning((20, 20), (1.0, 1.0))
    spline.plot(ax, window=window)
    image, values = image_of(ax)
    inside = np.abs(window.axis(0)) < 0.4  # half a step beyond the last samples
    np.testing.assert_array_equal(np.isfinite(values), inside[:, None] & inside)
    assert image.get_clim()[1] == pytest.approx(np.nanmax(values))


def test_a_spectrum_is_drawn_by_powers_of_ten(ax):
    F = LIGHT.spectrum()
    window = Grid.spanning((6, 5), (0.5, 1.0))
    assert F.plot(ax, window=window, decades=4.0) is ax
    image, values = image_of(ax)
    exact = np.abs(F(window.axis(0)[:, None], window.axis(1)))
    np.testing.assert_allclose(
        values, np.maximum(np.log10(exact / exact.max()), -4.0), rtol=0.0, atol=1e-12
    )
    assert image.get_clim() == (-4.0, 0.0)
    assert ax.get_xlabel() == r"$\Omega_{x}$ (cycles/m)"
    assert scale_of(ax) == rf"$\log_{{10}} |\hat{{L}}| / {exact.max():.3g}$"


def test_a_spectrum_over_one_frequency_is_a_curve(ax):
    F = Integrate("theta", -3.0, 3.0)(LIGHT).spectrum()
    F.plot(ax, window=Grid.spanning((9,), (1.0,)))
    (line,) = ax.lines
    np.testing.assert_allclose(line.get_ydata(), np.abs(F(line.get_xdata())), rtol=1e-9)
    assert ax.get_yscale() == "log"
    bottom, top = ax.get_ylim()
    least, most = np.min(line.get_ydata()), np.max(line.get_ydata())
    assert 0.1 * least < bottom < least < most < top < 10.0 * most
    assert ax.get_ylabel() == r"magnitude $|\hat{L}|$"


@pytest.mark.parametrize("sigma", [1e-9, 1e-5, 1e-3, 1.0, 1e3, 1e9])
def test_a_spectrum_is_looked_for_where_light_of_any_width_has_it(sigma):
    """A bell falls to a hundredth of its top at `sqrt(log(100) / 2) / (pi sigma)`."""
    F = gaussian((0.0, 0.0), (sigma, 0.3), frame=FLATLAND_SLOPE).spectrum()
    reach = 0.5 * np.array(frequencies_of(F, 8).extent) * [sigma, 0.3]
    faint = np.sqrt(0.5 * np.log(100.0)) / np.pi
    assert np.all((reach > 0.7 * faint) & (reach < 5.0 * faint))


def test_the_frequencies_that_nobody_states_hold_the_energy():
    """A bell falls to a hundredth of its top at 3.03 deviations."""
    bell = frequencies_of(LIGHT.spectrum(), 8)
    deviations = 0.5 * np.array(bell.extent) * 2.0 * np.pi * [0.5, 0.3]
    assert np.all((deviations > 3.0) & (deviations < 8.0))
    turned = (gaussian((0.2, 0.1), (0.5, 0.3), frame=FLATLAND_SLOPE) >> Travel(5.0)).light
    F = turned.spectrum()
    found = frequencies_of(F, 33)
    covariance = np.asarray(turned.covariance().matrix)
    reach = 0.5 * np.array(found.extent) / np.sqrt(2.0 * np.diag(covariance))
    assert np.all((reach > 2.5) & (reach < 10.0))
    nyquist = frequencies_of(SampledSpectrum.of(LIGHT, Grid((8, 8), (0.1, 0.2))), 8)
    np.testing.assert_allclose(nyquist.extent, [10.0, 5.0])


def test_a_spectrum_of_samples_is_their_transform(ax):
    F = SampledSpectrum.of(LIGHT, Grid((9, 8), (0.3, 0.2)))
    window = Grid.spanning((4, 3), (1.0, 1.0))
    F.plot(ax, window=window)
    exact = np.abs(F(window.axis(0)[:, None], window.axis(1)))
    np.testing.assert_allclose(
        image_of(ax)[1], np.maximum(np.log10(exact / exact.max()), -6.0), rtol=0.0, atol=1e-9
    )


def test_what_cannot_be_drawn_is_refused_in_a_sentence():
    three = Function(lambda x, v, t: x, Frame(("x", "v", "t")))
    with pytest.raises(ValueError, match=r"over one or two coordinates .* over \(x, v, t\): draw"):
        three.plot()
    with pytest.raises(ValueError, match="`window` must be over the 2 coordinates x, theta, but"):
        LIGHT.plot(window=Grid((4,), (1.0,)))
    with pytest.raises(ValueError, match="`field` must hold numbers to be drawn, but is traced"):
        jax.jit(lambda light: [light.plot(), 0.0][1])(LIGHT)
    with pytest.raises(ValueError, match="must hold numbers to be drawn, but is traced"):
        jax.jit(lambda light: [light.spectrum().plot(), 0.0][1])(LIGHT)
    many = jax.vmap(lambda x: gaussian((x, 0.0), (0.5, 0.3)))(jnp.arange(3.0))
    heights = jax.vmap(Constant)(jnp.arange(3.0))
    for batch, word in ((many, "field"), (heights, "field"), (many.spectrum(), "spectrum")):
        with pytest.raises(
            ValueError, match=f"must be one {word} to be drawn, but is a batch of 3"
        ):
            batch.plot()
    for nothing in (UnknownField("L", frame=FLATLAND), Function(lambda x, theta: x * jnp.nan)):
        with pytest.raises(ValueError, match="must have a value in the window, but has none"):
            nothing.plot(window=Grid((4, 4), (1.0, 1.0)))
