"""Frames that nobody stated are those of the light; a stated one that does not fit is named."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.fields import (
    Affine,
    Bars,
    BoxProfile,
    Constant,
    Function,
    Gaussian,
    GaussianProfile,
    HalfPlane,
    Separable,
    SoftEdge,
    Sum,
    UniformProfile,
    gaussian,
    half_plane,
    spot_light,
)
from firstorder.transport import (
    AngularFactor,
    Mirror,
    Occlusion,
    PlanarBlockers,
    Reflection,
    Texture,
    Travel,
    VaryingGaussian,
    half_plane_blocker,
    wave,
)
from firstorder.transport.events.travel import line_light

SLOPE, ANGLE = FLATLAND_SLOPE, FLATLAND
FACTORS = {
    "half-plane": lambda **f: half_plane(0.2, 0.3, **f),
    "stair": lambda **f: Bars(Affine([1.0, 0.1], 0.2, **f), [-0.3, 0.4], [0.2, 1.0, 0.4]),
    "soft edge": lambda **f: SoftEdge(Affine([1.0, 0.0], 0.1, **f), 0.3),
    "function": lambda **f: Function(lambda x, a: jnp.cos(x + a), **f),
    "constant": lambda **f: Constant(0.4, **f),
    "wave": lambda **f: wave(0.4, 0.5, mean=0.5, **f),
    "sum": lambda **f: 0.5 * wave(0.4, **f) + half_plane(0.1, **f),
    "bell": lambda **f: gaussian((0.0, 0.1), (0.5, 0.4), **f),
    "box": lambda **f: BoxProfile(0.3, "x", **f),
}


@pytest.mark.parametrize("frame", [SLOPE, ANGLE, Frame(("x", "v"), "outgoing")])
@pytest.mark.parametrize("name", FACTORS)
def test_a_factor_takes_the_frame_of_the_light(name, frame):
    L, u = light(frame), jnp.array([0.3, -0.2])
    ours = Occlusion(FACTORS[name](), 0.5)(L)
    stated = Occlusion(FACTORS[name](frame=frame), 0.5)(L)
    jax.tree.map(np.testing.assert_array_equal, ours.jet(u), stated.jet(u))
    assert [e.level.frame.coordinates for e in ours.edges()] == [
        e.level.frame.coordinates for e in stated.edges()
    ]
    assert Texture(FACTORS[name]())(L)(0.3, -0.2) == Texture(FACTORS[name](frame=frame))(L)(
        0.3, -0.2
    )


def test_a_slope_path_without_a_word_about_frames():
    L = gaussian((0.1, 0.0), (0.5, 0.3), frame=SLOPE)
    path = L >> Travel(1.0) >> Occlusion(half_plane(0.2)) >> Travel(0.5)
    layers = L >> PlanarBlockers((half_plane(0.2), wave(0.3, 0.2, mean=0.5)), [0.2, 0.4])
    stated = L >> Travel(1.0) >> half_plane_blocker(0.2, SLOPE) >> Travel(0.5)
    assert path.light(0.4, 0.1) == stated.light(0.4, 0.1)
    assert path.light.spectrum()(0.3, 0.1) == stated.light.spectrum()(0.3, 0.1)
    assert layers.light(0.4, 0.1) > 0


def test_compiled_factors_take_the_frame_of_the_light_too():
    def behind(edge):
        return Occlusion(half_plane(edge))(light(SLOPE)).at(jnp.array([0.3, -0.2]))

    assert jax.jit(behind)(0.2) == behind(0.2)


@pytest.mark.parametrize(
    ("make", "frame"),
    [
        (lambda: half_plane(0.2, axis="v"), SLOPE),
        (lambda: half_plane(0.2, axis="theta"), ANGLE),
        (lambda: wave(0.2, axis="v"), SLOPE),
        (lambda: GaussianProfile(0.2, "v"), SLOPE),
        (lambda: GaussianProfile(0.2), ANGLE),
        (lambda: BoxProfile(0.2, "theta"), ANGLE),
        (lambda: UniformProfile("v"), SLOPE),
        (lambda: VaryingGaussian(wave(0.2, 0.1, mean=0.3), 0.5, "v"), SLOPE),
        (lambda: Separable([0.0, 0.0], (GaussianProfile(0.3, "x"), UniformProfile("v"))), SLOPE),
        (
            lambda: Separable([0.0, 0.0], (BoxProfile(0.3, "x"), GaussianProfile(0.2, "theta"))),
            ANGLE,
        ),
        (lambda: spot_light(0.0, 0.5, GaussianProfile(0.3, "v")), SLOPE),
        (lambda: line_light(spot_light(0.0, 0.5, GaussianProfile(0.3, "v")), 1.0), SLOPE),
        (lambda: light(SLOPE) + gaussian((0.0, 0.0), (1.0, 1.0)), SLOPE),
        (lambda: Sum((Constant(1.0), half_plane(0.1, axis="v")), jnp.ones(2)), SLOPE),
    ],
)
def test_the_name_of_an_axis_states_the_frame(make, frame):
    field = make()
    assert field.frame == frame
    assert not field.frame.implied
    assert np.isfinite(field(0.1, 0.05))


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("event", "argument"),
    [
        (Occlusion(half_plane(0.2, axis="theta")), "transparency"),
        (Occlusion(half_plane(0.2, frame=ANGLE)), "transparency"),
        (Occlusion(HalfPlane(Affine([1.0, 0.0], 0.0, ANGLE), 0.0, 1.0)), "transparency"),
        (PlanarBlockers((half_plane(0.2, axis="theta"),), [0.0]), "transparencies"),
        (Texture(wave(0.2, axis="theta")), "pattern"),
    ],
)
def test_a_stated_frame_that_does_not_fit_names_the_argument(event, argument):
    name = type(event).__name__
    says = rf"^Argument `{argument}` of {name} must be over \('x', 'v'\) like the light"
    with pytest.raises(ValueError, match=says) as caught:
        event(light(SLOPE))
    assert "but is over ('x', 'theta')." in str(caught.value)


def test_a_lobe_along_an_angle_in_slopes_is_named():
    with pytest.raises(
        ValueError, match=r"^Argument `lobe` of Reflection .* acts along 'theta'\.$"
    ):
        Reflection(GaussianProfile(0.2))(Mirror()(light(SLOPE)))
    along = Reflection(GaussianProfile(0.2, "v"))(Mirror()(light(SLOPE)))
    assert np.isfinite(along(0.1, 0.2))


def test_what_needs_angles_says_so_of_the_light():
    with pytest.raises(ValueError, match="AngularFactor needs light in angles"):
        AngularFactor(Function(lambda x, t: jnp.cos(t)))(light(SLOPE))


def test_an_unstated_frame_of_two_coordinates_does_not_fit_four():
    with pytest.raises(ValueError, match="Argument `transparency` of Occlusion must be over"):
        Occlusion(half_plane(0.2))(gaussian_in_space())
    assert half_plane(0.2, frame=SPACE).frame == SPACE


def gaussian_in_space():
    return Gaussian(jnp.zeros(4), jnp.eye(4), 1.0, SPACE)
