import dataclasses
import io
import subprocess
import sys
import warnings

import jax.numpy as jnp
import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from firstorder import plotting
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import Function, Grid, gaussian, half_plane
from firstorder.laws import Multiply
from firstorder.transport import Travel

X, THETA = np.linspace(-1.0, 1.0, 5), np.linspace(0.0, 0.6, 4)


@pytest.fixture
def ax():
    return plotting.panels()[1][0, 0]


def drawn(figure):
    """The pixels, which proves that nothing in the figure fails when drawn."""
    file = io.BytesIO()
    with plotting.house_style():
        figure.savefig(file, format="png")
    return np.asarray(Image.open(file).convert("RGB"))


def lightness(colour):
    """CIE L*, what is left of a colour in grey."""
    c = np.asarray(to_rgb(colour))
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    Y = linear @ [0.2126, 0.7152, 0.0722]
    return 116.0 * np.cbrt(Y) - 16.0 if Y > 0.008856 else 903.3 * Y


@pytest.mark.parametrize("name", ["SIGNED", "RADIANCE", "MAGNITUDE"])
def test_a_colour_map_keeps_its_order_in_grey(name):
    colours = matplotlib.colormaps.get_cmap(getattr(plotting, name))
    steps = np.diff([lightness(colours(t)[:3]) for t in np.linspace(0.0, 1.0, 65)])
    assert np.all(steps > 0.0)
    # No step is lost, and none looks like an edge.
    assert np.max(steps) < 4.0 * np.mean(steps)


def test_zero_is_in_the_middle_of_the_signed_map():
    low, zero, high = (lightness(plotting.SIGNED(t)[:3]) for t in (0.0, 0.5, 1.0))
    assert abs(zero - 0.5 * (low + high)) < 6.0


def test_the_house_style_ends_with_its_context():
    before = dict(matplotlib.rcParams)
    with plotting.house_style():
        assert matplotlib.rcParams["savefig.dpi"] == 160
    assert dict(matplotlib.rcParams) == before


