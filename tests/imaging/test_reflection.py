import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.imaging import _reflection_frames as frames
from derivations.imaging import _reflection_printed as printed
from derivations.imaging import _surfaces as our
from derivations.imaging import reflection as derived
from firstorder.checks.tolerance import _epsilon, normwise
from firstorder.imaging._reflection import (
    half_turn,
    mirrored,
    reflected_radiance,
    scalar_curvature,
    surface_point,
)
from firstorder.laws import VonMisesFisher, Zonal, ZonalCosine

BOUND = 1e-9  # differences of eighth order at 0.01: (curvature x step)^8 is some 1e-11


@pytest.fixture(scope="module")
def both():
    """The glossy ellipsoid in a near light: the library's terms, and the traced derivatives."""
    along, turns, over = our.truth()
    return derived._reflected()[0], along, turns, over


@pytest.mark.smoke
def test_a_mirror_ball_turns_its_image_twice_as_fast_as_its_normal():
    ball = surface_point(jnp.zeros(3), jnp.eye(3), -0.5 * jnp.eye(2))
    B = reflected_radiance(lambda x, w: w[0] + 0.0 * x[0], ball, jnp.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(B.spatial, [1.0, 0.0], rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(B.angular, [-1.0, 0.0, 0.0], rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("through", ["kernel", "light"])
@pytest.mark.parametrize("part", ["spatial", "angular"])
def test_both_routes_give_the_traced_gradient_in_any_tangents(part, through):
    assert derived.reflected_differences(part, through) < BOUND
    assert derived.reflected_autodiff(part, through) < 1e-10


FAULTS = {
    "valley for hill": lambda B: (B.SV - B.CDV, B.angular),
    "once and not twice": lambda B: (B.SV + 0.5 * B.CDV, B.angular),
    "forget the near light": lambda B: (B.CDV, B.angular),
    "forget the curvature": lambda B: (B.SV, B.angular),
    "forget the half turn": lambda B: (B.spatial, B.DV),
    "negate the tangents": lambda B: (B.spatial, -B.DV),
    "antipode for mirror": lambda B: (B.spatial, -B.angular),
    "rows for columns": lambda B: (B.SV + B.DV @ our.AXES.T @ B.argument_D_x, B.angular),
    "swap the tangents": lambda B: (B.SV + B.CDV[::-1], B.angular),
}


def miss(spatial, angular, both):
    _, along, turns, over = both
    return max(normwise(spatial, along), normwise(turns @ np.asarray(angular), over))


def test_without_a_fault_the_terms_pass(both):
    assert miss(both[0].spatial, both[0].angular, both) < BOUND


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_seen(fault, both):
    error = miss(*FAULTS[fault](both[0]), both)
    assert np.isfinite(error)
    assert error > 1e-3


@pytest.mark.parametrize("part", ["spatial", "angular"])
def test_light_in_the_surfaces_frame(part):
    assert frames.frame_differences(part) < 1e-10


def test_rows_for_columns_in_the_rotation_are_seen():
    """R07 (60) as it is printed: P by its rows, at a frame that is not the world's."""
    axes, kappas, ours = frames.principal()
    t, _, n = axes.T
    rows = np.stack([n, np.zeros(3), -t])
    assert normwise(kappas[0] * rows @ our.LOCAL, ours[:, 0]) > 0.1
    assert frames.principal_differences() < BOUND


def test_principal_directions_turn_about_the_normal_but_the_carried_frame_does_not():
    """(60) keeps b: true of the carried frame, not of the field of principal directions."""
    axes, _ = our.principal_frame(our.PLACE)
    n = axes[:, 2]

    def along(s):
        x, m = our.moved(0, s, axes)
        principal = our.principal_frame(x)[0][:, 1]
        principal = principal * np.sign(principal @ axes[:, 1])
        carried = our.smallest_rotation(n, m) @ axes[:, 1]
        return np.array([principal @ axes[:, 0], carried @ axes[:, 0]])

    twist, carried = np.asarray(our.slope(along))
    assert abs(twist) > 0.05
    assert abs(carried) < 1e-10


def test_a_half_turn_is_a_rotation_that_mirrors():
    n, v = jnp.asarray(our.AXES[:, 2]), jnp.asarray(our.TO_EYE)
    np.testing.assert_allclose(half_turn(n) @ v, mirrored(v, n), rtol=0.0, atol=8 * _epsilon())
    np.testing.assert_allclose(jnp.linalg.det(half_turn(n)), 1.0, rtol=1e-5)


# --- §5.1's direct extension ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def cuts():
    """RMS errors by reading: over scales, along the normal in principal and turned tangents."""
    scales = {s: printed.short_cuts(s * our.RADII, 0.5) for s in (0.5, 2.0)}
    return {**scales, "ball": printed.short_cuts([1.0, 1.0, 1.0], 0.0)} | {
        "principal": printed.short_cuts(our.RADII, 0.0),
        "turned": printed.short_cuts(our.RADII, 0.0, 0.6),
    }


def test_the_derived_form_is_right_where_no_reading_is(cuts):
    for scene in cuts.values():
        assert scene["derived"] < BOUND
    for scale in (0.5, 2.0):
        assert min(cuts[scale][r] for r in printed.READINGS) > 0.02


def test_the_gaussian_curvature_depends_on_the_unit_of_length(cuts):
    """And on a ball of radius 1, where its number is right, its sign is wrong."""
    assert cuts[0.5]["gaussian"] / cuts[2.0]["gaussian"] > 2.0
    np.testing.assert_allclose(cuts["ball"]["gaussian"], 2.0, rtol=1e-6)
    for reading in ("root", "mean", "normal"):
        np.testing.assert_allclose(cuts[0.5][reading], cuts[2.0][reading], rtol=1e-6)
        assert cuts["ball"][reading] < BOUND


def test_normal_curvatures_are_exact_along_the_normal_in_principal_tangents_only(cuts):
    assert cuts["principal"]["normal"] < BOUND
    assert cuts["turned"]["normal"] > 0.02


# --- lobes, precision, boundaries -----------------------------------------------------------------


def test_a_diffuse_lobe_follows_the_normal_and_not_the_eye():
    """Irradiance of L = w_x on a ball, 2/3 n_x for the clamped cosine over pi."""
    ball = surface_point(jnp.zeros(3), jnp.eye(3), -0.5 * jnp.eye(2))
    lobe, up = Zonal(ZonalCosine(), 8, 8), jnp.array([0.6, 0.0, 0.8])
    B = jax.jit(
        lambda: reflected_radiance(lambda x, w: w[0] + 0.0 * x[0], ball, up, lobe, "normal")
    )()
    np.testing.assert_allclose(B.spatial, [2.0 / 3.0 * 0.5, 0.0], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(B.angular, 0.0, rtol=0.0, atol=1e-12)


def test_both_precisions_and_many_points():
    def at(dtype):
        x, axes, S, v = (jnp.asarray(a, dtype) for a in (our.PLACE, our.AXES, our.S, our.TO_EYE))
        lobe = Zonal(VonMisesFisher(jnp.asarray(7.0, dtype)), 6, 8)

        def seen(x):
            B = reflected_radiance(frames.jax_light, surface_point(x, axes, S), v, lobe)
            return B.value, B.spatial, B.angular

        return jax.jit(jax.vmap(seen))(x + jnp.linspace(0.0, 0.1, 2, dtype=dtype)[:, None])

    single, double = at(jnp.float32), at(float)
    for a, b in zip(single, double, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-5)


def test_bad_arguments_are_one_sentence():
    ball = surface_point(jnp.zeros(3), jnp.eye(3), -jnp.eye(2))
    up = jnp.array([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="`to_eye` must be a unit vector"):
        reflected_radiance(lambda x, w: w[0], ball, 2.0 * up)
    with pytest.raises(ValueError, match="`argument` must be one of mirror, normal"):
        reflected_radiance(lambda x, w: w[0], ball, up, argument="eye")
    with pytest.raises(ValueError, match="`through` must be one of kernel, light"):
        reflected_radiance(lambda x, w: w[0], ball, up, through="both")
    with pytest.raises(ValueError, match="`reading` must be one of"):
        scalar_curvature(-jnp.eye(2), "printed")
    with pytest.raises(ValueError, match=r"`S` must have shape \(2, 2\), but has \(\)"):
        surface_point(jnp.zeros(3), jnp.eye(3), -0.5)


def test_flat_ground_has_no_curvature_in_any_reading_and_no_nan():
    for reading in printed.READINGS:
        value, slope = jax.value_and_grad(lambda S, r=reading: jnp.sum(scalar_curvature(S, r)))(
            jnp.zeros((2, 2))
        )
        assert value == 0.0
        assert bool(jnp.all(jnp.isfinite(slope)))


def test_points_are_trees_of_numbers():
    fields = {
        f.name for f in dataclasses.fields(surface_point(jnp.zeros(3), jnp.eye(3), jnp.eye(2)))
    }
    assert fields == {"position", "tangents", "normal", "turning"}
