import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._lamp import hessian_of, lamp, summed
from firstorder.caching import (
    DEFINITIONS,
    floats_per_record,
    ideal_ellipse,
    largest_set,
    semi_axes,
    ssim,
    surface_error,
)

H = np.array([[3.0, 1.0], [1.0, 1.0]])


def bowl(x):
    return 1.0 + x @ jnp.asarray(H) @ x / 2 + x[0]


def test_the_oracle_is_the_light_of_a_rectangle():
    """Lambert's closed form against sums of the definition; its Hessian by differences."""
    place = np.array([0.3, -0.2])
    corner, u, v = (-0.5, -0.2, 1.0), (0.9, 0.0, 0.0), (0.0, 0.7, 0.0)
    assert lamp(place) == pytest.approx(summed(place, corner, u, v), rel=1e-12)
    true = jax.jit(jax.hessian(lambda x: lamp(x, jnp)))(jnp.asarray(place))
    np.testing.assert_allclose(
        hessian_of(lambda at: summed(at, corner, u, v), place), true, rtol=1e-6
    )


def test_every_definition_is_its_integral():
    """On the quadratic itself, over a disc, where all are closed forms of the round part."""
    R, k = 0.6, 2.0
    record = jnp.zeros(2), jnp.asarray(1.7), jnp.zeros(2), jnp.zeros((2, 2))
    true = {
        "total": np.pi / 4 * k * R**4,
        "average": k * R**2 / 4,
        "average squared": k**2 * R**4 / 12,
        "integrated squared": np.pi * k**2 * R**6 / 12,
        "relative": np.pi / 4 * k * R**4 / 1.7,
    }
    M = jnp.eye(2) / R

    @jax.jit
    def every(M):
        def E(x):
            return 1.7 + k * x @ x / 2

        return {d: surface_error(E, *record, M, definition=d) for d in DEFINITIONS}

    for definition, ours in every(M).items():
        if definition == "largest":
            assert 0.9 * k * R**2 / 2 < float(ours) < k * R**2 / 2
        else:
            assert float(ours) == pytest.approx(true[definition], rel=1e-12)


def test_the_ideal_ellipse_of_a_quadratic_is_the_derived_one():
    lengths = jax.jit(lambda H: semi_axes(H, 0.01)[0])(jnp.asarray(H))
    M, area = ideal_ellipse(bowl, np.zeros(2), 0.01, 0.01, 2.0)
    assert area == pytest.approx(np.pi * float(jnp.prod(lengths)), rel=1e-4)
    sizes = 1.0 / np.linalg.svd(np.asarray(M))[1][::-1]
    np.testing.assert_allclose(np.sort(sizes), np.sort(np.asarray(lengths)), rtol=2e-2)


@pytest.mark.smoke
def test_the_largest_set_takes_the_least_misses_that_are_connected():
    miss = np.array([[0.1, 0.2, 9.0, 0.1]])
    assert largest_set(miss, 2.0, 0.8)[0].tolist() == [[True, True, False, True]]
    chosen, area = largest_set(miss, 2.0, 0.8, near=(0, 0))
    assert (chosen.tolist(), area) == ([[True, True, False, False]], 4.0)


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
        (lambda: floats_per_record(3), r"^Argument `order` must be 0, 1 or 2, but is 3.$"),
    ],
)  # fmt: skip
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()
