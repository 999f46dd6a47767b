import itertools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from derivations.caching._forms import integrated, matrices
from derivations.caching._third import cubic_by_sums, growth_of_a_cubic
from firstorder import caching
from firstorder.caching import (
    DEFINITIONS,
    ValidityRegion,
    circular_regions,
    derivative_norm,
    expected_error,
    geometric_bound,
    largest_radiance,
    radii,
    radius_for,
)
from firstorder.caching.radii import _positive_part

# Random ones of all signs, and the degenerate: round, flat one way, balanced, zero.
ODD = [np.eye(2), -3.0 * np.eye(2), np.diag([0.0, 2.0]), np.diag([1.0, -1.0]), np.zeros((2, 2))]
H = jnp.asarray(np.concatenate([matrices(19), ODD]))
ANGLE = np.pi * (np.arange(2000) + 0.5) / 2000
AROUND = np.stack([np.cos(ANGLE), np.sin(ANGLE)])
FORM = np.einsum("an,kab,bn->kn", AROUND, np.asarray(H), AROUND)


CASES = [(d, o) for d in DEFINITIONS for o in (0, 1, 2)]


def by_quadrature(definition, order, derivative, radius, value):
    """The definition, integrated adaptively over the first missing term."""

    def miss(t):
        return abs(derivative * t ** (order + 1)) / math.factorial(order + 1)

    power = 2 if "squared" in definition else 1
    if definition == "largest":
        return max(miss(-radius), miss(radius))
    total = sum(quad(lambda t: miss(t) ** power, *e)[0] for e in ((-radius, 0.0), (0.0, radius)))
    return total / {"relative": value}.get(definition, 2 * radius if "average" in definition else 1)


def expected(derivative, radius, order=1, **options):
    """Along a line, from numbers."""
    T = jnp.full((1,) * (order + 1), derivative)
    return expected_error(T, ValidityRegion(jnp.full((1, 1), 1.0 / radius)), order=order, **options)


def worst_error():
    errors = []
    for definition, order in CASES:
        options = {"order": order, "definition": definition, "value": 1.7}
        for derivative, radius in ((-3.1, 0.4), (0.2, 2.5)):
            true = by_quadrature(definition, order, derivative, radius, 1.7)
            estimate = float(expected(derivative, radius, **options))
            back = float(radius_for(derivative, true, **options))
            errors += [abs(estimate / true - 1.0), abs(back / radius - 1.0)]
    return max(errors)


def test_every_definition_is_its_integral_and_every_radius_its_inverse():
    assert worst_error() < 1e-10


@pytest.mark.smoke
def test_the_printed_radius():
    assert radius_for(-6.0, 2.0).item() == pytest.approx(1.0)
    assert expected(6.0, 2.0).item() == pytest.approx(16.0)


