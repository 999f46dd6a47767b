"""True errors of records along a line and on a plane, the best regions, and errors of images."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from derivations.caching._lamp import hessian_of, summed
from derivations.caching._lamp import lamp as rectangle
from derivations.caching._light import lamp, scene_a_columns, scene_a_numbers
from firstorder import caching
from firstorder.caching import (
    DEFINITIONS,
    Candidates,
    ValidityRegion,
    derivative_norm,
    errors,
    expected_error,
    floats_per_record,
    ideal_region,
    largest_set,
    radius_for,
    rms,
    semi_axes,
    ssim,
    true_error,
)

# --- along a line --------------------------------------------------------------------------------

AT, R = 0.35, 0.4
HERE = np.array([AT])
H = np.array([[3.0, 1.0], [1.0, 1.0]])


def at(x, columns=None):
    """One record along a line."""
    x = np.array([x])
    return Candidates.on_line(x, scene_a_columns(x) if columns is None else columns)


def segment(radius):
    return ValidityRegion(jnp.full((1, 1, 1), 1.0 / radius))


def by_quadrature(definition, order):
    E = scene_a_numbers()[0]
    columns = scene_a_columns(AT)

    def miss(t):
        expansion = columns[0] + columns[1] * t * (order > 0) + columns[2] * t * t / 2 * (order > 1)
        return abs(float(E(AT + t) - expansion))

    if definition == "largest":
        return max(miss(t) for t in np.linspace(-R, R, 4001))
    power = 2 if "squared" in definition else 1
    total = sum(quad(lambda t: miss(t) ** power, *ends)[0] for ends in ((-R, 0), (0, R)))
    return total / {"relative": columns[0]}.get(definition, 2 * R if "average" in definition else 1)


def worst_error():
    worst = 0.0
    for definition in DEFINITIONS:
        for order in (0, 1, 2):
            ours = float(
                true_error(lamp, at(AT), segment(R), order=order, definition=definition)[0]
            )
            bound = 1e-2 if definition == "largest" else 1.0  # the nodes stop short of the ends
            worst = max(worst, bound * abs(ours / by_quadrature(definition, order) - 1.0))
    return worst


def test_the_error_is_that_of_adaptive_quadrature():
    assert worst_error() < 1e-4


@pytest.mark.parametrize(
    "fault",
    [
        lambda E, g, H, dx, order: E + 0.0 * dx[..., 0],
        lambda E, g, H, dx, order: E - g[..., 0] * dx[..., 0],
    ],
)
def test_a_fault_is_noticed(fault, monkeypatch):
    monkeypatch.setattr(errors, "taylor", fault)
    assert worst_error() > 1e-2


@pytest.mark.smoke
def test_the_estimate_tends_to_the_truth():
    record, region = at(AT), segment(0.01)
    for order in (0, 1, 2):
        true = float(true_error(lamp, record, region, order=order)[0])
        estimate = expected_error(record.derivative(order + 1), region, order=order)
        assert float(estimate[0]) == pytest.approx(true, rel=1e-2)


def test_the_ideal_radius_has_the_tolerated_error_and_is_near_the_estimated_one():
    found = ideal_region(lamp, at(0.2), 1e-3, 1e-3, 2.0)
    assert float(true_error(lamp, at(0.2), found)[0]) == pytest.approx(1e-3, rel=1e-10)
    estimate = radius_for(derivative_norm(at(0.2).derivative(2), 2), 1e-3)
    assert float(found.radius[0]) == pytest.approx(float(estimate[0]), rel=0.02)
    assert found.clamp.tolist() == [0]


def test_limits_are_the_answer_where_they_act_and_are_said():
    """Every record by its own errors, all at once."""
    x = np.array([0.1, 0.2, 0.9])
    some = Candidates.on_line(x, scene_a_columns(x))
    free = np.asarray(ideal_region(lamp, some, 1e-3, 1e-3, 2.0).radius)
    low, high = 0.5 * (np.sort(free)[:2].sum()), 0.5 * np.sort(free)[1:].sum()
    held = ideal_region(lamp, some, 1e-3, low, high)
    np.testing.assert_allclose(held.radius, np.clip(free, low, high), rtol=1e-12)
    assert held.clamp.tolist() == (np.sign(free - np.clip(free, low, high))).astype(int).tolist()
    assert {-1, 0, 1} == set(held.clamp.tolist())


def test_a_kink_is_cut_at():
    def E(x):
        return jnp.abs(x - 0.1)

    start = at(0.0, np.array([[0.1, -1.0]]))
    error = true_error(E, start, segment(0.5), breaks=(0.1,))
    assert float(error[0]) == pytest.approx(0.16, rel=1e-13)


def test_kinks_are_cut_at_in_arrays_too():
    def E(x):
        return jnp.abs(x - 0.1) + jnp.abs(x + 0.2)

    start, breaks = at(0.0, np.array([[0.3, 0.0]])), (np.array([0.1, -0.2]), 0.4)
    # Beyond the kinks E rises twice as fast as the distance from them.
    error = true_error(E, start, segment(0.5), breaks=breaks)
    assert float(error[0]) == pytest.approx(0.4**2 + 0.3**2, rel=1e-13)
    found = ideal_region(E, start, 0.4**2 + 0.3**2, 0.1, 2.0, breaks=breaks)
    assert float(found.radius[0]) == pytest.approx(0.5, rel=1e-12)


# --- on a plane ----------------------------------------------------------------------------------


def bowl(x):
    return 1.0 + x @ jnp.asarray(H) @ x / 2 + x[0]


def test_the_oracle_is_the_light_of_a_rectangle():
    """Lambert's closed form against sums of the definition; its Hessian by differences."""
    place = np.array([0.3, -0.2])
    corner, u, v = (-0.5, -0.2, 1.0), (0.9, 0.0, 0.0), (0.0, 0.7, 0.0)
    assert rectangle(place) == pytest.approx(summed(place, corner, u, v), rel=1e-12)
    true = jax.jit(jax.hessian(lambda x: rectangle(x, jnp)))(jnp.asarray(place))
    np.testing.assert_allclose(
        hessian_of(lambda at: summed(at, corner, u, v), place), true, rtol=1e-6
    )


