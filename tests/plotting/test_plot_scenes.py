"""`Scene.plot`: what is drawn lies where the shapes are, in both worlds."""

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from firstorder import flatland, space
from firstorder.flatland import Circles, ConstantSky, GaussianSky, PointLights, Segments
from firstorder.plotting import panels
from firstorder.plotting._plot_scenes import VIEWS, outlines
from firstorder.space import Boxes, Cylinders, Discs, Ellipsoids, Rectangles, Triangles

LAMP = "#e0a526"


@pytest.fixture
def ax():
    return panels()[1][0, 0]


@pytest.fixture(scope="module")
def flat():
    return flatland.Scene.of(
        flatland.primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor", albedo=0.5),
        flatland.primitive(Segments((0.5, 1.0), (-0.5, 1.0)), name="lamp", emission=1.0),
        flatland.primitive(Circles((0.3, 0.5), 0.2), name="ball"),
    )


@pytest.fixture(scope="module")
def room():
    """A floor, a ball, a lamp that shines down, and a near wall that turns its back to the eye."""
    return space.Scene.of(
        space.primitive(space.plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor"),
        space.primitive(space.sphere((0.2, 0.5, 0.4), 0.3), name="ball", albedo=0.5),
        space.primitive(
            space.rectangle((0.0, 0.0, 2.0), (0.0, 0.4, 0.0), (0.5, 0.0, 0.0)),
            name="lamp", emission=1.0, facing=(0.0, 0.0, 0.0),
        ),
        space.primitive(
            space.rectangle((0.0, -1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            name="wall", facing=(0.0, 0.0, 1.0),
        ),
    )  # fmt: skip


def words_of(ax):
    legend = ax.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


@pytest.mark.smoke
def test_lines_lie_where_the_shapes_of_flatland_are(flat):
    ax = flat.plot(normals=False)
    floor, lamp, _, ball = ax.lines
    np.testing.assert_allclose(floor.get_xydata(), [[-1.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(lamp.get_xydata(), [[0.5, 1.0], [-0.5, 1.0]])
    away = np.asarray(ball.get_xydata()) - [0.3, 0.5]
    np.testing.assert_allclose(np.linalg.norm(away, axis=-1), 0.2, rtol=1e-12)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ (m)", "$y$ (m)")
    assert ax.axison
    assert ax.get_aspect() == 1.0
    assert {t.get_text() for t in ax.texts} == {"floor", "lamp", "ball"}
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    assert left < -1.1 < 1.1 < right  # names have room on all sides
    assert bottom < -0.1 < 1.1 < top


@pytest.mark.parametrize("width", [2.3, 3.3, 7.0])
def test_names_stay_inside_of_the_frame_at_any_width(flat, width):
    figure, axes = panels(1, 1, width, 0.7 * width)
    flat.plot(axes[0, 0])
    figure.draw_without_rendering()
    frame = axes[0, 0].get_window_extent()
    names = [text.get_window_extent() for text in axes[0, 0].texts]
    assert [box.y0 > frame.y0 and box.y1 < frame.y1 for box in names] == [True, True, True]


def test_a_key_names_only_what_is_there(flat, ax):
    assert words_of(flat.plot(ax)) == ["shines"]
    plain = Segments((0.0, 0.0), (1.0, 0.0))
    assert words_of(flatland.Scene.of(flatland.primitive(plain)).plot()) == []
    every = flatland.Scene.of(
        flatland.primitive(plain, mirror=1.0),
        flatland.primitive(Circles((0.0, 0.5), 0.2), ior=1.5),
        points=PointLights((0.0, 2.0), 1.0),
    )
    assert words_of(every.plot()) == ["mirror", "glass", "point light"]


def test_a_sky_has_a_scale_only_where_it_varies(flat):
    def scales(environment):
        scene = eqx.tree_at(lambda s: s.environment, flat, environment, is_leaf=lambda x: x is None)
        return [a.get_ylabel() for a in scene.plot().child_axes]

    assert scales(None) == scales(ConstantSky(1.0)) == []
    assert scales(GaussianSky(0.0, 0.5)) == ["sky (W/(m rad))"]


@pytest.mark.parametrize("world", ["flat", "room"])
def test_given_axes_are_used_and_returned_and_no_figure_stays_open(world, ax, request):
    scene = request.getfixturevalue(world)
    plt.close("all")
    assert scene.plot(ax) is ax
    assert ax.get_xlabel() == "$x$ (m)"
    new = scene.plot()
    assert new.figure is not ax.figure
    assert plt.get_fignums() == []


# --- space ----------------------------------------------------------------------------------------


def polygons(ax):
    (found,) = [c for c in ax.collections if isinstance(c, PolyCollection)]
    return found, [np.asarray(path.vertices)[:-1] for path in found.get_paths()]


@pytest.mark.parametrize("view", VIEWS)
def test_outlines_of_space_lie_where_the_shapes_are(room, view):
    ax = room.plot(view=view)
    _, drawn = polygons(ax)
    across, up, *_ = VIEWS[view]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (f"${'xyz'[across]}$ (m)", f"${'xyz'[up]}$ (m)")
    assert ax.get_aspect() == 1.0
    (ball,) = [p for p in drawn if len(p) == 64]
    radius = np.linalg.norm(ball - np.array([0.2, 0.5, 0.4])[[across, up]], axis=-1)
    np.testing.assert_allclose(radius, 0.3, rtol=1e-12)
    ends = np.array([[-0.5, -0.4, 2.0], [0.5, 0.4, 2.0]])[:, [across, up]]
    boxes = [(p.min(0), p.max(0)) for p in drawn]
    assert any(np.allclose(low, ends[0]) and np.allclose(high, ends[1]) for low, high in boxes)
    floor = [line for line in ax.lines if line.get_linestyle() == "-"]
    assert len(floor) == (0 if view == "top" else 1)  # from above it would cover all
    assert all(np.allclose(line.get_xy1()[1], 0.0) for line in floor)
    assert {"ball", "lamp", "wall"} <= {n for t in ax.texts for n in t.get_text().split(", ")}


def test_the_nearer_hides_the_farther_and_a_back_is_looked_through(room):
    def order(view):
        collection, drawn = polygons(room.plot(view=view))
        sizes = ["ball" if len(p) == 64 else f"{np.ptp(p, axis=0).max():.1f} m" for p in drawn]
        return sizes, [len(c) and c[3] for c in collection.get_facecolors()]

    # From the front the wall, 2 m wide, is nearest and turned away; from above the lamp is.
    assert order("front") == (["ball", "1.0 m", "2.0 m"], [1.0, 1.0, 0.0])
    assert order("top") == (["ball", "2.0 m", "1.0 m"], [1.0, 1.0, 0.0])


def supports(group, d):
    """How far each shape reaches along d, from the support functions of the canonical shapes."""
    pulled = np.einsum("nij,i->nj", np.asarray(group.axes), d)
    flat, third = np.linalg.norm(pulled[:, :2], axis=-1), np.abs(pulled[:, 2])
    reach = {
        Ellipsoids: np.linalg.norm(pulled, axis=-1),
        Boxes: np.abs(pulled).sum(-1),
        Cylinders: flat + third,
        Discs: flat,
        Rectangles: np.abs(pulled[:, :2]).sum(-1),
        Triangles: np.maximum(pulled[:, :2].max(-1), 0.0),
    }
    return np.asarray(group.center) @ d + reach[type(group)]


@pytest.mark.parametrize("kind", [Ellipsoids, Boxes, Cylinders, Discs, Rectangles, Triangles])
def test_outlines_reach_as_far_as_the_shapes_in_any_direction(kind):
    random = np.random.default_rng(0)
    group = kind(random.normal(size=(4, 3)), random.normal(size=(4, 3, 3)))
    drawn = outlines(group, (0, 2))
    for turn in np.linspace(0.0, 6.0, 13):
        d = np.array([np.cos(turn), 0.0, np.sin(turn)])
        exact = supports(group, d)
        middle = np.asarray(group.center) @ d
        found = np.array([(p @ d[[0, 2]]).max() for p in drawn])
        # A polygon of 64 corners lies inside of the ellipse, at most by this share.
        lost = (exact - found) / np.maximum(np.abs(exact - middle), 1e-300)
        assert np.all(found <= exact + 1e-12)
        assert np.all(lost <= 1.01 * (1.0 - np.cos(np.pi / 64.0)) + 1e-12)


def test_names_at_one_place_stand_in_a_row():
    rectangle = space.rectangle((0.0, 0.0, 1.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    ball = space.sphere((0.0, 0.0, 0.5), 0.1)
    scene = space.Scene.of(
        space.primitive(rectangle, name="lamp"), space.primitive(ball, name="ball")
    )
    assert [t.get_text() for t in scene.plot(view="top").texts] == ["ball, lamp"]
    assert {t.get_text() for t in scene.plot(view="front").texts} == {"ball", "lamp"}
    assert len(scene.plot(names=False).texts) == 0


def test_a_scene_that_cannot_be_drawn_is_refused_in_a_sentence(flat, room):
    for scene in (flat, room):
        many = jax.tree.map(lambda leaf: jnp.stack([leaf] * 3), scene)
        with pytest.raises(ValueError, match=r"must be one scene to be drawn, but is a batch of"):
            many.plot()
        with pytest.raises(ValueError, match=r"to be drawn, but is traced"):
            jax.jit(lambda scene: [scene.plot(), 0.0][1])(scene)
    with pytest.raises(ValueError, match=r"`view` must be one of top, front, side, but is 'back'"):
        room.plot(view="back")


def test_three_bands_of_albedo_are_a_colour(ax):
    red, lamp = (0.8, 0.2, 0.0), (1.2, 1.0, 0.8)
    ball = space.primitive(space.sphere((0.0, 0.0, 1.0), 0.5), albedo=red)
    shining = space.primitive(space.sphere((0.0, 2.0, 1.0), 0.5), emission=lamp)
    space.Scene.of(ball, shining).plot(ax, view="side")
    (shapes,) = [c for c in ax.collections if isinstance(c, PolyCollection)]
    colours = shapes.get_facecolors()[:, :3]
    np.testing.assert_allclose(colours[0], 0.35 + 0.55 * np.array(red))
    flat = flatland.primitive(Segments((0.0, 0.0), (1.0, 0.0)), albedo=red)
    sky = ConstantSky(lamp)
    drawn = flatland.Scene.of(flat, environment=sky).plot()
    assert drawn.lines[0].get_color() == red
    drawn.figure.draw_without_rendering()
