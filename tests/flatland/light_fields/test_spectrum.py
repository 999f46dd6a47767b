"""The spectrum of a scene's light: two planes by E11, fine samples, lines that pierce shapes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import FLATLAND_SLOPE
from firstorder.errors import Refused
from firstorder.fields import BoxProfile, Grid, Separable, discrete_transform
from firstorder.flatland import (
    ConstantSky,
    PanoramaSky,
    Receiver,
    Scene,
    Segments,
    box,
    light_field,
    primitive,
)
from firstorder.flatland.light_fields import spectrum_in
from firstorder.flatland.light_fields.spectrum import series_in
from firstorder.laws import Move
from firstorder.shadowfield import PLANE, PlanarShadowSpectrum
from firstorder.shadowfield.plane.spectra import _Outer
from tests.flatland.light_fields.test_field import crossing, round_ones, uneven


@pytest.fixture(autouse=True, scope="module")
def _double():
    with jax.enable_x64(True):
        yield


def two_planes(d1, d2):
    """A lamp over a slit in an opaque plane, seen from below; its light is a parallelogram."""
    lamp = primitive(Segments((0.3, d1), (-0.2, d1)), emission=1.0)
    y = d1 - d2
    plane = Segments([(-40.0, y), (0.15, y)], [(-0.1, y), (40.0, y)])
    scene = Scene.of(lamp, primitive(plane))
    return light_field(scene, Receiver((0.0, 0.0), 0.0), frame=FLATLAND_SLOPE)


def test_the_spectrum_of_two_planes_is_that_of_e11():
    d1, d2 = 1.0, 0.4
    F = two_planes(d1, d2).spectrum_in(Grid.spanning((16, 16), (2.0, 2.0)))
    light, slit = (
        Separable([middle], (BoxProfile(half, "y", PLANE),)).spectrum()
        for middle, half in ((0.05, 0.25), (0.025, 0.125))
    )
    shear = Move([[1.0, -d1], [1.0, -(d1 - d2)]], to=FLATLAND_SLOPE)
    true = shear(_Outer(light, slit, FLATLAND_SLOPE))
    w = np.linspace(-3.0, 3.0, 13)
    assert np.max(np.abs(F(w[:, None], w) - true(w[:, None], w))) < 1e-14
    shadow = PlanarShadowSpectrum(slit, light, d1, d2)  # all slopes together, dy = d1 dv
    assert np.max(np.abs(F(w, 0.0) - shadow(w) / d1)) < 1e-14


def test_the_spectrum_in_a_box_under_a_constant_sky_is_that_of_fine_samples():
    scene = Scene.of(*crossing()[:2], environment=ConstantSky(0.3))
    f = light_field(scene, Receiver((0.1, -0.2), 0.15), frame=FLATLAND_SLOPE)
    grid = Grid.spanning((600, 601), (1.3, 0.9), (0.2, -0.1))
    F = f.spectrum_in(grid)(np.array([0.0, 0.4, 1.1])[:, None], np.array([-0.7, 0.0, 0.5]))
    samples = jax.jit(jax.vmap(f.at))(grid.points().reshape(-1, 2)).reshape(grid.size)
    sampled = discrete_transform(
        samples, grid, np.array([0.0, 0.4, 1.1]), np.array([-0.7, 0.0, 0.5])
    )
    assert np.max(np.abs(F - sampled)) < 1e-3 * np.max(np.abs(sampled))


def test_it_refuses_with_a_reason_what_has_no_closed_form():
    grid = Grid.spanning((8, 8), (1.0, 1.0))
    line, segments = Receiver((0.0, 0.0), 0.0), Scene.of(*crossing()[:2])
    field = light_field(segments, line)
    with pytest.raises(Refused, match="needs a window"):
        field.spectrum()
    with pytest.raises(Refused, match="infinite covariance"):
        field.covariance()
    pierced = Receiver((0.0, 0.9), 0.0)
    sky = Scene.of(*crossing()[:2], environment=PanoramaSky([1.0, 2.0, 1.0, 2.0]))
    for light, why in (
        (field, "curved over angles"),
        (light_field(round_ones(), line, frame=FLATLAND_SLOPE), "round shapes"),
        (light_field(segments, line, frame=FLATLAND_SLOPE, radiance=uneven), "varies"),
        (light_field(sky, line, frame=FLATLAND_SLOPE), "varies"),
        (light_field(segments, pierced, frame=FLATLAND_SLOPE), "passes through"),
    ):
        with pytest.raises(Refused, match=why):
            light.series(grid)


# --- lines that pass through a shape -------------------------------------------------------------


def pierces(start, end, low, high):
    """Whether any of many points of a segment lies on the x axis between two places.

    For ends on a lattice of few units one of 60 equal steps is a crossing to the last digit.
    """
    t = np.arange(61)[:, None]
    x, y = (60 * np.array(start) + t * (np.array(end) - np.array(start))).T
    return bool(np.any((y == 0) & (60 * low < x) & (x < 60 * high)))


@jax.jit
@jax.vmap
def mean(start, end):
    """The field's mean over a box about x = 1, a unit and a half to both sides."""
    scene = Scene.of(primitive(Segments(start, end), emission=1.0))
    light = light_field(scene, Receiver((4.0, -2.0), 0.0), frame=FLATLAND_SLOPE)
    return spectrum_in(light, Grid.spanning((4, 4), (1.5, 1.0), (1.0, 0.0)))(0.0, 0.0).real


