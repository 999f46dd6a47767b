import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import (
    Circles,
    Receiver,
    Scene,
    Segments,
    box,
    closed_curve,
    irradiance,
    polyline,
    primitive,
)


def test_polylines_and_boxes():
    assert polyline([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], closed=True).count == 3
    room = box((0.0, 0.0), (2.0, 1.0), inward=True)
    assert room.start.tolist() == [[0, 0], [2, 0], [2, 1], [0, 1]]
    solid = box((0.0, 0.0), (2.0, 1.0))
    assert solid.start.tolist() == [[0, 0], [0, 1], [2, 1], [2, 0]]


def test_a_closed_curve_goes_through_its_points_clockwise():
    a = 2.0 * np.pi * np.arange(32) / 32
    points = np.stack([np.cos(a) + 0.1 * np.cos(2.0 * a), np.sin(a)], -1)
    curve = closed_curve(points, 4)
    k = np.arange(5) * 2.0 * np.pi

    def at(s):
        return np.cos(k * s) @ curve.cosines[0] + np.sin(k * s) @ curve.sines[0]

    # The points run counter-clockwise, so they are met in the other order.
    assert np.allclose([at(s) for s in np.arange(32) / 32], points[::-1], rtol=0.0, atol=1e-12)


def test_light_behind_a_closed_curve_is_differentiated_by_its_points():
    a = 2.0 * np.pi * np.arange(16) / 16

    def light(shape):
        lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
        return irradiance(Scene.of(lamp, primitive(shape)), Receiver((0.05, 0.0), 0.0))

    def behind_points(r, turn=1.0):
        points = jnp.stack([0.1 + r * jnp.cos(a), 0.5 + turn * r * jnp.sin(a)], -1)
        return light(closed_curve(points, 2))

    there, back = (jax.jit(jax.value_and_grad(behind_points))(0.1, turn) for turn in (1.0, -1.0))
    circle = jax.jit(jax.value_and_grad(lambda r: light(Circles((0.1, 0.5), r))))(0.1)
    np.testing.assert_allclose(there, circle, rtol=1e-12)
    np.testing.assert_allclose(back, circle, rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: polyline([(0.0, 0.0)]), "`points` must have shape"),
        (lambda: closed_curve(np.zeros((8, 2)), 4), "`points` must have shape"),
        (lambda: box((2.0, 0.0), (0.0, 1.0)), "`high` must be above `low` in both coordinates"),
        (lambda: box((0.0, np.nan), (1.0, 1.0)), "`high` must be above `low` in both coordinates"),
        (lambda: box((0.0, 0.0, 0.0), (1.0, 1.0)), r"`low` must have shape \(2,\)"),
    ],
)
def test_bad_points_are_refused_in_one_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_traced_box_with_exchanged_corners_is_nan():
    walls = jax.jit(lambda right: box((0.0, 0.0), (right, 1.0)).start)
    assert np.isnan(walls(-1.0)).any()
    assert walls(2.0).tolist() == box((0.0, 0.0), (2.0, 1.0)).start.tolist()


def test_a_function_is_not_points():
    with pytest.raises(TypeError, match=r"^A number or an array is asked for, but <function"):
        closed_curve(lambda s: (np.cos(s), np.sin(s)))


@pytest.mark.parametrize(("dtype", "radius"), [("float32", 1.0), ("float64", 1e-4)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_curve_far_from_the_origin_is_not_turned_inside_out(dtype, radius, way):
    a = 2.0 * np.pi * np.arange(64) / 64
    bean = np.stack([np.cos(a), np.sin(a) + 0.3 * np.cos(2.0 * a)], -1)[::way]
    made = closed_curve((radius * bean + np.array([1e5, 7e4])).astype(dtype), 4)
    cosines, sines = (np.asarray(c[0], float) for c in (made.cosines, made.sines))
    area = np.pi * np.sum(
        np.arange(5) * (cosines[:, 0] * sines[:, 1] - cosines[:, 1] * sines[:, 0])
    )
    assert area < -2.0 * radius**2  # clockwise