LAWS = radii._law
FAULTS = {
    "one side only": lambda law: law._replace(factor=0.5 * law.factor),
    "no modulus of the square": lambda law: law._replace(power=1),
    "a power short": lambda law: law._replace(exponent=max(law.exponent - 1, 1)),
    "the mean of the wrong power": lambda law: law._replace(factor=law.factor * 1.2),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_law_is_noticed(fault, monkeypatch):
    monkeypatch.setattr(radii, "_law", lambda *given: FAULTS[fault](LAWS(*given)))
    assert 1e-3 < worst_error() < np.inf


def test_a_fault_in_the_factorial_is_noticed(monkeypatch):
    monkeypatch.setattr(radii, "_coefficient", lambda D, *_: jnp.abs(jnp.asarray(D)))
    assert 1e-3 < worst_error() < np.inf


def test_at_equal_counts_averages_place_what_the_largest_error_places():
    """Their radii are one family: proportional to |E''|^(-1/2), whatever the tolerance."""
    h = jnp.array([0.3, -1.0, 7.0])
    shapes = [radius_for(h, 0.1, definition=d) for d in ("average", "average squared", "largest")]
    for r in shapes[1:]:
        np.testing.assert_allclose(r / r[0], shapes[0] / shapes[0][0], rtol=1e-14)
    powers = {
        d: float(jnp.log(radius_for(2.0, 0.1, definition=d) / radius_for(1.0, 0.1, definition=d)))
        / math.log(2.0)
        for d in DEFINITIONS
        if d != "relative"
    }
    assert powers == pytest.approx(
        {
            "total": -1 / 3,
            "integrated squared": -2 / 5,
            "average": -1 / 2,
            "average squared": -1 / 2,
            "largest": -1 / 2,
        }
    )


def test_units():
    """Space in other units by s, radiance by c: E^(k) by c / s^k, the radius by s."""
    s, c = 3.0, 5.0
    for order in (0, 1, 2):
        scaled = radius_for(1.3 * c / s ** (order + 1), 0.2 * c * s, order=order)
        assert float(scaled) == pytest.approx(s * float(radius_for(1.3, 0.2, order=order)))


@pytest.mark.smoke
def test_where_nothing_changes_the_radius_is_infinite_and_has_no_nan_in_its_gradient():
    assert np.isposinf(radius_for(0.0, 0.1).item())
    for order in (0, 1, 2):
        slope = jax.grad(
            lambda h, o=order: circular_regions(radius_for(h, 0.1, order=o), 0.1, 2.0).radius
        )
        assert slope(0.0).item() == 0.0
        assert np.isfinite(slope(40.0).item())


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: radius_for(1.0, 0.0), "Argument `tolerance` must be positive, but is 0.0."),
        (lambda: radius_for(1.0, 1.0, order=3), "Argument `order` must be 0, 1 or 2, but is 3."),
        (
            lambda: radius_for(1.0, 1.0, definition="relative"),
            "Argument `value` must be given for the relative error, but is missing.",
        ),
        (
            lambda: radius_for(1.0, 1.0, definition="relative", value=0.0),
            "Argument `value` must be positive, but is 0.0.",
        ),
        (lambda: radius_for(1.0, 1.0, dims=3), "Argument `dims` must be 1 or 2, but is 3."),
        (
            lambda: derivative_norm(jnp.eye(2), 4),
            "Argument `order` must be 1, 2 or 3, but is 4.",
        ),
        (
            lambda: derivative_norm(jnp.ones((3, 2)), 2),
            "Argument `derivative` must end in 2 axes of one length, 1 or 2, but has shape (3, 2).",
        ),
        (
            lambda: expected_error(jnp.eye(2), ValidityRegion(jnp.ones((1, 1)))),
            "Argument `derivative` must end in 2 axes of length 1, but has shape (2, 2).",
        ),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=r"must") as failure:
        call()
    assert str(failure.value) == words


def test_an_unknown_definition_is_refused():
    with pytest.raises(ValueError, match="Argument `definition` must be one of"):
        radii._law("median", 1)


def test_a_traced_tolerance_that_is_not_positive_gives_nan():
    radius = jax.jit(lambda e: radius_for(1.0, e))
    assert np.isnan(radius(-0.1))
    assert np.isfinite(radius(0.1))
    flat = jax.jit(lambda e: radius_for(0.0, e))
    assert np.isnan(flat(-0.1))
    assert np.isposinf(flat(0.1))


def test_single_precision():
    r = radius_for(jnp.float32(-6.0), jnp.float32(2.0))
    assert r.dtype == jnp.float32
    assert float(r) == pytest.approx(1.0, rel=1e-6)


# --- on a plane ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found():
    return jax.jit(lambda H: {k: derivative_norm(H, 2, k) for k in ("mean", "largest", "rms")})(H)


def test_the_mean_curvature_is_the_mean_and_the_largest_a_bound(found):
    mean = np.mean(np.abs(FORM), axis=1)
    np.testing.assert_allclose(found["mean"], mean, rtol=2e-6, atol=1e-12)
    np.testing.assert_allclose(found["largest"], np.abs(FORM).max(axis=1), rtol=3e-6)
    assert np.all(found["mean"] <= np.asarray(found["largest"]) * (1 + 1e-12))
    assert np.all(found["mean"] >= 0.4705 * np.asarray(found["largest"]))
    np.testing.assert_allclose(found["rms"], np.sqrt(np.mean(FORM**2, axis=1)), rtol=1e-12)


