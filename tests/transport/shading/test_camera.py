import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.transport.shading.camera import trace
from firstorder.conventions import FLATLAND
from firstorder.fields import Affine, autodiff_jet, gaussian
from firstorder.transport.brdf.lobes import glossy
from firstorder.transport.shading.camera import (
    BaseSurface,
    Camera,
    distant_image_gradient,
    image_jet,
)
from firstorder.transport.shading.surface import Surface

LIGHT = gaussian((0.21, -0.13), (0.55, 0.4), 0.35, 1.3)
OUT = gaussian((0.21, -0.13), (0.55, 0.4), 0.35, 1.3, FLATLAND.turned())


@pytest.mark.smoke
def test_the_image_of_a_flat_floor_is_a_projection():
    view = Camera((0.3, 2.0), 1.5).derivatives(jnp.asarray(0.6))
    np.testing.assert_allclose(view.x, 0.3 + 2.0 * 0.6 / 1.5)  # to the right, with px
    np.testing.assert_allclose(jnp.tan(view.theta), 0.6 / 1.5)  # light goes up and to the left


def test_right_of_the_eye_light_turns_counter_clockwise_to_reach_it():
    theta = Camera((0.0, 1.0), 1.0).derivatives(jnp.asarray(1.0)).theta
    assert theta > 0


@pytest.mark.parametrize("kappa", [0.0, 1e-12, -1e-5, 1e-3, -0.5, 0.3])
def test_a_ray_meets_the_base_where_it_is_traced(kappa):
    camera = Camera((0.3, 2.0), 1.3, BaseSurface(kappa, 0.2))
    views = jax.vmap(camera.derivatives)(jnp.array([-0.2, 0.3]))
    truth = [trace(px, kappa, 0.2, (0.3, 2.0)) for px in (-0.2, 0.3)]
    np.testing.assert_allclose(np.stack([views.x, views.theta], -1), truth, rtol=0.0, atol=1e-13)


def test_how_far_along_the_base_a_point_straight_below_lies_as_it_begins_to_bend():
    """`sin(kappa x) = kappa e`, so `dx / dkappa = kappa e^3 / 3 + 3 kappa^3 e^5 / 10 + ...`."""
    e, kappa = 1.1, 8e-4
    found = jax.grad(lambda k: BaseSurface(k).hit(jnp.array([e, 2.0]), jnp.array(0.0)))(kappa)
    a = kappa * e
    assert found == pytest.approx(e**2 * (a / 3.0 + 0.3 * a**3), rel=1e-10)


def test_an_eye_at_the_middle_of_a_circle_sees_the_point_across_from_its_start():
    ring, middle = BaseSurface(1.0, np.pi, (0.0, 1.0)), jnp.zeros(2)
    theta = jnp.array([-0.3, -2e-4, 0.0, 5e-4, 0.3])
    seen = ring.position(jax.vmap(lambda t: ring.hit(middle, t))(theta))
    np.testing.assert_allclose(
        seen, np.stack([np.sin(theta), -np.cos(theta)], -1), rtol=0.0, atol=1e-14
    )


@pytest.mark.parametrize("kappa", [0.0, -0.5, 0.3])
def test_a_ray_is_the_same_wherever_camera_and_base_are_put_together(kappa):
    away = np.array([0.7, -1.1])
    here = Camera((0.3, 2.0), 1.3, BaseSurface(kappa, 0.2)).derivatives(jnp.asarray(0.3))
    moved = Camera(away + np.array([0.3, 2.0]), 1.3, BaseSurface(kappa, 0.2, away))
    there = moved.derivatives(jnp.asarray(0.3))
    np.testing.assert_allclose(jax.tree.leaves(there), jax.tree.leaves(here), rtol=1e-12)


def test_the_front_of_a_hill_is_outside_its_circle_and_of_a_valley_inside():
    n, point = 0.4, np.array([0.2, -0.3])
    normal = np.array([-np.sin(n), np.cos(n)])
    eyes = np.random.default_rng(0).uniform(-4.0, 4.0, (40, 2))
    for kappa in (-0.6, 0.6):
        distance = np.linalg.norm(eyes - (point + normal / kappa), axis=1)
        within = distance < 1.0 / abs(kappa)
        faces = jax.vmap(BaseSurface(kappa, n, point).faces)(eyes)
        np.testing.assert_array_equal(faces, within if kappa > 0.0 else ~within)
        assert 0 < within.sum() < 40
    above = jax.vmap(BaseSurface(0.0, n, point).faces)(eyes)
    np.testing.assert_array_equal(above, (eyes - point) @ normal > 0.0)


