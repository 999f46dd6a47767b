import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derivations.flatland import radiometry as derived
from derivations.flatland._scenes import built
from firstorder.flatland import Arcs, Receiver, Scene, Segments, primitive, receiver
from firstorder.flatland import _radiometry as radiometry
from firstorder.flatland._radiometry import (
    TABLE_I,
    _cosine_power,
    _Unit,
    diffuse_brdf,
    foreshortening,
    outgoing_radiance,
    phong_brdf,
    reflected_radiance,
    reflected_radiance_over_curves,
)

# --- units --------------------------------------------------------------------------------------


def test_every_unit_of_the_table_follows_from_its_definition():
    """All but that of Q_lambda, which must be per wavelength if (3) is to give an energy."""
    wrong = {(q.symbol, q.world) for q in TABLE_I if not q.agrees}
    assert wrong == {("Q_lambda", "3D"), ("Q_lambda", "2D")}
    assert {str(q.unit / _Unit.of(q.printed)) for q in TABLE_I if not q.agrees} == {"m^-1"}
    assert len(TABLE_I) == 12


def test_the_units_of_the_two_worlds_differ_where_a_length_or_an_angle_enters():
    by_world = {(q.symbol, q.world): q.unit for q in TABLE_I}
    assert by_world["Phi", "2D"] == by_world["Phi", "3D"]
    assert by_world["E", "2D"] / by_world["E", "3D"] == _Unit.of("m")
    assert by_world["L", "2D"] / by_world["L", "3D"] == _Unit.of("m sr rad^-1")


def test_the_algebra_of_units():
    assert _Unit.of("W") == _Unit.of("J s^-1")
    assert _Unit.of("m") / _Unit.of("m") == _Unit()
    assert _Unit.of("W m^-2") ** 2 == _Unit.of("J^2 s^-2 m^-4")
    assert str(_Unit()) == "1"
    with pytest.raises(ValueError, match="must hold units"):
        _Unit.of("furlong")


# --- BRDFs --------------------------------------------------------------------------------------


@given(st.floats(0.0, 200.0))
def test_the_norm_of_a_lobe(exponent):
    n = 20000
    o = (np.arange(n) + 0.5) / n * np.pi - np.pi / 2
    np.testing.assert_allclose(
        _cosine_power(exponent), np.sum(np.cos(o) ** exponent) * np.pi / n, rtol=1e-5
    )


@pytest.mark.smoke
def test_no_lobe_reflects_more_than_it_gets():
    """All of it at normal incidence, less of any other: no angle is brighter than its share."""
    assert derived.energy() < 1e-4
    ws, share = derived.albedos()
    outwards = np.diff(share[:, ws >= 0.0], axis=1)
    assert np.max(outwards) < 1e-9


def test_reciprocity_is_exact():
    assert derived.exchanged() == 0.0


def test_the_lobe_is_about_the_mirror_direction():
    o = np.linspace(-1.5, 1.5, 301)
    for w in (-0.7, 0.2):
        assert abs(o[np.argmax(phong_brdf(1.0, 50.0)(w, o))] + w) < 0.011


def test_nothing_below_the_horizon():
    for f in (diffuse_brdf(0.5), phong_brdf(0.5, 3.0)):
        assert f(0.1, 1.6) == f(-1.6, 0.1) == 0.0
    assert foreshortening(1.7) == 0.0
    assert np.isfinite(jax.grad(lambda o: phong_brdf(0.5, 3.0)(0.1, o))(1.56))
    assert np.isfinite(jax.grad(lambda k: phong_brdf(0.5, k)(-1.5, -1.5))(2.0))


def test_bad_material_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `albedo` must not be negative, but is -1.0.$"):
        diffuse_brdf(-1.0)
    with pytest.raises(ValueError, match="`exponent` must not be negative"):
        phong_brdf(0.5, -2.0)


# --- reflection and flux ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"brdf": 0.5}, r"`brdf` must be a function of two angles, .* diffuse_brdf|type hint"),
        ({"out": np.zeros(2)}, r"`out` must be one number, but has shape \(2,\)"),
    ],
)
@pytest.mark.parametrize("ask", [reflected_radiance, reflected_radiance_over_curves])
def test_what_is_no_brdf_and_what_is_no_angle_is_one_sentence(ask, wrong, words):
    scene = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
    count = {"count": 3} if ask is reflected_radiance_over_curves else {}
    options = {"brdf": diffuse_brdf(0.5), "out": 0.3} | count | wrong
    with pytest.raises((TypeError, ValueError), match=words):
        ask(scene, Receiver((0.3, 0.0), 0.0), **options)


