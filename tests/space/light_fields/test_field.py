"""The light field of a scene: its rays, jets, edges, integrals and samples."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import erf

from firstorder.checks.cases.space import travel_scene as painted
from firstorder.checks.faults import twin
from firstorder.checks.tolerance import fitted_order, normwise, rounding
from firstorder.conventions import SPACE_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Constant,
    Function,
    Gaussian,
    Grid,
    SampledSpectrum,
    Spline,
    autodiff_jet,
    discrete_transform,
)
from firstorder.laws import Integrate, Multiply
from firstorder.space import (
    Receiver,
    Scene,
    box,
    cylinder,
    disc,
    ellipsoid,
    first_shape,
    irradiance,
    light_field,
    plane,
    primitive,
    receiver,
    rectangle,
    sphere,
    triangle,
)
from firstorder.space.light_fields._edges import RoundLevel, StraightLevel
from firstorder.transport import Arrival, Travel
from tests.precision import as_dtype
from tests.space import worlds

LEAVING = SPACE_SLOPE.turned()
AT = receiver((0.2, 0.1, 0.0), (0.1, 0.2, 1.0))
AXES = np.asarray(AT.axes)
KINDS = {
    "ellipsoid": ellipsoid((0.1, 0.2, 1.2), np.diag([0.4, 0.3, 0.2]) + 0.05),
    "box": box((-0.3, -0.2, 0.9), (0.4, 0.3, 1.2)),
    "cylinder": cylinder((-0.1, 0.2, 0.9), (0.3, 0.3, 1.4), 0.25),
    "disc": disc((0.1, 0.1, 1.2), (0.2, 0.1, -1.0), 0.4),
    "triangle": triangle((-0.2, -0.3, 1.0), (0.6, 0.1, 1.2), (0.1, 0.6, 1.1)),
}


def scene_of(shape):
    """A shape between a small panel, which hides a part of it, and a plane far behind, aslant."""
    return Scene.of(
        primitive(shape, emission=(2.0, 3.0)),
        primitive(
            rectangle((0.1, 0.3, 0.6), (0.2, 0.0, 0.02), (0.0, 0.1, 0.03)), emission=(0.5, 0.7)
        ),
        primitive(plane((0.0, 0.0, 3.0), (0.9, 0.3, -1.0)), emission=(1.0, 1.3)),
        environment=0.1,
    )


def rays(count, seed=0):
    """Rays that start near the origin."""
    return np.random.default_rng(seed).uniform(-0.6, 0.6, (count, 4))


@eqx.filter_jit
def _values(field, u):
    return jax.vmap(field.at)(u)


def values(field, u):
    """Of fields that differ in numbers alone, by one program."""
    return np.asarray(_values(field, jnp.asarray(u)))


# --- one ray -------------------------------------------------------------------------------------


def test_values_are_those_of_plain_ray_casting():
    """Travel's case, at many rays: sky, ball and panel."""
    u = np.asarray(rays(400))
    u[:, 2:] *= 1.5
    here = light_field(painted.SCENE, painted.PLANE, radiance=painted.paint)
    truth = np.array([painted.brute(ray) for ray in u])
    assert normwise(values(here, u), truth) < rounding(1000)
    assert len(set(np.asarray(jax.jit(jax.vmap(here.seen))(u)))) == 3


@pytest.mark.parametrize("kind", KINDS)
def test_values_are_what_the_first_shape_emits(kind):
    scene, u = scene_of(KINDS[kind]), rays(300, 1)
    start = np.asarray(AT.position) + u[:, :2] @ AXES[:, :2].T
    along = AXES[:, 2] - u[:, 2:] @ AXES[:, :2].T
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    index = np.asarray(first_shape(scene, jnp.asarray(start), jnp.asarray(along)))
    emitted = jax.vmap(lambda k, o, d: scene.emitted(k, scene.surface(k, o, d)[0], d))
    sent = np.asarray(jax.jit(emitted)(np.maximum(index, 0), start, along))
    np.testing.assert_array_equal(values(light_field(scene, AT), u), np.where(index < 0, 0.1, sent))
    assert len(set(index)) >= 3


