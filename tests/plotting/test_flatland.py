import jax
import numpy as np
import pytest
from matplotlib.collections import LineCollection

from firstorder import plotting
from firstorder.flatland import (
    Arcs,
    Circles,
    ConstantSky,
    Ellipses,
    PointLights,
    Scene,
    Segments,
    primitive,
)
from firstorder.flatland.library import _scenes as scenes
from firstorder.plotting import (
    curve_of,
    draw_curves,
    draw_scene,
    panels,
    receiver_curve,
    scene_report,
)
from firstorder.plotting.flatland import _outlines


@pytest.fixture(scope="module")
def world():
    """One of everything that is drawn differently."""
    return Scene.of(
        primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor", albedo=0.5),
        primitive(Segments((0.5, 1.0), (-0.5, 1.0)), name="lamp", emission=1.0, two_sided=True),
        primitive(Arcs((0.0, 0.5), 0.2, 0.0, 1.0), name="dish", mirror=1.0),
        primitive(Circles((0.6, 0.5), 0.1), name="lens", ior=1.5),
        primitive(Ellipses((-0.6, 0.5), (0.2, 0.1), 0.3), albedo=1.0),
        points=PointLights((0.0, 2.0), 1.0),
        environment=ConstantSky(0.2),
    )


@pytest.fixture(scope="module")
def curve():
    return receiver_curve(scenes.scene_b(), "floor", 40)


@pytest.fixture
def axes():
    return panels(1, 3)[1][0]


def test_outlines_are_those_of_the_shapes(world):
    s = np.linspace(0, 1, 9)
    place = jax.jit(
        jax.vmap(jax.vmap(lambda i, s: world.frame(i, s).position, (None, 0)), (0, None))
    )
    exact = np.asarray(place(np.arange(world.count), s))
    for index, (along, (points, _)) in enumerate(zip(exact, _outlines(world, 8), strict=True)):
        straight = world.names[index] in ("floor", "lamp")
        np.testing.assert_allclose(
            points, along[[0, 8]] if straight else along, rtol=0.0, atol=1e-14
        )


@pytest.mark.smoke
def test_a_map_holds_everything_and_its_units_are_equal(world, axes):
    draw_scene(axes[0], world, receivers=("floor",), names=True)
    ax = axes[0]
    assert ax.get_aspect() == 1.0
    assert {t.get_text() for t in ax.texts} == {"floor", "lamp", "dish", "lens"}
    assert any(line.get_marker() == "*" for line in ax.lines)
    (ring,) = [c for c in ax.collections if isinstance(c, LineCollection)]
    np.testing.assert_allclose(ring.get_array(), 0.2)
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    for points, _ in _outlines(world, 96):
        assert np.all((points > [x0, y0]) & (points < [x1, y1]))


def test_normals_skies_and_names_can_be_left_out(world, axes):
    draw_scene(axes[0], world)
    draw_scene(axes[1], world, normals=False, sky=False)
    assert len(axes[0].lines) == len(axes[1].lines) + world.count
    assert not [c for c in axes[1].collections if isinstance(c, LineCollection)]
    assert not axes[0].texts


def test_what_emits_is_drawn_on_the_side_that_does(axes):
    down = Scene.of(primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0))
    draw_scene(axes[0], down, normals=False)
    (lamp,) = [line for line in axes[0].lines if line.get_color() == "#e0a526"]
    assert np.all(np.asarray(lamp.get_ydata()) < 1.0)


def test_the_curve_is_that_of_the_closed_form():
    x = receiver_curve(scenes.scene_a(), "floor", 9)
    np.testing.assert_allclose(x["x"], (np.arange(9) + 0.5) * 2 / 9 - 1, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(x["arc"], x["x"] + 1, rtol=1e-13)
    u = np.stack([0.5 - x["x"], 0.5 + x["x"]])
    r = np.hypot(u, 1.0)
    np.testing.assert_allclose(x["E"], (u / r).sum(0), rtol=1e-13)
    np.testing.assert_allclose(x["dE"], (r[1] ** -3.0 - r[0] ** -3.0), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(x["d2E"], -3 * (u / r**5).sum(0), rtol=0.0, atol=1e-12)


def test_a_curve_goes_on_from_shape_to_shape():
    scene = scenes.scene_d()
    around = curve_of(scene, "occluder", lambda at: at.position[0], 20)
    assert list(dict.fromkeys(around["shape"])) == [4, 5, 6, 7]
    length = 4 * 2 * np.pi * 0.08
    np.testing.assert_allclose(around["arc"], (np.arange(20) + 0.5) / 20 * length, rtol=1e-12)
    np.testing.assert_allclose(around["E"], around["x"], rtol=1e-14)
    # dx/darc is the tangent's x; clockwise from the top
    np.testing.assert_allclose(around["dE"], np.cos(2 * np.pi * around["s"]), rtol=0.0, atol=1e-12)
    with pytest.raises(ValueError, match="must be one of ceiling, floor, left, occluder, right"):
        receiver_curve(scene, "nobody")
    for samples in (0, -5):
        with pytest.raises(ValueError, match="`samples` must be a positive integer, but is"):
            receiver_curve(scene, "floor", samples)


def test_curves_are_broken_between_shapes(axes, curve):
    draw_curves(axes, curve, "x")
    np.testing.assert_array_equal(axes[0].lines[0].get_ydata(), curve["E"])
    np.testing.assert_array_equal(axes[2].lines[0].get_xdata(), curve["x"])
    parted = {**curve, "shape": np.arange(40) // 20}
    draw_curves(axes, parted)
    data = np.asarray(axes[1].lines[2].get_ydata())
    assert np.flatnonzero(np.isnan(data)) == [20]


def test_a_report_has_a_map_and_three_curves_for_each_receiver(curve):
    page = scene_report(scenes.scene_b(), {"floor": curve, "again": curve}, "b", "some light")
    assert len(page.axes) == 7
    assert page.axes[4].get_title(loc="left") == "again: some light"
    assert page.axes[0].get_xlabel() == "x (m)"


@pytest.mark.parametrize(("width", "above"), [(6.0, True), (1.0, False)])
def test_the_map_of_a_wide_scene_lies_above_its_curves(curve, width, above):
    floor = primitive(Segments((0.0, 0.0), (width, 0.0)), name="floor")
    lamp = primitive(Segments((0.0, 1.0), (width, 1.0)), emission=1.0)
    page = scene_report(Scene.of(floor, lamp), {"floor": curve})
    page.draw_without_rendering()
    here, first = (ax.get_position() for ax in page.axes[:2])
    assert (here.y0 > first.y1) == above
    assert (here.x1 < first.x0) != above


def test_curves_without_samples_are_empty():
    none = np.zeros(0)
    _, axes = plotting.panels(1, 3)
    plotting.draw_curves(axes[0], dict.fromkeys(("shape", "arc", "E", "dE", "d2E"), none))
    assert all(len(ax.lines[0].get_xdata()) == 0 for ax in axes[0])