def test_the_package_does_not_bring_matplotlib_and_plotting_does_not_bring_pyplot():
    code = (
        "import sys, firstorder\n"
        "assert 'matplotlib' not in sys.modules\n"
        "import firstorder.plotting\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_signed_data_have_symmetric_limits_and_say_so(ax):
    values = np.outer(X, np.ones(4)) - 1.5
    image = plotting.show_light_field(ax, values, X, THETA, names=("x", "v"), title="dL")
    assert image.get_clim() == (-2.5, 2.5)
    assert image.get_cmap().name == plotting.SIGNED.name
    assert ax.get_title(loc="right") == "±2.5"
    assert ax.get_title(loc="left") == "dL"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ (m)", "$v$")
    drawn(ax.figure)


def test_radiance_starts_at_zero_and_may_be_given_a_scale(ax):
    values = np.ones((5, 4))
    image = plotting.show_light_field(ax, values, X, THETA, limit=3.0)
    assert image.get_clim() == (0.0, 3.0)
    assert ax.get_title(loc="right") == "0 to 3"


def test_pixels_are_centred_on_samples_with_position_across_and_direction_up(ax):
    values = np.zeros((5, 4))
    values[4, 0] = 1.0  # right, low
    image = plotting.show_light_field(ax, values, X, THETA)
    np.testing.assert_allclose(image.get_extent(), (-1.25, 1.25, -0.1, 0.7))
    ax.set_axis_off()
    pixels = drawn(ax.figure).sum(axis=2)
    inside = ax.get_window_extent()
    middle = (inside.x0 + inside.x1) / 2, (inside.y0 + inside.y1) / 2
    scale = pixels.shape[1] / ax.figure.bbox.width
    right, low = int(scale * (inside.x1 - 8)), pixels.shape[0] - int(scale * (inside.y0 + 8))
    centre = pixels[pixels.shape[0] - int(scale * middle[1]), int(scale * middle[0])]
    assert pixels[low, right] > centre


def test_dark_light_has_a_scale_too(ax):
    assert plotting.show_light_field(ax, np.zeros((5, 4)), X, THETA).get_clim() == (0.0, 1.0)


def test_equal_axes_are_equal(ax):
    plotting.show_light_field(ax, np.ones((5, 4)), X, THETA, equal=True)
    assert ax.get_aspect() == 1.0


def test_samples_that_do_not_fit_are_refused_in_a_sentence(ax):
    with pytest.raises(ValueError, match=r"must have shape \(5, 4\), but has \(4, 5\)"):
        plotting.show_light_field(ax, np.ones((4, 5)), X, THETA)


def test_a_spectrum_is_shown_in_powers_of_ten_down_to_the_stated_range(ax):
    F = np.full((5, 4), 1e-9j)
    F[2, 1], F[3, 1] = 20.0j, -0.2
    image = plotting.show_spectrum(ax, F, X, THETA, decades=4.0)
    data = image.get_array()
    assert data is not None
    np.testing.assert_allclose(
        [data[1, 2], data[1, 3], data[0, 0]], [0.0, -2.0, -4.0], rtol=0.0, atol=1e-12
    )
    assert image.get_clim() == (-4.0, 0.0)
    assert ax.get_title(loc="right") == "20, 4 decades"
    assert ax.get_ylabel() == r"$\Omega_{\theta}$ (cycles/rad)"
    drawn(ax.figure)


def test_an_ellipse_touches_the_box_of_its_standard_deviations(ax):
    S = np.array([[4.0, 1.2], [1.2, 1.0]])
    ellipse = plotting.covariance_ellipse(ax, S, sigmas=2.0, center=(1.0, -1.0))
    outline = ellipse.get_verts()
    inside = ax.transData.inverted().transform(outline)
    reach = np.ptp(inside, axis=0) / 2.0
    np.testing.assert_allclose(reach, [4.0, 2.0], rtol=2e-3)
    drawn(ax.figure)


def test_a_singular_covariance_is_a_line(ax):
    assert plotting.covariance_ellipse(ax, [[1.0, 1.0], [1.0, 1.0]]).width < 1e-7
    drawn(ax.figure)


def test_portraits_of_light_with_a_closed_form_and_of_light_without_one():
    light = gaussian((0.2, 0.1), (0.5, 0.3), frame=FLATLAND_SLOPE)
    Omega = np.linspace(-1.0, 1.0, 4), np.linspace(-1.0, 1.0, 5)
    grid = Grid.spanning((32, 33), (4.0, 2.5))
    whole = plotting.portraits("source", light, grid, *Omega)
    sampled = Function(lambda x, v: jnp.exp(-((x / 0.5) ** 2) - (v / 0.3) ** 2), FLATLAND_SLOPE)
    cut = Multiply(half_plane(0.1, frame=FLATLAND_SLOPE))(sampled)
    shadow = plotting.portraits("shadow", cut, grid, *Omega)
    assert (whole.sampled, shadow.sampled) == (False, True)
    assert whole.covariance is not None
    assert shadow.covariance is None
    np.testing.assert_allclose(
        whole.spectrum, light.spectrum()(*np.meshgrid(*Omega, indexing="ij"))
    )
    figure = plotting.portrait_strip([whole, shadow])
    titles = [a.get_title(loc="left") for a in figure.axes]
    assert titles[:2] == ["source", "shadow"]
    assert titles[-2:] == ["spectrum", "spectrum (sampled)"]
    assert len(figure.axes) == 8
    shown = [(a.xaxis.label.get_visible(), a.yaxis.label.get_visible()) for a in figure.axes]
    assert shown[4:] == [(True, True), (True, False)] * 2  # once for light, once for spectra
    assert shown[:4] == [(False, True), (False, False)] * 2
    drawn(figure)
    with pytest.raises(ValueError, match="must hold value, dx, dtheta or spectrum"):
        plotting.portrait_strip([whole], ["hessian"])


def test_a_strip_has_one_scale_for_each_row_unless_told_otherwise():
    light = gaussian((0.0, 0.0), (0.5, 0.3), frame=FLATLAND_SLOPE)
    grid = Grid.spanning((8, 9), (1.0, 1.0))
    Omega = (np.linspace(-1.0, 1.0, 3),) * 2
    both = [plotting.portraits("", f, grid, *Omega) for f in (light, Travel(2.0)(0.5 * light))]

    def limits(figure):
        return [a.images[0].get_clim()[1] for a in figure.axes]

    same = limits(plotting.portrait_strip(both, ["value"]))
    own = limits(plotting.portrait_strip(both, ["value"], common=False))
    assert same[0] == same[1]
    assert own[0] > 1.8 * own[1]
    right = both[0].x[:, None] > 0.0
    holed = dataclasses.replace(both[0], value=np.where(right, both[0].value, np.nan))
    assert limits(plotting.portrait_strip([holed, both[1]], ["value"]))[0] == np.nanmax(holed.value)


def test_a_table_holds_its_words_and_tints_its_verdicts(ax):
    cells, verdicts = [["equal\n1e-16", "no formula"]], [["equal", "refused"]]
    plotting.draw_table(ax, ["jet", "wavelet"], ["move"], cells, verdicts, title="Laws")
    assert {t.get_text() for t in ax.texts} == {"jet", "wavelet", "move", *cells[0]}
    assert len({p.get_facecolor() for p in ax.patches}) == 4
    drawn(ax.figure)


def test_a_scene_is_a_map_with_rays_at_the_angles_of_the_conventions(ax):
    plotting.map_axes(ax, "scene")
    plotting.draw_surface(ax, [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    before = len(ax.lines)
    plotting.draw_rays(ax, [0.0, 0.0], np.pi / 6, 2.0)
    np.testing.assert_allclose(ax.lines[before].get_xydata()[1], [-1.0, np.sqrt(3.0)])
    assert ax.get_aspect() == 1.0
    low = np.min(ax.patches[0].get_xy()[:, 1])
    assert low < 0.0  # the hatching is below, on the far side from the normal
    plotting.draw_rays(ax, [0.0, 0.0], [0.0, 0.3], [1.0, 2.0], arrows=True)
    before = len(ax.lines)
    plotting.draw_rays(ax, [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], 0.0, 1.0)  # one angle for all
    assert [line.get_xydata()[1].tolist() for line in ax.lines[before:]] == [
        [0.0, 1.0],
        [1.0, 1.0],
        [2.0, 1.0],
    ]
    drawn(ax.figure)


def test_a_live_figure_shows_what_was_set_as_matplotlib_would():
    with plotting.house_style():
        figure, axes = plotting.panels(1, 2)
        images = [
            plotting.show_light_field(ax, np.zeros((5, 4)), X, THETA, signed=signed, limit=1.0)
            for ax, signed in zip(axes[0], (True, False), strict=True)
        ]
        (line,) = axes[0, 0].plot([-1.0, 1.0], [0.0, 0.6])
        live = plotting.LiveFigure(figure, [*images, line])
        assert live.png() == live.png()
        for image in images:
            image.set_data(np.linspace(-1.0, 1.0, 20).reshape(4, 5))
        line.set_ydata([0.6, 0.0])
        ours = np.asarray(Image.open(io.BytesIO(live.png()))).astype(int)
        for artist in (*images, line):
            artist.set_animated(False)
        figure.canvas.draw()
        theirs = np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)
    # The same, but for pixels on the borders of cells and beside the frame.
    other = np.max(np.abs(ours - theirs), axis=2) > 3
    assert np.mean(other) < 0.03


def test_a_cell_without_a_value_is_grey_in_a_live_figure():
    figure, axes = plotting.panels()
    image = axes[0, 0].imshow(np.array([[1.0, np.nan]]), vmin=0.0, vmax=1.0, cmap="gray")
    pixels = np.asarray(Image.open(io.BytesIO(plotting.LiveFigure(figure, [image]).png())))
    share = np.mean(np.all(pixels == [205, 209, 214], -1))
    box = axes[0, 0].get_window_extent()
    np.testing.assert_allclose(share, 0.5 * box.width * box.height / pixels[..., 0].size, rtol=0.03)


def test_labels_carry_symbols_and_units():
    assert plotting.label("kappa") == r"$\kappa$ (rad/m)"
    assert plotting.label("v") == "$v$"
    assert plotting.label("Omega_x", unit=False) == r"$\Omega_{x}$"


def test_live_images_show_what_they_are_given_where_they_are_given_it():
    def shown(*images, **options):
        png = live.png(images, **options)
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), int)

    live = plotting.LiveImages({"first": ("gray", 2.0), "second": ("gray", 1.0)}, 4, 3)
    dark, ramp = np.zeros((4, 3)), np.tile(np.arange(4.0)[:, None], (1, 3))
    black, bright = shown(dark, dark), shown(dark, ramp)
    changed = np.argwhere(np.any(black != bright, -1))
    middle = black.shape[1] // 2
    assert len(changed) > 1000
    assert changed[:, 1].min() > middle, "the second panel alone changed"
    across = bright[changed[:, 0].min() + 5, :, 0][middle:]
    assert across[np.argmax(across == 0) :].max() == 255, "above its top a value is white"
    # The first half of the second axis is the lower one.
    lower = shown(np.array([[2.0, 0.0, 0.0]] * 4), dark)
    rows = np.argwhere(np.any(lower != black, -1))[:, 0]
    assert rows.min() > black.shape[0] // 2
    for options in ({"notes": {0: "said"}}, {"dots": {0: np.array([[1.0, 1.0]])}}):
        where = np.argwhere(np.any(shown(dark, dark, **options) != black, -1))
        assert len(where) > 0
        assert where[:, 1].max() < middle
    assert np.array_equal(shown(dark, dark), black), "notes and dots are gone again"


