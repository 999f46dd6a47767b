"""A scene as a light field: against irradiance, against plain differences, against two planes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.fields import GaussianProfile, Grid
from firstorder.fields.wavelet import Wavelet
from firstorder.flatland import (
    Arcs,
    Circles,
    Ellipses,
    PointLights,
    Receiver,
    Scene,
    Segments,
    box,
    irradiance,
    light_field,
    primitive,
    weighted_irradiance,
)
from firstorder.laws import Integrate
from firstorder.transport import Arrival, Cosine, Curvature, Mirror, Reflection, Travel
from tests.flatland.worlds import bean

HORIZON = 0.5 * np.pi
LEAVING, LEAVING_SLOPE = (Frame((*c.coordinates,), "outgoing") for c in (FLATLAND, FLATLAND_SLOPE))


@pytest.fixture(autouse=True, scope="module")
def _double():
    with jax.enable_x64(True):
        yield


class BrokenSky(eqx.Module):
    """Brighter between two angles than elsewhere."""

    breaks: np.ndarray = eqx.field(default_factory=lambda: np.array([-0.3, 0.9]))

    def __call__(self, angle):
        inside = (angle > self.breaks[0]) & (angle < self.breaks[1])
        return jnp.where(inside, 0.4 + 0.2 * jnp.sin(angle), 0.2 + 0.1 * jnp.sin(angle))


def uneven(number, s, front, along):
    """Light that varies over every shape and with direction."""
    return jnp.where(front, 1.0 + 0.5 * jnp.sin(3.0 * s) + 0.2 * number + 0.1 * along[0], 0.3 + s)


def crossing():
    """A lit disc and a board that cross before a lamp."""
    return (
        primitive(Segments((0.9, 2.0), (-0.8, 2.3)), emission=1.0),
        primitive(Segments((0.5, 0.6), (-0.3, 1.1)), emission=(0.1, 0.2)),
        primitive(Circles((-0.2, 1.2), 0.25), emission=0.3),
    )


def round_ones():
    """An arc that hides itself, an ellipse and a disc, none of them in line from x in (-1, 1)."""
    return Scene.of(
        primitive(Arcs((-1.5, 2.0), 0.4, 0.3, -2.5), emission=(0.8, 0.2)),
        primitive(Circles((-0.5, 1.5), 0.2), emission=0.3),
        primitive(Ellipses((1.3, 1.6), (0.4, 0.2), 0.5), emission=0.6),
    )


SCENES = {
    "overlapping blockers": lambda: (Scene.of(*crossing()), Receiver((0.1, 0.0), 0.15)),
    "round shapes": lambda: (round_ones(), Receiver((0.0, 0.0), -0.1)),
    "a sky that breaks": lambda: (
        Scene.of(primitive(Circles((-0.5, 1.2), 0.4), emission=0.7), environment=BrokenSky()),
        Receiver((0.1, 0.0), 0.2),
    ),
    "walls": lambda: (
        Scene.of(
            primitive(box((-2.0, 0.0), (2.0, 2.0), inward=True), emission=[0.1, 0.3, 0.5, 0.2]),
            primitive(Circles((0.0, 1.0), 0.4), emission=0.2),
        ),
        Receiver((0.1, 0.0), 0.0, 0),
    ),
    "a curve": lambda: (
        Scene.of(primitive(bean(0.4, 1.5, 0.4), emission=1.0)),
        Receiver((0.0, 0.0), 0.0),
    ),
}


def integral(scene, line, radiance=None, nodes=16):
    """Irradiance by the laws."""
    weighted = Cosine()(light_field(scene, line, radiance=radiance))
    return Integrate("theta", -HORIZON, HORIZON, nodes)(weighted)


def at(line, x):
    return Receiver(line.position + x * line.tangent, line.n, line.on)


def derivatives(f):
    """A function's value, gradient and Hessian, forward over reverse, in one program."""

    def first(x):
        value, gradient = jax.value_and_grad(f)(x)
        return gradient, (value, gradient)

    @jax.jit
    def all_of(x):
        hessian, (value, gradient) = jax.jacfwd(first, has_aux=True)(x)
        return value, gradient, hessian

    return all_of


def assert_same(found, true, bound=1e-12):
    for a, b in zip(found, true, strict=True):
        scale = max(1.0, np.max(np.abs(b)))
        assert np.max(np.abs(np.asarray(a) - np.asarray(b))) < bound * scale, (a, b)


# --- irradiance ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCENES)
def test_the_integral_is_irradiance_with_both_derivatives(name):
    scene, line = SCENES[name]()
    E = integral(scene, line)
    true = derivatives(lambda x: irradiance(scene, at(line, x)))
    jets = jax.jit(lambda x: E.jet(x[None]))
    for x in (0.2, -0.7):
        j, t = jets(jnp.array(x)), true(jnp.array(x))
        assert np.all(np.isfinite(t))
        assert abs(t[1]) > 1e-3
        assert_same((j.value, j.gradient[0], j.hessian[0, 0]), t)