def test_on_an_edge_the_value_is_the_mean_of_both_sides():
    lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
    L = light_field(
        Scene.of(primitive(lamp, emission=3.0), environment=1.0), receiver((0.0, 0.0, 0.0))
    )
    assert L(0.5, 0.0, 0.0, 0.0) == 2.0
    assert L(0.0, -0.5, 0.0, 0.0) == 2.0


def test_outgoing_light_travels_the_other_way():
    """Light that leaves the scene: known on one plane, and on one further from it."""
    first = light_field(painted.SCENE, AT_BACK, frame=LEAVING, radiance=painted.paint)
    further = Receiver(AT_BACK.position + 0.7 * AT_BACK.normal, AT_BACK.axes, AT_BACK.S, AT_BACK.on)
    second = light_field(painted.SCENE, further, frame=LEAVING, radiance=painted.paint)
    u = rays(200, 2)
    assert normwise(values(Travel(0.7)(first), u), values(second, u)) < rounding(1000)


AT_BACK = receiver((0.1, 0.0, -0.3), (-0.1, 0.2, -1.0))  # its normal points away from the scene


def test_outgoing_light_arrives_at_a_plane_that_faces_it():
    flip = jnp.array([-1.0, 1.0, -1.0])
    facing = Receiver(AT_BACK.position, AT_BACK.axes * flip, AT_BACK.S, AT_BACK.on)
    out = light_field(painted.SCENE, AT_BACK, frame=LEAVING, radiance=painted.paint)
    come = light_field(painted.SCENE, facing, radiance=painted.paint)
    u = rays(200, 3)
    assert normwise(values(Arrival()(out), u), values(come, u)) < rounding(1000)
    assert np.ptp(values(come, u)) > 1.0


# --- jets ----------------------------------------------------------------------------------------

STENCIL = np.array([-1.0 / 60, 3.0 / 20, -3.0 / 4, 0.0, 3.0 / 4, -3.0 / 20, 1.0 / 60])


def differences(f, u, h=5e-4):
    """Gradient and Hessian by central differences of the sixth order."""
    steps = h * np.eye(4)

    def slope(g, i, at):
        return sum(c * g(at + (k - 3) * steps[i]) for k, c in enumerate(STENCIL) if c) / h

    first = np.array([slope(f, i, u) for i in range(4)])
    second = [[slope(lambda a, i=i: slope(f, i, a), j, u) for j in range(4)] for i in range(4)]
    return first, np.array(second)


@pytest.fixture(scope="module")
def jets():
    here = light_field(painted.SCENE, painted.PLANE, radiance=painted.paint)
    return jax.jit(jax.vmap(here.jet))(jnp.asarray(painted.RAYS))


@pytest.mark.parametrize("k", range(len(painted.RAYS) - 1), ids=["sky", "ball", "panel"])
def test_jets_are_the_differences_of_plain_ray_casting(jets, k):
    gradient, hessian = differences(painted.brute, painted.RAYS[k])
    # h^6 against the ball's size, and rounding / h^2
    assert normwise(jets.gradient[k], gradient) < 1e-9
    assert normwise(jets.hessian[k], hessian) < 1e-6
    assert np.abs(hessian).max() > 0.1


def test_a_uniform_light_has_no_derivatives():
    L = light_field(scene_of(KINDS["cylinder"]), AT)
    found = jax.jit(L.jet)(jnp.array([0.1, 0.2, 0.0, 0.1]))
    assert not np.any(found.gradient)
    assert not np.any(found.hessian)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_no_ray_gives_nan(dtype):
    """On edges and corners, tangent to the ball, along a flat shape, and nearly so."""
    scene = Scene.of(
        primitive(sphere((0.0, 0.0, 2.0), 1.0)),
        primitive(rectangle((2.0, 0.0, 1.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))),
        primitive(rectangle((-2.0, 0.0, 1.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5))),
        environment=painted.sky,
    )
    L = light_field(scene, receiver((0.0, 0.0, 0.0)), radiance=painted.paint)
    u = [[1, 0, 0, 0], [0, -1, 0, 0], [2.5, 0.5, 0, 0], [1.5, 0, 0, 0], [-2, 0, 0, 0], [0, 0, 1, 0]]
    u = np.concatenate([u, np.array(u) + 1e-7, [[0.0, 0.0, 3.0**-0.5, 0.0]], rays(20)])
    found = jax.jit(jax.vmap(as_dtype(L, dtype).jet))(jnp.asarray(u, dtype))
    assert found.hessian.dtype == dtype
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(found))