def test_scales_of_pictures_are_positive(ax):
    """A logarithm would be blank."""
    samples = np.ones((5, 4))
    with pytest.raises(ValueError, match="`reference` must be positive"):
        plotting.log_magnitude(samples, 0.0, 3.0)
    with pytest.raises(ValueError, match="`decades` must be positive"):
        plotting.show_spectrum(ax, samples, X, THETA, decades=-1.0)
    with pytest.raises(ValueError, match="`reference` must not be negative"):
        plotting.show_spectrum(ax, samples, X, THETA, reference=-1.0)
    with pytest.raises(ValueError, match="`limit` must not be negative"):
        plotting.show_light_field(ax, samples, X, THETA, limit=np.nan)


def test_an_ellipse_is_that_of_a_matrix(ax):
    with pytest.raises(ValueError, match=r"`matrix` must have shape \(2, 2\)"):
        plotting.covariance_ellipse(ax, [1.0, 2.0])
    with pytest.raises(ValueError, match="`sigmas` must be positive"):
        plotting.covariance_ellipse(ax, np.eye(2), sigmas=-1.0)


# --- what is degenerate ---------------------------------------------------------------------------


@pytest.mark.parametrize("value", [0.0, 7.0, np.nan])
def test_an_image_of_one_value_is_drawn_live_at_the_bottom_of_its_scale(value):
    figure, axes = plotting.panels()
    image = axes[0, 0].imshow(np.full((3, 3), value), cmap="viridis", vmin=7.0, vmax=7.0)
    pixels = np.asarray(Image.open(io.BytesIO(plotting.LiveFigure(figure, [image]).png())))
    box = image.axes.get_window_extent()
    middle = pixels[round(len(pixels) - box.y0 - box.height / 2), round(box.x0 + box.width / 2)]
    bottom = image.get_cmap()(0, bytes=True)[:3]
    assert (tuple(middle) == bottom) == (value == value)


