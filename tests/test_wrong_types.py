"""What a newcomer gives first: plain functions, numbers and single things are taken, and the rest
is refused in one sentence, when the thing is made and not at its first value."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND_SLOPE, Frame
from firstorder.fields import (
    Affine,
    Bars,
    Constant,
    Environment,
    Function,
    GaussianProfile,
    HalfPlane,
    NearLight,
    SoftEdge,
    gaussian,
    half_plane,
)
from firstorder.fields._coerce import as_field
from firstorder.flatland import Arcs, Circles, Ellipses
from firstorder.laws import Convolve, Integrate, Multiply
from firstorder.transport import (
    AngularFactor,
    Blend,
    Bump,
    Fresnel,
    Lobe,
    Occlusion,
    PlanarBlockers,
    Reflection,
    Tabulate,
    Texture,
    Travel,
    VaryingGaussian,
    glossy,
    lambert,
)
from firstorder.transport.shading.surface import ReflectedField, Surface
from firstorder.visibility import point_edge_angle, visible_edges

U = jnp.array([0.3, -0.2])
ON = gaussian((0.1, -0.1), (0.6, 0.4))
OUT = gaussian((0.1, -0.1), (0.6, 0.4), frame=ON.frame.turned())


def field(function):
    return Function(function, ON.frame)


TAKEN = {
    "normal of x": (
        lambda: Surface(lambda x: 0.5 * x, (glossy(0.2),)).reflect(ON),
        lambda: Surface(Affine([0.5, 0.0], 0.0), (glossy(0.2),)).reflect(ON),
    ),
    "normal of x and theta": (
        lambda: Surface(lambda x, theta: 0.5 * x, (glossy(0.2),)).reflect(ON),
        lambda: Surface(Affine([0.5, 0.0], 0.0), (glossy(0.2),)).reflect(ON),
    ),
    "normal by number": (
        lambda: Surface(0.3, (glossy(0.2),)).reflect(ON),
        lambda: Surface(Constant(0.3), (glossy(0.2),)).reflect(ON),
    ),
    "one lobe": (
        lambda: Surface(Constant(0.3), glossy(0.2)).reflect(ON),
        lambda: Surface(Constant(0.3), (glossy(0.2),)).reflect(ON),
    ),
    "lobes in a list": (
        lambda: Surface(Constant(0.3), [glossy(0.2), lambert(0.4)]).reflect(ON),
        lambda: Surface(Constant(0.3), (glossy(0.2), lambert(0.4))).reflect(ON),
    ),
    "texture of x": (
        lambda: Surface(Constant(0.3), glossy(0.2), lambda x: x * x).reflect(ON),
        lambda: Surface(Constant(0.3), glossy(0.2), field(lambda x, t: x * x)).reflect(ON),
    ),
    "light by function": (
        lambda: Surface(Constant(0.3), glossy(0.2)).reflect(lambda x, t: jnp.exp(-x * x - t * t)),
        lambda: Surface(Constant(0.3), glossy(0.2)).reflect(
            field(lambda x, t: jnp.exp(-x * x - t * t))
        ),
    ),
    "bump of x": (
        lambda: Bump(lambda x: jnp.sin(x))(ON),
        lambda: Bump(field(lambda x, t: jnp.sin(x)))(ON),
    ),
    "transparency of x": (
        lambda: Occlusion(lambda x: 0.5 + 0.1 * x)(light(FLATLAND_SLOPE)),
        lambda: Occlusion(Affine([0.1, 0.0], 0.5))(light(FLATLAND_SLOPE)),
    ),
    "transparency by number": (
        lambda: Occlusion(0.5)(light(FLATLAND_SLOPE)),
        lambda: 0.5 * light(FLATLAND_SLOPE),
    ),
    "one layer": (
        lambda: PlanarBlockers(half_plane(0.1), [0.4])(ON),
        lambda: PlanarBlockers((half_plane(0.1),), [0.4])(ON),
    ),
    "pattern of x": (
        lambda: Texture(lambda x: x * x)(ON),
        lambda: Texture(field(lambda x, t: x * x))(ON),
    ),
    "factor of the angle": (
        lambda: AngularFactor(jnp.cos)(ON),
        lambda: AngularFactor(field(lambda x, t: jnp.cos(t)))(ON),
    ),
    "factor of a law": (
        lambda: Multiply(lambda x, t: x * t)(ON),
        lambda: Multiply(field(lambda x, t: x * t))(ON),
    ),
    "distant light by direction": (
        lambda: Environment(lambda theta: jnp.cos(theta)),
        lambda: Environment(Function(lambda theta: jnp.cos(theta), Frame(("theta",)))),
    ),
    "near light by distance": (
        lambda: NearLight([0.0, 2.0], lambda q: jnp.exp(-q * q)),
        lambda: NearLight([0.0, 2.0], Function(lambda q: jnp.exp(-q * q), Frame(("x",)))),
    ),
    "constant function": (lambda: Multiply(lambda x: 2)(ON), lambda: 2.0 * ON),
    "width of x": (
        lambda: Reflection(VaryingGaussian(lambda x: 0.2 + 0.01 * x, 0.3))(OUT),
        lambda: Reflection(VaryingGaussian(Affine([0.01, 0.0], 0.2), 0.3))(OUT),
    ),
    "weights by number": (
        lambda: Reflection(Blend(GaussianProfile(0.2), 0.5))(OUT),
        lambda: Reflection(Blend((GaussianProfile(0.2),), (Constant(0.5),)))(OUT),
    ),
}


@pytest.mark.parametrize("name", TAKEN)
@pytest.mark.parametrize("compiled", [False, True], ids=["eager", "jitted"])
def test_what_is_meant_is_taken(name, compiled):
    jets = []
    for make in TAKEN[name]:
        found = (jax.jit(lambda u, make=make: make().jet(u)) if compiled else make().jet)(U)
        jets.append(found)
    for a, b in zip(*map(jax.tree.leaves, jets), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-13)


def test_a_function_of_a_traced_parameter_is_differentiable():
    def shading(k):
        return Surface(lambda x: k * x, glossy(0.2)).reflect(ON).at(U)

    step = 1e-6
    slope = (shading(0.4 + step) - shading(0.4 - step)) / (2.0 * step)
    assert abs(jax.grad(shading)(0.4) - slope) < 1e-8


REFUSED = {
    "text for a normal": (
        lambda: Surface("0.3", (glossy(0.2),)),
        r"Argument `normal` must be a field, a function or a number, but is a str\.",
    ),
    "numbers for a normal": (
        lambda: Surface((0.3, 0.1), (glossy(0.2),)),
        r"Argument `normal` must be a field, a function or a number, but is a tuple\.",
    ),
    "three arguments": (
        lambda: Surface(lambda x, theta, t: x, (glossy(0.2),)),
        r"Argument `normal` must be a function of x or of x and theta, but takes 3 arguments\.",
    ),
    "a number for a lobe": (
        lambda: Surface(0.3, 0.2),
        r"Argument `reflectance` must hold lobes and BRDFs, but holds a float\.",
    ),
    "a class for a field": (
        lambda: Occlusion(Constant),
        r"Argument `transparency` must be a field, .* but is the class Constant\.",
    ),
    "text for distant light": (
        lambda: Environment("sky"),
        r"Argument `light` must be a field, a function or a number, but is a str\.",
    ),
    "text for near light": (
        lambda: NearLight([0.0, 1.0], "lamp"),
        r"Argument `emission` must be a field, a function or a number, but is a str\.",
    ),
    "a lobe for a field": (
        lambda: Multiply(glossy(0.2)),
        r"Argument `factor` must be a field, a function or a number, but is a Lobe\.",
    ),
    "text for light": (
        lambda: ReflectedField("light", Surface(0.0, glossy(0.2))),
        r"Argument `light` must be a field, a function or a number, but is a str\.",
    ),
    "text for an end": (
        lambda: Integrate("theta", "low", 1.0),
        r"Argument `lower` must be a number or a field, but is 'low'\.",
    ),
    "text for a coordinate": (
        lambda: ON("0.3", 0.1),
        r"Arguments of Gaussian must be numbers or arrays, the coordinates x, theta, but are '0.3'",
    ),
    "text for a frequency": (
        lambda: ON.spectrum()("0.3", 0.1),
        r"Arguments of GaussianSpectrum must be numbers or arrays",
    ),
    "text for a ray": (
        lambda: ON.jet("ray"),
        r"Argument `u` of Gaussian must be one ray, the numbers x, theta, but is 'ray'\.",
    ),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_meant_is_one_sentence(name):
    make, sentence = REFUSED[name]
    with pytest.raises(TypeError, match=f"^{sentence}"):
        make()


@pytest.mark.smoke
@pytest.mark.parametrize(("make", "name"), [(Reflection, "lobe"), (Convolve, "kernel")])
def test_a_lobe_is_no_kernel(make, name):
    """With the import hook it is beartype that says it."""
    ours = rf"^Argument `{name}` must be a kernel, .* but is a Lobe\.$"
    with pytest.raises(TypeError, match=rf"{ours}|parameter {name}="):
        make(glossy(0.2))


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (lambda x: HalfPlane(x, 0.0, 1.0), "level", "an `Affine`"),
        (lambda x: SoftEdge(x, 0.1), "level", "an `Affine`"),
        (lambda x: Bars(x, [0.0, 1.0], [0.0, 1.0, 0.0]), "level", "an `Affine`"),
        (Function, "function", "a function of the coordinates"),
    ],
)
def test_a_number_is_no_edge_and_no_function(make, name, words):
    """With the import hook it is beartype that says it."""
    ours = rf"^Argument `{name}` must be {words}, but is a float\.$"
    with pytest.raises(TypeError, match=rf"{ours}|parameter {name}="):
        make(3.0)


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (Lobe, "kernel", r"a kernel, such as GaussianProfile\(0\.1\)"),
        (lambda x: Lobe(GaussianProfile(0.1), x), "argument", "MIRROR, NORMAL or RETRO"),
        (Tabulate, "grid", r"a grid, as `Grid\.spanning` makes one"),
    ],
)
def test_a_word_is_no_part_of_an_event(make, name, words):
    """With the import hook it is beartype that says it."""
    ours = rf"^Argument `{name}` must be {words}, but is a str\.$"
    with pytest.raises(TypeError, match=rf"{ours}|parameter {name}="):
        make("mirror")


@pytest.mark.smoke
def test_a_class_is_no_function():
    with pytest.raises(
        TypeError, match=r"`function` must be a function .*, but is the class Travel"
    ):
        Function(Travel)


@pytest.mark.smoke
def test_an_event_acts_on_light():
    """With the import hook it is beartype that says it."""
    ours = r"^Travel acts on light, .* and not on a function:"
    with pytest.raises(TypeError, match=rf"{ours}|parameter portrait="):
        Travel(1.0)(as_function)


def as_function(x, v):
    return x * v


@pytest.mark.smoke
def test_a_function_of_one_angle_says_what_it_is_asked_with():
    with pytest.raises(
        ValueError, match=r"^Arguments of Fresnel must be the 2 coordinates x, theta"
    ):
        Fresnel(1.5)(0.3)


@pytest.mark.parametrize("ask", ["at", "jet"])
def test_a_ray_may_be_a_list_and_must_have_all_coordinates(ask):
    jets = [getattr(ON, ask)(u) for u in (U, [0.3, -0.2], (0.3, -0.2), np.array([0.3, -0.2]))]
    for other in jets[1:]:
        jax.tree.map(np.testing.assert_array_equal, other, jets[0])
    for wrong in (0.3, [0.3], [0.3, 0.1, 0.2], np.zeros((5, 2))):
        says = (
            r"^Argument `u` of Gaussian must be one ray, the 2 coordinates x, theta, but has shape"
        )
        with pytest.raises(ValueError, match=says):
            getattr(ON, ask)(wrong)


def test_functions_that_take_anything_take_all_coordinates():
    assert as_field(lambda *u: u[0] * u[1], "factor")(2.0, 3.0) == 6.0
    assert as_field(lambda x, theta, scale=2.0: scale * theta, "factor")(2.0, 3.0) == 6.0
    assert as_field(np.float64(0.5), "factor")(2.0, 3.0) == 0.5


def test_one_blocker_needs_no_list():
    low, high = (point_edge_angle((s, 2.0), side=s) for s in (1.0, -1.0))
    many = [point_edge_angle(jnp.array([[s, 2.0]]), side=s) for s in (1.0, -1.0)]
    jax.tree.map(np.testing.assert_array_equal, visible_edges(low, high), visible_edges(*many))
    jitted = jax.jit(lambda x: visible_edges(point_edge_angle((x, 2.0)), high).edges.value)(1.0)
    np.testing.assert_allclose(jitted, visible_edges(low, high).edges.value, rtol=1e-14)


def test_one_number_stands_for_all_shapes():
    two = [(0.0, 2.0), (1.0, 2.0)]
    assert Circles(two, 0.5).radius.tolist() == [0.5, 0.5]
    assert Ellipses(two, (0.5, 0.2)).semi.shape == (2, 2)
    assert Ellipses(two, (0.5, 0.2), 0.1).tilt.tolist() == [0.1, 0.1]
    assert Arcs(two, 0.5, [0.0, 0.1], 1.0).sweep.tolist() == [1.0, 1.0]
    assert jax.jit(lambda r: Circles(jnp.asarray(two), r).radius)(0.5).tolist() == [0.5, 0.5]
    with pytest.raises((TypeError, ValueError)):
        Circles(two, [0.5, 0.5, 0.5])