# --- edges ---------------------------------------------------------------------------------------


def stacked(edges):
    """Edges of one structure side by side, so that each is compiled once."""
    kinds = {}
    for e in edges:
        kinds.setdefault(jax.tree.structure(e), []).append(e)
    return [jax.tree.map(lambda *leaves: jnp.stack(leaves), *group) for group in kinds.values()]


LOW, HIGH = -1.2, 1.2


def crossed(edges, axis):
    """Where a line of rays meets each edge, and the step of the light there, as a function."""

    def one(e, u):
        b = e.crossing(u, axis, jnp.asarray(LOW), jnp.asarray(HIGH)).value
        there = u.at[axis].set(b)
        way = jnp.sign(jax.grad(e.level.at)(there)[axis])
        return b, jnp.where(b < HIGH, way * e.jump.at(there), 0.0)

    def all_of(u):
        found = [jax.vmap(one, (0, None))(group, u) for group in stacked(edges)]
        return tuple(jnp.concatenate(a) for a in zip(*found, strict=True))

    return jax.jit(jax.vmap(all_of))


def steps(field, u, axis, samples):
    """Steps of the light between samples along one coordinate, traced, and told by the edges."""
    line = np.linspace(LOW, HIGH, samples)
    along = np.repeat(u[:, None], samples, 1)
    along[:, :, axis] = line
    traced = np.diff(values(field, along.reshape(-1, 4)).reshape(len(u), samples), axis=1)
    where, jump = (np.asarray(a) for a in crossed(field.edges(), axis)(jnp.asarray(u)))
    told = np.zeros_like(traced)
    for k in range(len(u)):
        np.add.at(told[k], np.clip(np.searchsorted(line, where[k]) - 1, 0, samples - 2), jump[k])
    return traced, told


@pytest.mark.parametrize(("kind", "axis"), [(k, "v") for k in KINDS] + [("disc", "x")])
def test_edges_tell_every_step_of_the_light_along_a_line_of_rays(kind, axis):
    """Each at its place and of its height: hidden parts, limbs, rims, corners and horizons."""
    field = light_field(scene_of(KINDS[kind]), AT, axis=axis)
    traced, told = steps(field, rays(24, 4), SPACE_SLOPE.axis(axis), 1201)
    assert np.count_nonzero(traced) > 24
    np.testing.assert_allclose(told, traced, rtol=0.0, atol=rounding(10))


def test_edges_that_shapes_share_add_up():
    """Two triangles make a lamp: across their common side the light changes once."""
    a, b, c, d = ((-0.4, -0.3, 1.0), (0.5, -0.3, 1.0), (0.5, 0.4, 1.0), (-0.4, 0.4, 1.0))
    scene = Scene.of(
        primitive(triangle(a, b, c), emission=(2.0, 2.0)),
        primitive(triangle(a, c, d), emission=(3.0, 3.0)),
        environment=0.5,
    )
    traced, told = steps(light_field(scene, AT), rays(24, 5), 2, 1201)
    assert np.count_nonzero(traced) > 12
    np.testing.assert_allclose(told, traced, rtol=0.0, atol=rounding(10))


def test_beside_an_edge_its_jump_is_that_on_the_edge():
    """A ball before a sky, asked a tenth of its radius within its outline and without."""
    scene = Scene.of(primitive(sphere((0.0, 0.0, 2.0), 0.5), emission=2.0), environment=0.5)
    outline = 0.5 / np.sqrt(4.0 - 0.25)  # the slope at which the middle sees it
    jumps = [
        edge.jump for edge in light_field(scene, receiver((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))).edges()
    ]
    for share in (0.9, 1.0, 1.1):
        found = [abs(float(jump.at(jnp.array([0.0, 0.0, share * outline, 0.0])))) for jump in jumps]
        assert max(found) == pytest.approx(1.5, rel=1e-12)


def test_the_level_of_a_straight_edge_is_bilinear():
    level = StraightLevel(jnp.array([0.3, -0.2, 1.1]), jnp.array([-0.5, 0.4, 1.7]))
    u = jnp.asarray(rays(1)[0])
    found, auto = jax.jit(lambda u: (level.jet(u), autodiff_jet(level.at, u, SPACE_SLOPE)))(u)
    for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(auto), strict=True):
        assert normwise(a, b) < rounding(100)
    assert not np.any(np.diag(found.hessian))