def test_there_is_no_spectrum_where_the_line_passes_through_a_shape_or_touches_it():
    """All segments on a lattice: above, below, across, along and to both sides of the box."""
    points = np.stack(np.meshgrid(np.arange(-2, 5), np.arange(-2, 3)), -1).reshape(-1, 2)
    pairs = [(a, b) for a in points for b in points if np.any(a != b)]
    start, end = np.moveaxis(np.array(pairs), 1, 0)
    truth = np.array([pierces(a, b, -0.5, 2.5) for a, b in pairs])
    place = np.array([4.0, -2.0])
    found = mean(jnp.asarray(start + place), jnp.asarray(end + place))
    assert 0.2 < np.mean(truth) < 0.8
    np.testing.assert_array_equal(np.isnan(found), truth)


def test_the_shape_on_which_the_line_lies_does_not_pierce_it():
    floor = primitive(Segments((-3.0, 0.0), (3.0, 0.0)))
    scene = Scene.of(floor, primitive(Segments((1.0, 2.0), (-1.0, 2.0)), emission=1.0))
    box = Grid.spanning((4, 4), (5.0, 1.0))
    for on in (0, -1):
        light = light_field(scene, Receiver((0.0, 0.0), 0.0, on), frame=FLATLAND_SLOPE)
        if on == 0:  # a strip of width 2 and height 2
            assert spectrum_in(light, box)(0.0, 0.0).real == pytest.approx(4.0)
        else:
            with pytest.raises(Refused, match="passes through"):
                spectrum_in(light, box)


def test_the_series_of_a_box_has_the_mean_of_light_times_each_wave():
    """A lamp from -0.4 to 0.4, 2 above the line: it is seen where `|x - 2 v| < 0.4`."""
    lamp = primitive(Segments((0.4, 2.0), (-0.4, 2.0)), emission=1.5)
    light = light_field(Scene.of(lamp), Receiver((0.0, 0.0), 0.0), frame=FLATLAND_SLOPE)
    found = series_in(light, Grid.spanning((5, 4), (3.0, 1.0)))
    v = (np.arange(4000) + 0.5) / 2000 - 1.0
    for w, c in zip(np.asarray(found.frequencies), np.asarray(found.coefficients), strict=True):
        # Along x the light is a box about 2 v, within the period.
        wave = np.exp(-2j * np.pi * (w[0] * 2.0 * v + w[1] * v))
        mean = 1.5 * 0.8 * np.sinc(0.8 * w[0]) * wave.mean() / 6.0
        np.testing.assert_allclose(c, mean, rtol=0.0, atol=1e-6)
    steps = np.sort(np.asarray(found.frequencies), axis=0)
    np.testing.assert_allclose(np.unique(steps[:, 0]), np.arange(-2, 3) / 6.0, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(np.unique(steps[:, 1]), [-1.0, -0.5, 0.0, 0.5], rtol=0.0, atol=1e-15)


def by_samples(L, Omega, n=200):
    """Transform of a light field in the box [-1, 1]^2, by the middles of cells."""
    t = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    u = np.stack(np.meshgrid(t, t, indexing="ij"), -1).reshape(-1, 2)
    values = np.asarray(jax.jit(jax.vmap(L.at))(jnp.asarray(u)))
    return np.sum(values * np.exp(-2j * np.pi * (u @ Omega))) * (2.0 / n) ** 2


CORNERED = {
    "box": primitive(box((-0.4, 1.0), (0.4, 1.5)), emission=1.0),
    "two lamps": primitive(
        Segments([(0.4, 1.0), (0.0, 1.0)], [(0.0, 1.0), (-0.4, 1.0)]),
        emission=[[1.0, 0.0], [3.0, 0.0]],
    ),
}


@pytest.mark.parametrize("name", CORNERED)
def test_the_common_end_of_two_segments_is_one_edge(name):
    L = light_field(Scene.of(CORNERED[name]), Receiver((0.0, 0.0), 0.0), frame=FLATLAND_SLOPE)
    F = L.spectrum_in(Grid((64, 64), (2 / 64, 2 / 64), (0.0, 0.0)))
    for Omega in ((0.0, 0.0), (0.5, 0.3)):
        assert abs(complex(F(*Omega)) - by_samples(L, np.array(Omega))) < 0.01


def shadowed(at, dtype="float64"):
    """A lamp behind a blocker, both turned, seen from a place."""
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])

    def piece(a, b):
        return Segments(*((turn @ np.array(p) + at).astype(dtype) for p in (a, b)))

    lamp = primitive(piece((0.3, 1.0), (-0.3, 1.0)), emission=1.0)
    plate = primitive(piece((-0.2, 0.5), (0.15, 0.5)))
    eye = Receiver(np.asarray(at, dtype), np.asarray(0.3, dtype))
    return light_field(Scene.of(lamp, plate), eye, frame=FLATLAND_SLOPE)


@pytest.mark.parametrize(("dtype", "far"), [("float64", 1e6), ("float32", 300.0)])
def test_the_spectrum_far_from_the_origin_is_the_same(dtype, far):
    window = Grid((64, 64), (2 / 64, 2 / 64), (0.0, 0.0))
    near, there = (
        complex(shadowed(at, kind).spectrum_in(window)(0.5, 0.3))
        for at, kind in ((np.zeros(2), "float64"), (far * np.array([0.73, 0.41]), dtype))
    )
    assert abs(there - near) < 1e-4 * abs(near)