def test_norms_of_gradients_are_those_of_their_slopes_around():
    g = jnp.array([[3.0, 4.0], [0.0, 0.0]])
    slopes = np.abs(np.asarray(g) @ AROUND)
    for kind, of in (("largest", np.max), ("mean", np.mean)):
        np.testing.assert_allclose(derivative_norm(g, 1, kind), of(slopes, axis=1), rtol=2e-6)
    rms = np.sqrt(np.mean(slopes**2, axis=1))
    np.testing.assert_allclose(derivative_norm(g, 1, "rms"), rms, rtol=1e-12)


def test_along_a_line_every_norm_is_the_modulus():
    for order in (1, 2, 3):
        T = jnp.array([-2.0, 3.0]).reshape((2,) + (1,) * order)
        for kind in ("largest", "mean", "rms"):
            assert derivative_norm(T, order, kind).tolist() == [2.0, 3.0]


def test_expected_errors_on_discs_are_integrals():
    """Six definitions on a surface, for the quadratic of unit curvature, in closed form."""
    R, h = 0.7, 2.3
    miss = [0.5 * h * R**2, 0.125 * h**2 * R**4 / 1.5]
    area = np.pi * R * R
    true = {
        "total": 0.25 * np.pi * h * R**4,
        "average": 0.25 * np.pi * h * R**4 / area,
        "integrated squared": miss[1] * area * 2 / 2,
        "average squared": miss[1],
        "largest": miss[0],
        "relative": 0.25 * np.pi * h * R**4 / 1.7,
    }
    for definition, value in true.items():
        options = {"definition": definition, "value": 1.7}
        disc = ValidityRegion(jnp.eye(2) / R)
        ours = expected_error(h * jnp.eye(2), disc, **options)
        assert ours.item() == pytest.approx(value, rel=1e-12)
        assert radius_for(h, value, dims=2, **options).item() == pytest.approx(R, rel=1e-12)


def by_sums(T, M, definition, order, n=400):
    """The definition over an ellipse, on a grid of squares of the unit disc."""
    s = (np.arange(n) + 0.5) / (n / 2) - 1.0
    y = np.stack(np.meshgrid(s, s), -1)
    dx = y[np.sum(y**2, -1) < 1.0] @ np.linalg.inv(M).T
    for k in range(order + 1):
        T = np.einsum("n...a,na->n..." if k else "...a,na->n...", T, dx)
    miss, area = np.abs(T) / math.factorial(order + 1), np.pi / abs(np.linalg.det(M))
    mean = np.mean(miss**2 if "squared" in definition else miss)
    if definition == "largest":
        return np.max(miss)
    return (
        mean
        if "average" in definition
        else mean * area / (1.7 if definition == "relative" else 1.0)
    )


@pytest.mark.parametrize("order", [0, 1, 2])
def test_every_definition_is_its_integral_over_any_ellipse(order):
    rng = np.random.default_rng(order)
    M = np.eye(2) + 0.3 * rng.normal(size=(2, 2))
    T = rng.normal(size=(2,) * (order + 1))
    T = sum(np.transpose(T, p) for p in itertools.permutations(range(order + 1)))
    for definition in DEFINITIONS:
        region = ValidityRegion(jnp.asarray(M))
        ours = expected_error(
            jnp.asarray(T), region, order=order, definition=definition, value=1.7
        ).item()
        bound = 2e-2 if definition == "largest" else 3e-3
        assert ours == pytest.approx(by_sums(T, M, definition, order), rel=bound), definition


def test_third_derivatives_count_by_their_mean():
    rng = np.random.default_rng(0)
    T = rng.normal(size=(2, 2, 2))
    T = sum(np.transpose(T, p) for p in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1)))
    dense = np.mean(np.abs(np.einsum("abc,an,bn,cn->n", T, AROUND, AROUND, AROUND)))
    assert derivative_norm(jnp.asarray(T), 3, "mean").item() == pytest.approx(dense, rel=2e-3)


def test_where_third_derivatives_vanish_the_squared_error_has_no_slope():
    disc, none = ValidityRegion(jnp.eye(2)), jnp.zeros((2, 2, 2))

    def error(T):
        return expected_error(T, disc, order=2, definition="average squared")

    value, slope = jax.value_and_grad(error)(none)
    assert value.item() == 0.0
    np.testing.assert_array_equal(slope, none)