def test_both_forms_and_plain_rays_agree():
    assert derived.by_rays() < 1e-4
    assert derived.by_curves() < 2e-4


def test_both_forms_agree_before_a_curved_blocker_and_a_wall_that_varies():
    """Two shadow edges and two ends, each misplaced by up to half a spacing of 1/4000."""
    scene, radiance = built("disc")
    brdf = phong_brdf(0.8, 4.0)

    @jax.jit
    def both(at):
        fine = reflected_radiance(scene, at, out=0.3, brdf=brdf, radiance=radiance)
        return fine, reflected_radiance_over_curves(
            scene, at, out=0.3, brdf=brdf, count=4000, key=None, radiance=radiance
        )

    for x in (-0.2, 0.35):
        fine, coarse = both(Receiver((x, 0.0), 0.1))
        assert abs(coarse / fine - 1.0) < 4.0 / 4000


def test_both_forms_agree_in_a_bowl_that_shines_on_itself():
    bowl = Scene.of(primitive(Arcs((0.0, 1.0), 1.0, 0.5 * np.pi, np.pi), emission=1.0))
    at, brdf = receiver(bowl, 0, 0.3), diffuse_brdf(0.5)
    fine = reflected_radiance(bowl, at, out=0.2, brdf=brdf)
    coarse = reflected_radiance_over_curves(bowl, at, out=0.2, brdf=brdf, count=1000)
    assert abs(coarse / fine - 1.0) < 1e-5


def test_a_brdf_is_told_where_light_comes_from_and_then_where_it_goes():
    """`int (2 + sin w) cos w dw` over a lamp from 0 to 45 degrees, times the angle of the way."""
    scene = Scene.of(primitive(Segments((0.0, 1.0), (-1.0, 1.0)), emission=1.0))

    def uneven(w, o):
        return (2.0 + jnp.sin(w)) * o

    at, truth = Receiver((0.0, 0.0), 0.0), 0.3 * (np.sqrt(2.0) + 0.25)
    fine = reflected_radiance(scene, at, out=0.3, brdf=uneven)
    coarse = reflected_radiance_over_curves(scene, at, out=0.3, brdf=uneven, count=100)
    assert abs(fine / truth - 1.0) < 1e-14
    assert abs(coarse / truth - 1.0) < 1e-5


@pytest.mark.smoke
def test_flux_between_two_lines_by_crossed_strings():
    assert derived.crossed_strings() < 1e-12


def test_what_leaves_is_emitted_or_reflected():
    assert outgoing_radiance(0.7, 0.3) == 1.0


# --- deliberate faults --------------------------------------------------------------------------


@pytest.mark.parametrize("fault", ["norm of space", "norm without its cosine"])
def test_faults_of_a_norm_are_noticed(fault, monkeypatch):
    right = _cosine_power
    wrong = {
        "norm of space": lambda p: 2.0 * jnp.pi / (p + 1.0),
        "norm without its cosine": lambda p: right(p - 1.0),
    }[fault]
    monkeypatch.setattr(radiometry, "_cosine_power", wrong)
    error = derived.energy()
    assert np.isfinite(error)
    assert error > 0.05


@pytest.mark.parametrize("fault", ["fall-off of space", "no cosine at the sender"])
def test_faults_of_the_geometry_term_are_noticed(fault, monkeypatch):
    right = radiometry.geometry_term

    def wrong(x, n, y, m):
        r = jnp.sqrt(jnp.sum((y - x) ** 2, -1))
        G = right(x, n, y, m)
        if fault == "fall-off of space":
            return G / r
        return G * r / jnp.maximum(jnp.abs(jnp.sum(m * (y - x), -1)), 0.1)

    monkeypatch.setattr(radiometry, "geometry_term", wrong)
    derived._reflections.cache_clear()
    error = derived.by_curves()
    derived._reflections.cache_clear()
    assert np.isfinite(error)
    assert error > 0.01


def test_a_diffuse_brdf_with_the_norm_of_space_is_noticed(monkeypatch):
    monkeypatch.setattr(
        radiometry, "diffuse_brdf", lambda albedo: lambda w, o: albedo / jnp.pi + 0.0 * w
    )
    derived._reflections.cache_clear()
    error = derived.by_irradiance()
    derived._reflections.cache_clear()
    assert error > 0.1


def test_a_sharp_lobe_keeps_its_digits_in_single_precision():
    for exponent in (1e3, 1e5):
        single, double = (
            phong_brdf(np.asarray(1.0, dtype), np.asarray(exponent, dtype))(
                np.asarray(0.0, dtype), np.asarray(0.0, dtype)
            )
            for dtype in ("float32", "float64")
        )
        assert single.dtype == "float32"
        assert abs(single / double - 1.0) < 1e-5