def test_a_round_outline_is_met_once_along_its_axis():
    found = [
        level.level
        for level in light_field(scene_of(KINDS["ellipsoid"]), AT, axis="w").edges()
        if isinstance(level.level, RoundLevel)
    ]
    assert len(found) == 2
    line = np.repeat(np.array([[0.1, 0.2, 0.1, 0.0]]), 401, 0)
    line[:, 3] = np.linspace(-3.0, 3.0, 401)
    signs = [np.sign(values(level, line)) for level in found]
    assert [int(np.count_nonzero(np.diff(s))) for s in signs] == [1, 1]


@pytest.mark.parametrize("axis", ["x", "y", "v", "w"])
@pytest.mark.parametrize(
    ("dtype", "unit"),
    [("float64", 1e-9), ("float64", 1e9), ("float32", 1e-6), ("float32", 1e4), ("float32", 1e6)],
)
def test_a_round_outline_is_met_once_in_any_unit_of_length(axis, dtype, unit):
    """Of a ball of radius 0.5 at a distance of 2: half of it passes 0.49 along the plane."""
    ball = sphere(jnp.array([0.0, 0.0, 2.0 * unit], dtype), jnp.asarray(0.5 * unit, dtype))
    at = receiver(jnp.zeros(3, dtype), jnp.array([0.0, 0.0, 1.0], dtype))
    edges = light_field(Scene.of(primitive(ball, emission=1.0)), at, axis=axis).edges()
    number = SPACE_SLOPE.axis(axis)
    one, most = (unit, 0.49) if number < 2 else (1.0, 0.253)
    # Beside the middle, so that neither half is met end-on.
    line = np.repeat(np.array([[0.1 * unit, 0.1 * unit, 0.0, 0.0]]), 402, 0)
    line[:, number] = one * np.linspace(-2.0, 2.0, 402)
    for edge in edges:
        sign = np.sign(values(edge.level, line.astype(dtype)))
        (met,) = np.flatnonzero(np.diff(sign))
        np.testing.assert_allclose(abs(line[met, number]) / one, most, rtol=0.0, atol=0.06)


# --- irradiance is one integral of it ------------------------------------------------------------

WEIGHT = Function(lambda x, y, v, w: (1.0 + v * v + w * w) ** -2, SPACE_SLOPE)
REST = Frame(("x", "y", "w"))


def summed(field, nodes, breaks):
    """`E = int L cos(theta) d omega = int L (1 + v^2 + w^2)^-2 dv dw`."""
    over = Integrate("v", -2.5, 2.5, 16)(Multiply(WEIGHT)(field))
    return Integrate("w", -2.5, 2.5, nodes, breaks)(over)


value = eqx.filter_jit(lambda field, u: field.at(u))


def corner(p):
    """Where the outer integral passes a corner."""
    return Function(lambda x, y, w: (y - p[1]) / p[2], REST)


def from_field(scene, at, u, field=lambda L: L):
    """Irradiance of a polygon from its light field: cut at the corners it has no error."""
    L = light_field(scene, at)
    starts = [e.level.start for e in L.edges()]
    return summed(field(L), 16, tuple(corner(p) for p in starts)).at(u)


def directly(scene, at, u):
    moved = at.position + at.axes[:, :2] @ u
    return irradiance(scene, Receiver(moved, at.axes, at.S, at.on))


LAMP = Scene.of(
    primitive(rectangle((0.1, -0.2, 1.0), (0.05, 0.5, 0.1), (0.4, 0.0, -0.05)), emission=(1.0, 2.0))
)


def test_irradiance_of_a_polygon_and_its_gradient_are_integrals_of_the_field():
    """In the position on the plane and in the lamp's centre: the nodes carry boundary terms."""

    def both(of):
        def moved(u, center):
            scene = eqx.tree_at(lambda s: s.groups[0].center, LAMP, center)
            return of(scene, AT, u)

        return jax.jit(jax.value_and_grad(moved, (0, 1)))(jnp.zeros(2), LAMP.groups[0].center)

    for found, truth in zip(
        jax.tree.leaves(both(from_field)), jax.tree.leaves(both(directly)), strict=True
    ):
        assert normwise(found, truth) < 1e-10  # 16 nodes a panel, of a lamp one radian wide