@pytest.mark.parametrize("places", [[0, 0, 1], [0, 1, 0], [0, 1, 1, 2, 2]])
def test_a_surface_with_places_given_twice_is_drawn(places):
    _, axes = plotting.panels()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plotting.draw_surface(axes[0, 0], [(float(x), 0.0) for x in places])
    assert np.isfinite(axes[0, 0].patches[0].get_xy()).all()


@pytest.mark.parametrize("places", [[], [(0.0, 0.0)], [(0.0, 0.0)] * 3, [(0.0, 0.0, 1.0)] * 3])
def test_a_surface_has_two_places(places):
    _, axes = plotting.panels()
    with pytest.raises(ValueError, match="Argument `points` must"):
        plotting.draw_surface(axes[0, 0], places)


def test_a_light_field_has_samples_that_are_real():
    _, axes = plotting.panels()
    with pytest.raises(ValueError, match="must hold at least one sample"):
        plotting.show_light_field(axes[0, 0], np.zeros((0, 0)), [], [])
    with pytest.raises(ValueError, match="Argument `values` must be real"):
        plotting.show_light_field(axes[0, 0], np.eye(2) * 1j, [0.0, 1.0], [0.0, 1.0])
    image = plotting.show_light_field(
        axes[0, 0], np.full((2, 2), -128, np.int8), [0.0, 1.0], [0.0, 1.0]
    )
    assert image.get_clim() == (-128.0, 128.0)


def test_a_logarithm_takes_any_number_of_decades():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = plotting.log_magnitude(np.array([1.0, 0.0, 1e300]), 1e-300, 400.0)
    assert found.tolist() == [300.0, -400.0, np.inf]