def test_arc_length_and_position_agree():
    base = BaseSurface(-0.7, 0.3, (0.2, -0.4))
    x = jnp.linspace(-1.0, 1.0, 5)
    tangent = jax.vmap(jax.jacfwd(base.position))(x)
    n = base.normal_angle(x)
    np.testing.assert_allclose(tangent, np.stack([np.cos(n), np.sin(n)], -1), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(base.position(0.0), [0.2, -0.4])


def test_a_bump_turns_the_light_and_not_the_camera():
    """The whole chain: bumps in the shading normal, the base in the camera."""
    base = BaseSurface(-0.3, 0.1)
    bumpy = Surface(Affine([-0.3, 0.0], 0.1) + 0.2 * Affine([1.5, 0.0], 0.0), (glossy(0.2),))
    image = Camera((0.3, 2.0), 1.3, base)(bumpy.reflect(LIGHT))
    u = jnp.array([[0.1], [-0.2]])

    def both(a):
        return image.jet(a), autodiff_jet(image.at, a, image.frame)

    closed, truth = jax.jit(jax.vmap(both))(u)
    np.testing.assert_allclose(closed.gradient, truth.gradient, rtol=1e-11)
    np.testing.assert_allclose(closed.hessian, truth.hessian, rtol=1e-10)


@pytest.fixture(scope="module")
def seen():
    """A view, the jet there, and the image's value and derivatives by tracing in NumPy."""
    camera = Camera((0.3, 2.0), 1.3, BaseSurface(-0.4, 0.15))
    view = camera.derivatives(jnp.asarray(0.2))
    jet = OUT.jet(jnp.stack([view.x, view.theta]))
    h = 1e-4

    def image(px):
        x, theta = trace(px, -0.4, 0.15, (0.3, 2.0))
        return float(OUT(x, theta))

    first = (image(0.2 + h) - image(0.2 - h)) / (2.0 * h)
    second = (image(0.2 + h) - 2.0 * image(0.2) + image(0.2 - h)) / h**2
    return view, jet, (image(0.2), first, second)


def test_numbers_at_a_ray_give_the_image(seen):
    view, jet, truth = seen
    np.testing.assert_allclose(image_jet(view, jet), truth, rtol=1e-5)


WRONG_IMAGES = {
    "forget dx": lambda v, B: v.dtheta * B.gradient[1],
    "forget dtheta": lambda v, B: v.dx * B.gradient[0],
    "flip theta": lambda v, B: v.dx * B.gradient[0] - v.dtheta * B.gradient[1],
    "rows for columns": lambda v, B: v.dtheta * B.gradient[0] + v.dx * B.gradient[1],
}


@pytest.mark.parametrize("fault", WRONG_IMAGES)
def test_an_image_gradient_fault_is_seen(fault, seen):
    view, jet, truth = seen
    assert abs(WRONG_IMAGES[fault](view, jet) / truth[1] - 1.0) > 1e-3


WRONG_BENDS = {
    "forget the bending of x": lambda v, B: image_jet(v, B)[2] - B.gradient[0] * v.ddx,
    "forget the bending of theta": lambda v, B: image_jet(v, B)[2] - B.gradient[1] * v.ddtheta,
    "forget one mixed term": lambda v, B: image_jet(v, B)[2] - v.dx * v.dtheta * B.hessian[0, 1],
}


@pytest.mark.parametrize("fault", WRONG_BENDS)
def test_a_second_derivative_fault_is_seen(fault, seen):
    view, jet, truth = seen
    assert abs(WRONG_BENDS[fault](view, jet) / truth[2] - 1.0) > 1e-3


def test_a_distant_camera_sees_mostly_the_spatial_gradient():
    errors = []
    for z in (50.0, 100.0):
        view = Camera((0.0, z), 1.0, BaseSurface(-0.4)).derivatives(jnp.asarray(0.2 / z))
        jet = OUT.jet(jnp.stack([view.x, view.theta]))
        height = z - BaseSurface(-0.4).position(view.x)[1]
        rough = distant_image_gradient(view, -0.4 * view.x, height, 1.0, jet)
        errors.append(abs(float(rough / image_jet(view, jet)[1]) - 1.0))
    np.testing.assert_allclose(errors[0] / errors[1], 2.0, rtol=0.05)


def test_a_ray_that_misses_is_nan_and_a_grazing_one_is_not():
    hill = Camera((0.0, 1.0), 1.0, BaseSurface(-1.0))
    assert np.isnan(hill.derivatives(jnp.asarray(2.0)).x)
    assert np.all(np.isfinite(jax.tree.leaves(hill.derivatives(jnp.asarray(0.57)))))


def test_derivatives_in_the_scene_are_finite_on_a_flat_base():
    def x(kappa):
        return Camera((0.3, 2.0), 1.3, BaseSurface(kappa, 0.2)).derivatives(jnp.asarray(0.3)).x

    slope = jax.grad(x)(0.0)
    near = (x(1e-4) - x(-1e-4)) / 2e-4
    np.testing.assert_allclose(slope, near, rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Camera((0.0, 1.0), 0.0), "Argument `gamma` must be positive, but is 0.0."),
        (lambda: Camera((0.0, np.nan), 1.0), "Argument `eye` must be finite"),
        (lambda: Camera((0.0, -1.0), 1.0), "Argument `eye` must be in front of the base"),
        (lambda: Camera((0.0, 1.0, 3.0), 1.0), r"Argument `eye` must have shape \(2,\)"),
        (lambda: Camera(1.0, 1.0), r"Argument `eye` must have shape \(2,\)"),
        (lambda: BaseSurface(point=2.0), r"Argument `point` must have shape \(2,\)"),
        (lambda: BaseSurface(np.inf), "Argument `kappa` must be finite"),
        (lambda: Camera((0.0, 1.0), 1.0)(LIGHT), "Camera needs outgoing light"),
    ],
)
def test_bad_cameras_are_refused_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()