WRONG_MEANS = {
    "a factor": lambda T, order, kind: 1.1 * derivative_norm(T, order, kind),
    "no modulus": lambda T, order, kind: jnp.abs(T[..., 0, 0, 0] + T[..., 0, 1, 1]),
}


@pytest.mark.parametrize("fault", WRONG_MEANS)
def test_a_wrong_mean_of_third_derivatives_is_seen(fault, monkeypatch):
    assert cubic_by_sums() < 2e-3
    assert growth_of_a_cubic() < 2e-3
    monkeypatch.setattr(caching, "derivative_norm", WRONG_MEANS[fault])
    monkeypatch.setattr(radii, "derivative_norm", WRONG_MEANS[fault])
    assert cubic_by_sums() > 0.02
    assert growth_of_a_cubic() > 0.02


def test_no_light_beats_the_geometric_bound():
    """Random pieces of geometry, random light on them, and its worst in every direction."""
    rng = np.random.default_rng(5)
    pieces = matrices(24, 9)
    weights = rng.uniform(0.1, 1.0, 24)
    B = np.asarray(jax.jit(geometric_bound)(jnp.asarray(pieces), jnp.asarray(weights)))
    light = rng.uniform(size=(400, 24)) ** rng.uniform(0.1, 5.0, (400, 1))
    sums = np.einsum("lk,k,kab->lab", light, weights, pieces)
    reached = np.abs(np.einsum("an,lab,bn->ln", AROUND, sums, AROUND))
    bound = np.einsum("an,ab,bn->n", AROUND, B, AROUND)
    assert np.max(reached / bound) < 1.0
    # And the bound is no more than twice the worst light.
    form = np.einsum("an,kab,bn->kn", AROUND, pieces * weights[:, None, None], AROUND)
    worst = np.maximum(np.maximum(form, 0).sum(0), np.maximum(-form, 0).sum(0))
    assert np.all(worst <= bound * (1 + 1e-12))
    assert np.max(bound / worst) < 2.0
    # The printed Hessian, all light alike, is exceeded by light where the pieces curve one way.
    even = np.abs(np.linalg.eigvalsh(np.einsum("k,kab->ab", weights, pieces))).max()
    assert np.max(worst) > 1.1 * even


def test_positive_parts_add_up():
    parts = jax.jit(lambda H: (_positive_part(H), _positive_part(-H)))(H)
    up, down = (np.asarray(p) for p in parts)
    np.testing.assert_allclose(up - down, H, rtol=0.0, atol=1e-12)
    assert np.linalg.eigvalsh(up).min() > -1e-12
    np.testing.assert_allclose(up @ down, 0.0, rtol=0.0, atol=1e-9)


def test_pieces_that_curve_along_one_line_count():
    """The other eigenvalue is zero but for rounding: found of both signs it lost the piece."""
    rng = np.random.default_rng(0)
    angles, k = jnp.asarray(rng.uniform(0.0, 6.0, 2000)), jnp.asarray(rng.normal(size=2000))

    def bound(angle, k):
        n = jnp.stack([jnp.cos(angle), jnp.sin(angle)])
        return geometric_bound((k * n[:, None] * n)[None])

    B = jax.jit(jax.vmap(bound))(angles, k)
    slope = jax.jit(jax.vmap(jax.jacfwd(bound, 1)))(angles, k)
    n = np.stack([np.cos(angles), np.sin(angles)], -1)
    outer, k = n[:, :, None] * n[:, None], np.asarray(k)[:, None, None]
    np.testing.assert_allclose(B, np.abs(k) * outer, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(slope, np.sign(k) * outer, rtol=0.0, atol=1e-14)


@pytest.mark.smoke
def test_the_largest_radiance():
    assert largest_radiance(np.array([[1.0, 3.0], [2.0, 0.0]])).item() == 3.0
    assert largest_radiance(jnp.arange(101.0), 0.5).item() == 50.0


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: derivative_norm(H, 2, "least"),
            r"^Argument `kind` must be one of \['largest', 'mean', 'rms'\]",
        ),
        (lambda: largest_radiance(np.array([-1.0])), r"^Argument `radiances` must not be negative"),
        (lambda: largest_radiance(1.0, 0.0), r"^Argument `quantile` must lie in \(0, 1\], but is"),
    ],
)
def test_bad_input_on_a_plane_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_the_estimate_is_what_the_sums_are():
    M = jnp.asarray(np.eye(2) + 0.3 * np.random.default_rng(2).normal(size=(24, 2, 2)))
    ours = np.asarray(jax.jit(lambda H, M: expected_error(H, ValidityRegion(M)))(H, M))
    true = [integrated(h, m, 2000) for h, m in zip(np.asarray(H), np.asarray(M), strict=True)]
    np.testing.assert_allclose(ours, true, rtol=1e-5, atol=1e-12)


