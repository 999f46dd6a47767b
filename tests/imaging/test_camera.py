import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.imaging import _bumpy as bumpy
from firstorder.checks.tolerance import normwise
from firstorder.imaging.camera import Pinhole, pinhole

BOUND = 1e-8  # the issue's; differences at 1e-3 of the image leave some 1e-11


@pytest.fixture(scope="module")
def seen():
    """The library on the bumpy ellipsoid: values, gradients, and what they are made of."""
    return jax.tree.map(np.asarray, bumpy.ours())


def test_the_value_is_the_rendered_one(seen):
    rendered = [[bumpy.render(p, near) for p in bumpy.PIXELS] for near in bumpy.NEAR]
    np.testing.assert_allclose(seen[0], rendered, rtol=1e-10)


@pytest.mark.parametrize("kind", [0, 1], ids=["mirror", "glossy"])
@pytest.mark.parametrize("light", [0, 1], ids=["distant", "near"])
def test_the_image_gradient_of_a_bumpy_ellipsoid_is_the_rendered_images(light, kind, seen):
    truth = bumpy.by_differences()[light][:, kind]
    assert normwise(seen[1][light][:, kind], truth) < BOUND


def gradient(seen, kind, turning=None, to_eye=1.0, footprint=None, SV=1.0):
    """The image gradient once more in NumPy, from terms that a fault may change. Near light."""
    view, point, B = seen[2]
    B, found = B[kind], []
    for k in range(len(bumpy.PIXELS)):
        T, dx, dv = (a[1, k] for a in (point.tangents, view.position_D_p, view.to_eye_D_p))
        dn = (point.turning if turning is None else turning)[1, k]
        n, v = point.normal[1, k], view.to_eye[1, k]
        r = 2.0 * (n @ v) * n - v
        spin = 2.0 * np.cross(np.cross(n, dn, axis=0), r, axis=0)
        spatial = SV * B.SV[1, k] + B.DV[1, k] @ spin
        over = B.DV[1, k] @ (2.0 * np.outer(n, n) - np.eye(3))
        slide = T.T @ dx if footprint is None else footprint(T, dx, view, k)
        found.append(spatial @ slide + to_eye * over @ dv)
    return np.array(found)


def plain(seen):
    """The turning of the ellipsoid's own normal, without its bumps."""
    _, point, _ = seen[2]
    slopes = [-np.diag(1.0 / bumpy.RADII**2) @ T for T in point.tangents[1]]
    found = []
    for x, T, slope in zip(point.position[1], point.tangents[1], slopes, strict=True):
        n = np.cross(T[:, 0], T[:, 1])
        size = np.linalg.norm(x / bumpy.RADII**2)
        found.append(-(slope - n[:, None] * (n @ slope)) / size)
    return np.stack([np.array(found)] * 2)


FAULTS = {
    "the eye does not turn": {"to_eye": 0.0},
    "the eye turns the other way": {"to_eye": -1.0},
    "no spatial variation": {"SV": 0.0},
    "no foreshortening": {
        "footprint": lambda T, dx, view, k: -view.distance[1, k] * T.T @ view.to_eye_D_p[1, k]
    },
    "rows for columns": {"footprint": lambda T, dx, view, k: (T.T @ dx).T},
}


@pytest.mark.parametrize("kind", [0, 1], ids=["mirror", "glossy"])
@pytest.mark.parametrize("fault", [None, *FAULTS, "the bumps do not turn the normal", "valley"])
def test_a_fault_is_seen(fault, kind, seen):
    truth = bumpy.by_differences()[1][:, kind]
    changes = FAULTS.get(fault, {})
    if fault == "valley":
        changes = {"turning": -seen[2][1].turning}
    elif fault and fault not in FAULTS:
        changes = {"turning": plain(seen)}
    error = normwise(gradient(seen, kind, **changes), truth)
    assert np.isfinite(error)
    assert error < BOUND if fault is None else error > 1e-3


@pytest.mark.smoke
def test_a_camera_above_a_floor_sees_it_enlarged():
    camera = Pinhole(jnp.array([0.0, 0.0, 4.0]), jnp.eye(3), 2.0)
    view = camera.view(jnp.zeros(2), jnp.array(4.0), jnp.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(view.position_D_p[:2], 2.0 * np.eye(2))
    np.testing.assert_allclose(view.to_eye_D_p[:2], -0.5 * np.eye(2))


def test_a_camera_faces_its_target_with_up_upwards():
    camera = pinhole((2.0, 1.0, 3.0), (0.5, 0.0, 0.0))
    np.testing.assert_allclose(camera.axes.T @ camera.axes, np.eye(3), rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(jnp.linalg.det(camera.axes), 1.0, rtol=1e-5)
    towards = jnp.array([-1.5, -1.0, -3.0])
    np.testing.assert_allclose(
        camera.direction(jnp.zeros(2)), towards / jnp.linalg.norm(towards), rtol=0.0, atol=1e-6
    )
    assert camera.direction(jnp.array([0.0, 0.1]))[2] > camera.direction(jnp.zeros(2))[2]


def test_a_camera_that_sees_nothing_is_refused():
    with pytest.raises(ValueError, match="`gamma` must be positive"):
        pinhole((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), gamma=-1.0)
    with pytest.raises(ValueError, match="`up` must not lie along"):
        pinhole((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_line_of_sight_along_up_is_refused_however_it_is_rounded(dtype):
    """The product of these two is some rounding, whose direction once was that of the image."""
    eye, up = np.array([0.1, 0.2, 0.3], dtype), np.array([1.0, 2.0, 3.0], dtype)
    with pytest.raises(ValueError, match="`up` must not lie along the line of sight"):
        pinhole(eye, np.zeros(3, dtype), up)


def test_a_line_of_sight_nearly_along_up_is_not():
    axes = np.asarray(pinhole((1e-9, 0.0, 3.0), (0.0, 0.0, 0.0)).axes)
    np.testing.assert_allclose(axes, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (((0, 1, 3), (0, np.nan, 0)), "`target` must be finite"),
        (((0, 1, 3), (0, 0, 0), (np.inf, 0, 1)), "`up` must be finite"),
        (((0, 1), (0, 0)), "`eye` must have three coordinates"),
    ],
)
def test_what_makes_no_camera_is_one_sentence(arguments, words):
    with pytest.raises(ValueError, match=words):
        pinhole(*(np.array(a, float) for a in arguments))


def test_a_number_is_no_place_of_an_eye():
    """It was taken for a point with three equal coordinates."""
    with pytest.raises(ValueError, match="`eye` must have three coordinates, but has shape"):
        Pinhole(2.0, np.eye(3), 1.0)


@pytest.mark.parametrize("axes", [2.0 * np.eye(3), np.ones((3, 3)), np.full((3, 3), np.nan)])
def test_axes_of_a_camera_are_orthonormal(axes):
    """With longer ones the footprint was wrong, while directions were right."""
    with pytest.raises(ValueError, match="`axes` must have orthonormal columns"):
        Pinhole(np.zeros(3), axes, 1.0)