def test_the_jet_of_two_integrals_is_that_of_irradiance():
    """Its one-sided limits lie beside corners, where an edge runs nearly along the inner axis."""
    L = light_field(LAMP, AT)
    starts = [e.level.start for e in L.edges()]
    E = summed(L, 16, tuple(corner(p) for p in starts))
    u = jnp.array([0.03, 0.03])
    found = eqx.filter_jit(lambda E, u: E.jet(u))(E, u)

    def of(u):
        return directly(LAMP, AT, u)

    assert normwise(found.value, of(u)) < 1e-10
    assert normwise(found.gradient, jax.jit(jax.grad(of))(u)) < 1e-9
    assert normwise(found.hessian, jax.jit(jax.hessian(of))(u)) < 1e-8


def room_corner(wall, floor):
    """Integral over w of the light of a wall and a floor, and its jet; the ray starts at z = 1 + y.

    At x, along (1, -v, -w), the wall `X + Y / 2 = 1` is met after s = (1 - x / 2) / (1 - v / 2),
    above the floor while w s < 1 + y.
    """
    scene = Scene.of(
        primitive(plane((1.0, 0.0, 0.0), (-1.0, -0.5, 0.0)), emission=wall),
        primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), emission=floor),
        primitive(plane((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)), emission=9.0),  # below, never seen
    )
    axes = np.roll(np.eye(3), 1, 0)  # t, b, n = Y, Z, X
    at = Receiver((0.0, 0.0, 1.0), axes, np.zeros((2, 2)), -1)
    whole = Integrate("w", -3.0, 3.0, 8)(light_field(scene, at, axis="w"))

    def closed(u):
        x, y, v = u
        end = (1.0 + y) * (1.0 - 0.5 * v) / (1.0 - 0.5 * x)
        return wall * (end + 3.0) + floor * (3.0 - end)

    u = jnp.array([0.1, 0.2, 0.3])
    return whole.jet(u), (closed(u), jax.grad(closed)(u), jax.hessian(closed)(u))