def test_its_autodiff_is_exact_too_in_the_scene_and_in_the_line():
    """In ends of lamp and board, the disc's centre and radius, an emission, and the line."""
    kept = Scene.of(*crossing()).crossings

    def scene_of(p):
        lamp, board, disc = (
            primitive(Segments((0.9, 2.0), p[0:2]), emission=p[2]),
            primitive(Segments((0.5, 0.6), p[3:5])),
            primitive(Circles(p[5:7], p[7]), emission=0.3),
        )
        return Scene.of(lamp, board, disc, crossings=kept), Receiver(p[8:10], p[10])

    p = jnp.array([-0.8, 2.3, 1.0, -0.3, 1.1, -0.2, 1.2, 0.25, -0.5, 0.0, 0.15])
    found = derivatives(lambda p: integral(*scene_of(p), nodes=4).at(jnp.zeros(1)))(p)
    true = derivatives(lambda p: irradiance(*scene_of(p)))(p)
    assert np.all(np.abs(true[1]) > 1e-4)
    assert_same(found, true)


def test_uneven_light_is_integrated_too():
    scene, line = Scene.of(*crossing()[:2]), Receiver((0.1, 0.0), 0.15)
    E = integral(scene, line, uneven, 24)
    j = jax.jit(lambda x: E.jet(x[None]))(jnp.array(0.2))
    true = derivatives(lambda x: irradiance(scene, at(line, x), radiance=uneven, nodes=24))(
        jnp.array(0.2)
    )
    assert_same((j.value, j.gradient[0], j.hessian[0, 0]), true)


# --- edges ---------------------------------------------------------------------------------------


# Edges are arguments, so that those of one kind share a program.
@eqx.filter_jit
def crossing_angle(edge, u, reach):
    """Where an edge is met on a line of constant position."""
    return edge.crossing(u, 1, -reach, reach).value


@eqx.filter_jit
def jumps_of(edge, rays):
    """Jumps and their gradients."""
    return jax.vmap(jax.value_and_grad(edge.jump.at))(rays)


@pytest.mark.parametrize("frame", [FLATLAND, LEAVING_SLOPE])
def test_a_jump_is_the_difference_of_both_sides_and_has_derivatives(frame):
    """Against differences: across the edge, and along it by four values of the jump itself."""
    n = 0.0 if frame.sense == "incoming" else np.pi
    f = light_field(round_ones(), Receiver((0.0, 0.0), n), frame=frame, radiance=uneven)
    edges, x, h = f.edges(), 0.2, 1e-3
    reach = jnp.array(HORIZON if frame == FLATLAND else 8.0)
    side, values = jnp.array([0.0, 1e-9]), jax.jit(jax.vmap(f.at))
    sizeable = 0
    for e in edges:
        u = jnp.array([x, crossing_angle(e, jnp.array([x, 0.0]), reach)])
        assert abs(u[1]) < reach
        # A jump asks for the position alone.
        rays = [(x + k * h, 0.0) for k in range(-2, 3)]
        found, slopes = jumps_of(e, np.array([*rays, u]))
        slope = (found[0] - 8.0 * found[1] + 8.0 * found[3] - found[4]) / (12.0 * h)
        low, high = values(jnp.stack([u - side, u + side]))
        assert abs(found[2] - (high - low)) < 1e-3  # a limb goes as the root of the hair
        assert e.level.at(u + side) > 0.0  # on the counter-clockwise side
        assert abs(slopes[-1, 0] - slope) < 1e-7
        sizeable += abs(found[2]) > 0.1
    assert sizeable >= 5


def test_on_an_edge_the_value_is_the_mean_and_a_hidden_edge_does_not_jump():
    lamp, board = (
        primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=1.0),
        Segments((0.3, 3.0), (-0.3, 3.0)),
    )
    f = light_field(Scene.of(lamp, primitive(board)), Receiver((0.0, 0.0), 0.0))
    assert f(1.0, 0.0).item() == 0.5
    heights = [e.jump(0.0, 0.0).item() for e in f.edges()]
    assert sorted(np.abs(heights)) == [0.0, 0.0, 1.0, 1.0]


def test_the_program_grows_with_the_kinds_of_shapes_and_not_with_their_number():
    def equations(count):
        c = jnp.stack([jnp.linspace(-1.0, 1.0, count), jnp.full(count, 1.5)], -1)
        scene = Scene.of(primitive(Circles(c, jnp.full(count, 0.1)), emission=0.5))
        E = integral(scene, Receiver((0.0, 0.0), 0.0))
        text = str(jax.make_jaxpr(E.at)(jnp.zeros(1)))
        return text.count("\n")

    assert equations(8) < 2.0 * equations(2)