# --- properties ----------------------------------------------------------------------------------


@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.sampled_from([0, 1, 2]))
def test_errors_and_radii_scale_with_light_and_with_the_unit_of_length(scale, L, order):
    """The derivative of order k + 1 falls as s^-(k + 1); the total error on a line gains s."""
    D, R, tolerance = 3.7, 0.6, 0.21
    other = L * D / scale ** (order + 1)

    def error(derivative, radius):
        tensor = jnp.full((1,) * (order + 1), derivative)
        region = ValidityRegion(jnp.full((1, 1), 1.0 / radius))
        return float(expected_error(tensor, region, order=order))

    np.testing.assert_allclose(error(other, scale * R), L * scale * error(D, R), rtol=1e-12)
    np.testing.assert_allclose(
        radius_for(other, L * scale * tolerance, order=order),
        scale * radius_for(D, tolerance, order=order),
        rtol=1e-12,
    )


# --- what is no number ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["largest", "mean", "rms"])
@pytest.mark.parametrize("place", [(0, 0), (0, 1), (1, 1)])
def test_a_derivative_that_is_no_number_has_no_size(kind, place):
    """A root that is guarded at zero once took it for zero, and the radius was without an end."""
    H = np.eye(2)
    H[place] = H[place[::-1]] = np.nan
    assert np.isnan(derivative_norm(H, 2, kind))
    assert np.isnan(derivative_norm(H[0] + H[1], 1, kind))


def test_the_bound_of_what_is_no_number_is_none():
    assert np.all(np.isnan(geometric_bound(np.full((1, 2, 2), np.nan))))


@pytest.mark.parametrize("kind", ["largest", "mean", "rms"])
@pytest.mark.parametrize(("dtype", "unit"), [(np.float32, 2.0**90), (np.float64, 2.0**700)])
def test_sizes_of_derivatives_keep_their_range(kind, dtype, unit):
    rng = np.random.default_rng(0)
    for order in (1, 2, 3):
        T = rng.normal(size=(2,) * order).astype(dtype)
        here = caching.derivative_norm(T, order, kind)
        for scale in (dtype(unit), dtype(1.0 / unit)):
            assert caching.derivative_norm(T * scale, order, kind) == here * scale


@pytest.mark.parametrize("definition", ["average squared", "integrated squared", "total"])
@pytest.mark.parametrize("size", [1e-24, 1e24])
def test_radii_keep_their_range_in_single_precision(definition, size):
    short = caching.radius_for(np.float32(size), np.float32(1.0), definition=definition)
    long = caching.radius_for(float(np.float32(size)), 1.0, definition=definition)
    assert short.dtype == np.float32
    np.testing.assert_allclose(short, long, rtol=1e-5)


def test_traced_numbers_that_would_be_refused_give_nan():
    H = jnp.stack([jnp.eye(2), -jnp.eye(2)])
    assert jnp.isnan(jax.jit(caching.geometric_bound)(H, jnp.array([1.0, -1.0]))).any()
    assert jnp.isnan(jax.jit(caching.largest_radiance)(jnp.array([1.0, -2.0])))


def test_the_largest_of_nothing_is_refused():
    with pytest.raises(ValueError, match="must hold at least one, but is empty"):
        caching.largest_radiance([])