def test_light_ends_at_the_line_in_which_two_planes_meet():
    jet, (value, gradient, hessian) = jax.jit(room_corner)(5.0, 2.0)
    np.testing.assert_allclose(jet.value, value, rtol=1e-13)
    np.testing.assert_allclose(jet.gradient, gradient, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(jet.hessian, hessian, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize(
    "fault",
    [
        lambda L: twin(L, edges=lambda self: ()),
        lambda L: twin(L, edges=lambda self: type(L).edges(self)[1:]),
        lambda L: eqx.tree_at(lambda f: f.plane.axes, L, L.plane.axes * jnp.array([1, -1, 1])),
    ],
    ids=["no edges", "an edge forgotten", "a mirrored plane"],
)
def test_the_integral_notices_a_fault(fault):
    starts = [e.level.start for e in light_field(LAMP, AT).edges()]
    wrong = summed(fault(light_field(LAMP, AT)), 16, tuple(corner(p) for p in starts))
    u = jnp.zeros(2)
    assert abs(value(wrong, u) - directly(LAMP, AT, u)) > 1e-5


def test_irradiance_of_a_ball_converges_as_a_root_at_both_ends_does():
    """Along v its two halves are cut exactly; across it goes as a root, and Gauss' rule as n^-3."""
    scene = Scene.of(primitive(sphere((0.2, -0.1, 1.5), 0.5), emission=1.0))
    y, z = (jnp.array([0.2, -0.1, 1.5]) - AT.position) @ AT.axes[:, 1:]
    # a plane of rays through the t axis touches the ball: (y + w z)^2 = r^2 (1 + w^2)
    ends = np.roots([z * z - 0.25, 2.0 * y * z, y * y - 0.25])
    breaks = tuple(Constant(e, REST) for e in ends)
    L, truth, sizes = light_field(scene, AT), irradiance(scene, AT, nodes=64), (6, 24)
    errors = [abs(value(summed(L, n, breaks), jnp.zeros(2)) - truth) for n in sizes]
    assert fitted_order(sizes, errors) < -2.7
    assert errors[-1] < 1e-4 * truth


# --- samples and their spectrum ------------------------------------------------------------------

H, CENTER, HALF = 1.3, (0.2, -0.15), (0.6, 0.45)
SX, SV, MEAN = 0.5, 0.4, (0.1, -0.05, 0.05, 0.1)
OMEGA = tuple(np.array(o) for o in ([-0.4, 0.0, 0.3], [0.2, 0.0], [0.0, -0.35], [0.25]))
PARALLEL = Scene.of(
    primitive(rectangle((*CENTER, H), (0.0, HALF[1], 0.0), (HALF[0], 0.0, 0.0)), emission=2.0)
)
WINDOW = Gaussian(np.array(MEAN), np.diag([SX**-2, SX**-2, SV**-2, SV**-2]), 1.0, SPACE_SLOPE)


def grid(nx, nv):
    """Five deviations to either side; even and odd sizes."""
    size = (nx, nx + 1, nv, nv + 1)
    return Grid.spanning(size, (5 * SX, 5 * SX, 5 * SV, 5 * SV), MEAN)


def strip(i, Ox, Ov):
    """`int int [|x - H v - c| < a] window(x, v) exp(-2 pi i (Ox x + Ov v)) dx dv`, with erf."""
    mx, mv = MEAN[i], MEAN[i + 2]
    P, q = H * H / SX**2 + SV**-2, H / SX**2
    r = 2j * np.pi * (Ox * H + Ov) - H * mx / SX**2 - mv / SV**2
    alpha = SX**-2 - q * q / P
    beta = q * r / P - 2j * np.pi * Ox + mx / SX**2
    gamma = r * r / (2 * P) - 0.5 * (mx / SX) ** 2 - 0.5 * (mv / SV) ** 2
    scale = 2 * np.pi / np.sqrt(P * alpha) * np.exp(gamma + beta * beta / (2 * alpha))
    low, high = (np.sqrt(alpha / 2) * (CENTER[i] + s * HALF[i] - beta / alpha) for s in (-1, 1))
    return scale * 0.5 * (erf(high) - erf(low))


def strip_sum(i, Ox, Ov, g):
    """The same as a plain sum over the samples of a grid."""
    x, v = np.meshgrid(g.axis(i), g.axis(i + 2), indexing="ij")
    inside = np.abs(x - H * v - CENTER[i]) < HALF[i]
    bell = np.exp(-0.5 * ((x - MEAN[i]) / SX) ** 2 - 0.5 * ((v - MEAN[i + 2]) / SV) ** 2)
    wave = np.exp(-2j * np.pi * (Ox * x + Ov * v))
    return np.sum(inside * bell * wave) * g.step[i] * g.step[i + 2]


def product(of):
    """The lamp's transform at all frequencies, from those of its two strips."""
    one = np.array([[of(0, a, c) for c in OMEGA[2]] for a in OMEGA[0]])
    two = np.array([[of(1, b, d) for d in OMEGA[3]] for b in OMEGA[1]])
    return 2.0 * np.einsum("ac,bd->abcd", one, two)


SIZES = ((8, 13), (12, 20), (20, 33))


@pytest.fixture(scope="module")
def sampled():
    """Samples of a lamp parallel to the plane, under a window, on finer and finer grids."""
    L = Multiply(WINDOW)(light_field(PARALLEL, receiver((0.0, 0.0, 0.0))))
    found = []
    for g in (grid(*size) for size in SIZES):
        points = jnp.asarray(g.points()).reshape(-1, 4)
        found.append(jax.jit(jax.vmap(L.at))(points).reshape(g.size))
    return found


def test_the_spectrum_of_samples_is_the_sum_and_tends_to_the_closed_form(sampled):
    truth, errors = product(strip), []
    for size, samples in zip(SIZES, sampled, strict=True):
        g = grid(*size)
        found = discrete_transform(samples, g, *OMEGA)
        plain = product(lambda i, a, b, g=g: strip_sum(i, a, b, g))
        assert normwise(found, plain) < rounding(samples.size)
        errors.append(normwise(found, truth))
    # edges alias: a sum over a grid misses a strip's length by a step at most, so order 1 at least
    assert fitted_order([nx for nx, _ in SIZES], errors) < -1.0
    assert errors[-1] < 5.0 * SX / SIZES[-1][0] / HALF[1]


def test_the_spline_through_samples_has_every_portrait(sampled):
    """Its transform is that of the samples, times what the cardinal spline does to each axis."""
    g = grid(*SIZES[-1])
    spline = Spline(sampled[-1], g, SPACE_SLOPE)
    found = spline.spectrum()(*np.meshgrid(*OMEGA, indexing="ij"))
    bells = [
        3.0 * np.sinc(h * o) ** 4 / (2.0 + np.cos(2.0 * np.pi * h * o))
        for h, o in zip(g.step, OMEGA, strict=True)
    ]
    expected = discrete_transform(sampled[-1], g, *OMEGA) * np.einsum("a,b,c,d->abcd", *bells)
    assert (
        normwise(found, expected) < 1e-4
    )  # the window has fallen to 4e-6, a coefficient beyond them is some ten times that at the ends
    assert np.all(np.linalg.eigvalsh(spline.covariance().matrix) > 0.0)
    lazily = SampledSpectrum(sampled[-1], g, SPACE_SLOPE).at(jnp.array([o[0] for o in OMEGA]))
    assert normwise(lazily, discrete_transform(sampled[-1], g, *OMEGA)[0, 0, 0, 0]) < rounding(1000)


# --- what it refuses -----------------------------------------------------------------------------


def test_portraits_that_do_not_exist_refuse_and_say_how_to_sample():
    L = light_field(LAMP, AT)
    with pytest.raises(Refused, match=r"SampledSpectrum\.of"):
        L.spectrum()
    with pytest.raises(Refused, match=r"Sampled\.of"):
        L.covariance()
    with pytest.raises(Refused, match="edges"):
        L.series(grid(8, 8))


def test_arguments_that_are_wrong_are_named():
    with pytest.raises(ValueError, match="Argument `frame` must be over"):
        light_field(LAMP, AT, frame=Frame(("x", "v")))
    with pytest.raises(ValueError, match="Argument `axis` must be one of"):
        light_field(LAMP, AT, axis="theta")
    with pytest.raises(ValueError, match=r"Argument `plane.position` must have shape"):
        light_field(LAMP, receiver(np.zeros((2, 3))))
    with pytest.raises(ValueError, match="Argument `plane` must lie on no shape"):
        light_field(LAMP, receiver((0.0, 0.0, 0.0), on=0), frame=LEAVING)


# --- properties ----------------------------------------------------------------------------------


@jax.jit
def _seen_along(change, u):
    """Radiance along a ray, on the ground of a scene that may change; lengths in its unit."""
    plane = worlds.below(change, jnp.zeros(()), jnp.zeros(()))
    light = light_field(worlds.lit(change), plane)
    return light.at(u * jnp.stack([change.scale, change.scale, 1.0, 1.0]))


def seen_along(u, **change):
    return float(_seen_along(worlds.Change(**change).arrays, jnp.asarray(u)))


RAYS = st.tuples(*[worlds.PLACE] * 4)


@given(RAYS, worlds.TURN, worlds.SHIFT, worlds.SIZE)
def test_a_ray_brings_the_same_wherever_the_scene_is(u, turn, shift, scale):
    assert seen_along(u, turn=turn, shift=shift, scale=scale) == seen_along(u)


@given(RAYS, st.tuples(*[worlds.BRIGHT] * worlds.LIGHTS), worlds.SHARE, worlds.SHARE)
def test_along_a_ray_lights_add_and_pieces_do_not_count(u, light, lamp, screen):
    alone = [seen_along(u, light=one) for one in np.eye(worlds.LIGHTS)]
    assert sorted(alone) == [0.0, 0.0, 1.0] or max(alone) < 1.0  # one light, or an edge
    found = seen_along(u, light=light, lamp=lamp, screen=screen)
    np.testing.assert_allclose(found, light @ np.array(alone), rtol=1e-12)


@pytest.mark.parametrize("i", range(4))
def test_a_ray_that_is_nan_is_told(i):
    lamp = primitive(rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)), emission=1.0)
    L = light_field(Scene.of(lamp, environment=0.25), Receiver.at((0.0, 0.0, 0.0)))
    assert np.isnan(L(*np.where(np.arange(4) == i, np.nan, 3.0)))
    assert L(3.0, 3.0, 3.0, 3.0) == 0.25