def test_every_definition_is_its_integral():
    """On the quadratic itself, over a disc, where all are closed forms of the round part."""
    R, k = 0.6, 2.0
    record = Candidates.of(np.zeros((1, 2)), np.array([1.7]), np.zeros((1, 2)))
    true = {
        "total": np.pi / 4 * k * R**4,
        "average": k * R**2 / 4,
        "average squared": k**2 * R**4 / 12,
        "integrated squared": np.pi * k**2 * R**6 / 12,
        "relative": np.pi / 4 * k * R**4 / 1.7,
    }
    M = jnp.eye(2)[None] / R

    @jax.jit
    def every(M):
        def E(x):
            return 1.7 + k * x @ x / 2

        region = ValidityRegion(M)
        return {d: true_error(E, record, region, definition=d)[0] for d in DEFINITIONS}

    for definition, ours in every(M).items():
        if definition == "largest":
            assert 0.9 * k * R**2 / 2 < float(ours) < k * R**2 / 2
        else:
            assert float(ours) == pytest.approx(true[definition], rel=1e-12)


def test_the_ideal_ellipse_of_a_quadratic_is_the_derived_one():
    lengths = jax.jit(lambda H: semi_axes(H, 0.01)[0])(jnp.asarray(H))
    record = Candidates.from_function(bowl, np.zeros((1, 2)))
    found = ideal_region(bowl, record, 0.01, 0.01, 2.0)
    area = np.pi * float(found.radius[0]) ** 2
    assert area == pytest.approx(np.pi * float(jnp.prod(lengths)), rel=1e-4)
    sizes = 1.0 / np.linalg.svd(np.asarray(found.matrix[0]))[1][::-1]
    np.testing.assert_allclose(np.sort(sizes), np.sort(np.asarray(lengths)), rtol=2e-2)


@pytest.mark.smoke
def test_the_largest_set_takes_the_least_misses_that_are_connected():
    miss = np.array([[0.1, 0.2, 9.0, 0.1]])
    assert largest_set(miss, 2.0, 0.8)[0].tolist() == [[True, True, False, True]]
    chosen, area = largest_set(miss, 2.0, 0.8, near=(0, 0))
    assert (chosen.tolist(), area) == ([[True, True, False, False]], 4.0)


@pytest.mark.smoke
def test_the_ideal_disc_of_a_quadratic_is_the_derived_one():
    record = Candidates.from_function(bowl, np.zeros((1, 2)))
    found = ideal_region(bowl, record, 0.01, 0.01, 2.0, circle=True)
    R = radius_for(derivative_norm(jnp.asarray(H), 2, "mean"), 0.01, dims=2)
    assert float(found.radius[0]) == pytest.approx(float(R), rel=1e-4)
    np.testing.assert_allclose(found.matrix[0], np.eye(2) / float(found.radius[0]), rtol=1e-12)