# --- laws ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("frame", [FLATLAND, FLATLAND_SLOPE, LEAVING, LEAVING_SLOPE])
def test_light_that_travels_is_the_light_of_the_far_line(frame):
    n = 0.0 if frame.sense == "incoming" else np.pi
    near, far = (
        light_field(round_ones(), Receiver((0.0, y), n), frame=frame, radiance=uneven)
        for y in (0.7, 0.0)
    )
    u = np.random.default_rng(0).uniform([-1.5, -0.8], [1.5, 0.8], (200, 2))
    moved = Travel(0.7)(near)
    a, b = (jax.jit(jax.vmap(f.at))(u) for f in (moved, far))
    assert np.ptp(np.asarray(b)) > 1.0
    assert np.max(np.abs(a - b)) < 1e-13
    # Its edges have travelled with it.
    reach = jnp.array(1.3 if "theta" in frame.coordinates else 4.0)

    here = jnp.array([0.2, 0.0])
    a, b = ([crossing_angle(e, here, reach) for e in f.edges()] for f in (moved, far))
    assert_same(a, b, 1e-13)


def test_light_that_leaves_a_line_arrives_at_the_one_that_faces_it():
    leaving = light_field(round_ones(), Receiver((0.0, 0.0), np.pi), frame=LEAVING)
    facing = light_field(round_ones(), Receiver((0.0, 0.0), 0.0))
    x, theta = np.linspace(-1.0, 1.0, 9)[:, None], np.linspace(-1.2, 1.2, 33)
    assert np.array_equal(Arrival()(leaving)(x, theta), facing(x, theta))


def test_a_curved_glossy_receiver_reflects_what_brute_force_says():
    """Rotation into the frame of a curved receiver, mirror, convolution: R07 eqs. 9-16."""
    scene, line, kappa, width = Scene.of(*crossing()[:2]), Receiver((0.1, 0.0), 0.15), -0.4, 0.2
    lobe = GaussianProfile(width)
    light = light_field(scene, line, radiance=uneven)
    B = Reflection(lobe, nodes=24)(Mirror()(Curvature(kappa)(light)))

    def brute(u):
        def weight(theta):
            return jnp.exp(-0.5 * ((u[1] + theta) / width) ** 2) / (width * np.sqrt(2.0 * np.pi))

        here = Receiver(line.position + u[0] * line.tangent, line.n + kappa * u[0])
        return weighted_irradiance(scene, here, weight=weight, radiance=uneven, nodes=96)

    u = jnp.array([0.3, 0.2])
    j = jax.jit(lambda u: B.jet(u))(u)
    # The lobe's tail below the horizon, seven widths away, is in B alone: exp(-24) of the light.
    assert_same((j.value, j.gradient, j.hessian), derivatives(brute)(u), 1e-9)


# --- other portraits -----------------------------------------------------------------


def test_its_wavelets_are_those_of_its_samples():
    f = light_field(round_ones(), Receiver((0.0, 0.0), 0.0))
    grid = Grid.spanning((16, 16), (1.0, 1.0))
    W, samples = (np.asarray(a) for a in (Wavelet.of(f, grid).coefficients, grid.sample(f)))
    assert np.sum(W**2) == pytest.approx(grid.cell * np.sum(samples**2), rel=1e-12)


# --- what is not a light field -------------------------------------------------------------------


def test_bad_arguments_are_refused_in_one_sentence():
    scene, line = Scene.of(*crossing()), Receiver((0.0, 0.0), 0.0)
    with pytest.raises(ValueError, match="point lights"):
        light_field(Scene.of(*crossing(), points=PointLights((0.0, 5.0), 1.0)), line)
    with pytest.raises(ValueError, match="`frame` must be over"):
        light_field(scene, line, frame=Frame(("x", "y")))
    with pytest.raises(ValueError, match=r"`line.position` must have shape"):
        light_field(scene, Receiver(np.zeros((3, 2)), np.zeros(3)))
    with pytest.raises(ValueError, match=r"`line.n` must be finite"):
        light_field(scene, Receiver((0.0, 0.0), np.nan))
    with pytest.raises(ValueError, match="lie on no shape for outgoing light"):
        light_field(scene, Receiver((0.0, 2.15), 0.0, 0), frame=LEAVING)


def test_traced_nonsense_gives_nan_and_a_field_passes_through_jit():
    scene = Scene.of(*crossing())

    @jax.jit
    def value(f, n):
        return eqx.tree_at(lambda f: f.line.n, f, n)(0.1, 0.2)

    f = light_field(scene, Receiver((0.0, 0.0), 0.0), radiance=uneven)
    assert np.isnan(value(f, jnp.array(jnp.nan)))
    assert np.isfinite(value(f, jnp.array(0.1)))


@pytest.mark.parametrize("bits", [32, 64])
def test_derivatives_are_numbers_where_the_eye_is_in_a_bad_place(bits):
    """In a disc's centre, on a disc, at the foot of a wall."""
    with jax.enable_x64(bits == 64):
        scene = Scene.of(
            primitive(Circles((0.0, 0.0), 0.5), emission=0.5),
            primitive(Segments((1.0, 0.0), (1.0, 1.0)), emission=1.0),
        )
        E = integral(scene, Receiver((0.0, 0.0), 0.0), nodes=4)
        look = jax.jit(lambda x: (E.jet(x), jax.grad(E.at)(x)))
        for x in (0.0, 0.5, 1.0):
            found = look(jnp.array([x]))
            assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(found))
            assert found[1].dtype == f"float{bits}"