# --- images ---------------------------------------------------------------------------------------


def images(seed=0):
    rng = np.random.default_rng(seed)
    a = np.cumsum(rng.normal(size=(24, 31)), axis=0)
    a = (a - a.min()) / np.ptp(a)
    return a, np.clip(a + 0.1 * rng.normal(size=a.shape), 0, 1)


def ssim_slowly(a, b, span):
    """Wang's definition, window by window: 11 x 11 Gaussian weights of width 1.5."""
    i = np.arange(-5, 6)
    w = np.exp(-(i[:, None] ** 2 + i**2) / (2 * 1.5**2))
    w /= w.sum()
    found = []
    for y in range(5, a.shape[0] - 5):
        for x in range(5, a.shape[1] - 5):
            p, q = (z[y - 5 : y + 6, x - 5 : x + 6] for z in (a, b))
            mp, mq = (w * p).sum(), (w * q).sum()
            vp, vq = (w * (p - mp) ** 2).sum(), (w * (q - mq) ** 2).sum()
            c = (w * (p - mp) * (q - mq)).sum()
            C1, C2 = (0.01 * span) ** 2, (0.03 * span) ** 2
            found.append(
                (2 * mp * mq + C1) * (2 * c + C2) / ((mp**2 + mq**2 + C1) * (vp + vq + C2))
            )
    return np.mean(found)


@pytest.mark.smoke
def test_rms():
    assert rms(np.array([[1.0, 3.0], [0.0, 0.0]]), np.zeros(2)).tolist() == [5.0**0.5, 0.0]
    assert rms(np.array([3.0j, 1.0]), np.array([0.0, 1.0])) == 4.5**0.5


@pytest.mark.smoke
def test_ssim_is_its_definition():
    a, b = images()
    assert ssim(a, b, 1.0) == pytest.approx(ssim_slowly(a, b, 1.0), rel=1e-12)


def test_ssim_has_its_published_properties():
    """Symmetric, at most one, one for the same image only; units of both image and span cancel."""
    a, b = images()
    assert ssim(a, a, 1.0) == pytest.approx(1.0, abs=1e-14)
    assert ssim(a, b, 1.0) == pytest.approx(ssim(b, a, 1.0), rel=1e-14)
    assert -1.0 < ssim(a, b, 1.0) < 1.0
    assert ssim(7 * a, 7 * b, 7.0) == pytest.approx(ssim(a, b, 1.0), rel=1e-12)
    # Flat images differ in luminance alone.
    flat = ssim(np.full((12, 12), 0.5), np.full((12, 12), 0.8), 1.0)
    assert flat == pytest.approx((2 * 0.4 + 1e-4) / (0.25 + 0.64 + 1e-4), rel=1e-12)
    # A shift of the mean is judged milder than noise of the same RMS error.
    noise = b - a
    assert ssim(a, a + np.sqrt(np.mean(noise**2)), 1.0) > ssim(a, b, 1.0)
    assert ssim(a, 1.0 - a, 1.0) < 0.3


@pytest.mark.parametrize("fault", ["no covariance", "wider window", "constants of another span"])
def test_a_fault_in_ssim_is_noticed(fault):
    a, b = images()
    wrong = {
        "no covariance": lambda: ssim(a, a, 1.0),
        "wider window": lambda: ssim(a, b, 1.0, sigma=1.0),
        "constants of another span": lambda: ssim(a, b, 255.0),
    }[fault]()
    assert abs(wrong - ssim_slowly(a, b, 1.0)) > 1e-3


@pytest.mark.smoke
def test_floats_per_record():
    assert [floats_per_record(k) for k in (0, 1, 2)] == [5, 8, 11]
    assert floats_per_record(1, ellipse=True, plane=True) == 8


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ssim(np.zeros((4, 4)), np.zeros((4, 4)), 1.0), r"^Argument `a` must have at"),
        (lambda: ssim(np.zeros(4), np.zeros(4), 1.0), r"^Arguments must be images of one shape"),
        (lambda: ssim(np.eye(20), np.eye(20), 0.0), r"^Argument `span` must be positive, but is 0"),
        (lambda: largest_set(np.ones((2, 2)), 1.0, -1.0), r"^Argument `tolerance` must be"),
        (
            lambda: true_error(lamp, at(0.0), segment(0.1), definition="median"),
            r"^Argument `definition` must be one of",
        ),
        (
            lambda: ideal_region(lamp, at(0.0), 0.0, 0.1, 1.0),
            r"^Argument `tolerance` must be positive, but is 0.0.$",
        ),
        (
            lambda: true_error(
                bowl,
                Candidates.of(np.zeros((1, 2)), np.zeros(1), np.zeros((1, 2))),
                ValidityRegion(jnp.eye(2)[None]),
                breaks=(0.1,),
            ),
            r"^Argument `breaks` must be left out on a plane.$",
        ),
        (
            lambda: true_error(
                bowl, Candidates.of(np.zeros((1, 2)), np.zeros(1), np.zeros((1, 2))), segment(0.1)
            ),
            r"^Argument `region` must have 2 dimensions, as the candidates have, but has 1: ",
        ),
        (
            lambda: true_error(lamp, at(0.0), ValidityRegion(jnp.ones((2, 1, 1)))),
            r"^Argument `region` must have shape \(1, 1, 1\), but has \(2, 1, 1\).$",
        ),
        *(
            (
                lambda given=given: ideal_region(lamp, at(0.0), **given),
                r"^Argument `(tolerance|low|high)` must be one number, but has shape \(2,\).$",
            )
            for given in (
                {"tolerance": np.ones(2), "low": 0.1, "high": 1.0},
                {"tolerance": 0.1, "low": np.full(2, 0.1), "high": 1.0},
                {"tolerance": 0.1, "low": 0.1, "high": np.ones(2)},
            )
        ),
        (lambda: floats_per_record(3), r"^Argument `order` must be 0, 1 or 2, but is 3.$"),
    ],
)  # fmt: skip
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_limits_of_an_ideal_region_are_in_order():
    flat = Candidates.on_line(jnp.zeros(1), jnp.zeros((1, 2)))
    with pytest.raises(ValueError, match=r"`high` must be at least 5, but is 0\.1"):
        ideal_region(jnp.square, flat, 0.5, 5.0, 0.1)
    with pytest.raises(ValueError, match=r"`most` must be at least 1, but is 0\.5"):
        ideal_region(jnp.square, flat, 0.5, 0.1, 5.0, most=0.5)


def test_a_window_of_one_pixel_compares_values():
    """Its rim is of no pixel, and a slice that ended there was once empty."""
    a, C1 = np.linspace(0.0, 1.0, 12).reshape(3, 4), 1e-4
    b = a**2
    expected = np.mean((2.0 * a * b + C1) / (a * a + b * b + C1))
    np.testing.assert_allclose(ssim(a, b, 1.0, sigma=0.05), expected, rtol=1e-12)
    with pytest.raises(ValueError, match="`sigma` must be positive"):
        ssim(a, b, 1.0, sigma=0.0)


@pytest.mark.parametrize(("kind", "far"), [(np.uint8, 250), (np.int8, -100), (bool, 0)])
def test_levels_of_pixels_do_not_go_around(kind, far):
    a, b = np.array([1, far], kind), np.array([0, 100], kind)
    truth = np.sqrt(np.mean((a.astype(float) - b.astype(float)) ** 2))
    assert caching.rms(a, b) == truth


def test_a_set_of_short_numbers_is_summed_in_long_ones():
    miss = np.full((200, 200), 0.125, np.float16)
    assert caching.largest_set(miss, 1.0, 2500.0)[1] == 20000.0
    assert caching.largest_set(np.array([[-128, 1]], np.int8), 1.0, 3.0)[0].tolist() == [
        [False, True]
    ]


def test_a_region_of_what_is_no_number_is_none():
    flat = caching.Candidates.on_line(jnp.zeros(1), jnp.zeros((1, 2)))
    found = caching.ideal_region(lambda x: jnp.nan * x[0], flat, 0.1, 0.01, 1.0)
    assert jnp.isnan(found.radius).all()


def test_a_relative_error_wants_light():
    dark = caching.Candidates.on_line(jnp.zeros(1), jnp.zeros((1, 2)))
    region = caching.circular_regions(jnp.ones(1), 0.1, 1.0)
    with pytest.raises(ValueError, match=r"Argument `value` must be positive, but is 0.0\."):
        caching.true_error(jnp.square, dark, region, definition="relative")
