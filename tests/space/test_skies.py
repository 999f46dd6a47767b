import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland.skies import PanoramaSky as PanoramaRow
from firstorder.space.skies import (
    ConstantSky,
    GaussianSky,
    HarmonicSky,
    PanoramaSky,
    _angles,
    _harmonics,
)

RNG = np.random.default_rng(11)
PICTURE = RNG.uniform(0.0, 3.0, (5, 8))
SKIES = {
    "constant": ConstantSky(0.7),
    "gaussian": GaussianSky((0.3, -0.5, 0.6), 0.8, 1.3),
    "panorama": PanoramaSky(PICTURE),
    "harmonic": HarmonicSky(RNG.normal(size=16)),
}


def everywhere(n, seed=0):
    w = np.random.default_rng(seed).normal(size=(n, 3))
    return jnp.asarray(w / np.linalg.norm(w, axis=1)[:, None])


def direction(u, v):
    """As the module says it, by trigonometry."""
    psi = 2.0 * np.pi * (u - 0.5)
    return np.stack([np.sin(np.pi * v) * np.sin(psi), np.sin(np.pi * v) * np.cos(psi),
                     np.cos(np.pi * v) + 0.0 * psi], -1)  # fmt: skip


def quadrature(n):
    z, weights = np.polynomial.legendre.leggauss(n)
    psi = 2.0 * np.pi * np.arange(2 * n) / (2 * n)
    s = np.sqrt(1.0 - z * z)
    w = np.stack([np.outer(s, np.cos(psi)), np.outer(s, np.sin(psi)),
                  np.broadcast_to(z[:, None], (n, 2 * n))], -1)  # fmt: skip
    return jnp.asarray(w), np.repeat(weights[:, None] * np.pi / n, 2 * n, 1)


POLES = jnp.array([[0.0, 0, 1], [0, 0, -1], [0, -1, 0], [1e-9, 0, 1], [-1e-200, 0, -1]])


@pytest.mark.parametrize("name", SKIES)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_values_and_slopes_are_finite_and_keep_their_precision(name, dtype):
    sky = jax.tree.map(lambda x: x.astype(dtype), SKIES[name])
    w = jnp.concatenate([POLES, everywhere(20)]).astype(dtype)
    value, slope = jax.jit(jax.vmap(jax.value_and_grad(lambda w: sky(w))))(w)
    assert value.dtype == slope.dtype == dtype
    assert np.all(np.isfinite(value))
    assert np.all(np.isfinite(slope))


@pytest.mark.smoke
def test_pixels_stand_where_the_convention_says():
    sky = SKIES["panorama"]
    i, j = np.mgrid[:5, :8]
    np.testing.assert_allclose(sky(jnp.asarray(direction((j + 0.5) / 8, (i + 0.5) / 5))), PICTURE,
                               rtol=0.0, atol=1e-13)  # fmt: skip
    # +y in the middle, +x to the right of it, zenith at the top
    one = np.zeros((3, 16))
    one[1, 11:13] = 1.0
    assert PanoramaSky(one)(jnp.array([1.0, 0, 0])) > 0.99
    assert PanoramaSky(one)(jnp.array([-1.0, 0, 0])) == 0.0
    np.testing.assert_allclose(sky(jnp.array([0.0, 0, 1])), PICTURE[0].mean(), rtol=1e-14)
    np.testing.assert_allclose(sky(jnp.array([0.0, 0, -1])), PICTURE[-1].mean(), rtol=1e-14)


def test_its_horizon_is_the_row_of_flatland():
    picture = RNG.uniform(size=(5, 12))
    a = np.linspace(-3.0, 3.0, 41)
    w = jnp.asarray(np.stack([-np.sin(a), np.cos(a), 0.0 * a], -1))
    np.testing.assert_allclose(
        PanoramaSky(picture)(w), PanoramaRow(picture[2])(a), rtol=0.0, atol=1e-13
    )


@pytest.mark.parametrize("name", SKIES)
def test_no_jump_anywhere(name):
    """Through the seam, the poles, rows and columns: neighbours of h differ by less than C h."""
    h = 1e-6
    around = np.linspace(0.0, 2.0 * np.pi, 400)
    paths = [
        direction(np.linspace(-0.2, 1.2, 400), np.full(400, v)) for v in (1e-9, 0.02, 0.5, 0.99)
    ]
    paths += [np.stack([np.sin(around) * c, np.sin(around) * s, np.cos(around)], -1)
              for c, s in ((1.0, 0.0), (0.6, 0.8))]  # fmt: skip
    w = np.concatenate(paths)
    aside = np.random.default_rng(1).normal(size=w.shape)
    other = w + h * aside
    other /= np.linalg.norm(other, axis=1)[:, None]
    sky = jax.jit(lambda w: SKIES[name](w))
    step = np.abs(sky(jnp.asarray(other)) - sky(jnp.asarray(w)))
    # Next to a pole the picture's azimuth turns quickly, where its weight vanishes as quickly.
    assert step.max() < 30.0 * h * 3.0


def test_the_gaussians_gradient_is_its_slope_on_the_sphere():
    sky, w = SKIES["gaussian"], everywhere(20)
    slope = jax.jit(jax.vmap(jax.grad(lambda w: sky(w / jnp.linalg.norm(w)))))(w)
    np.testing.assert_allclose(sky.gradient(w), slope, rtol=0.0, atol=1e-14)
    w, weights = quadrature(40)
    total = 2.0 * np.pi * 1.3 * 0.8**2 * (1.0 - np.exp(-2.0 / 0.8**2))
    np.testing.assert_allclose(np.sum(weights * sky(w)), total, rtol=1e-13)
    narrow = GaussianSky((0, 0, 1), 0.05)
    np.testing.assert_allclose(narrow(jnp.asarray(direction(0.3, np.float64(0.05 / np.pi)))),
                               np.exp(-0.5), rtol=1e-3)  # fmt: skip


@pytest.mark.parametrize("length", [2e-38, 1e-25, 1e25, 1e38])
def test_the_gaussians_middle_may_have_any_length_in_single_precision(length):
    w = jnp.array([0.6, 0.0, 0.8], jnp.float32)
    one, other = (
        GaussianSky(jnp.array([0.0, 0.0, size], jnp.float32), jnp.float32(0.5))
        for size in (1.0, length)
    )
    assert one(w) == other(w)
    np.testing.assert_array_equal(one.gradient(w), other.gradient(w))


def test_harmonics_are_orthonormal_and_those_of_scipy():
    from scipy.special import sph_harm_y

    w, weights = quadrature(12)
    each = jax.jit(lambda w: _harmonics(w, 8))
    Y = np.asarray(each(w)).reshape(-1, 81)
    np.testing.assert_allclose(Y.T @ (weights.reshape(-1, 1) * Y), np.eye(81), rtol=0.0, atol=1e-13)
    x, y, z = np.asarray(everywhere(5)).T
    theta, phi = np.arccos(z), np.arctan2(y, x)
    found = np.asarray(each(jnp.asarray(np.stack([x, y, z], -1))))
    for n, m in ((1, 0), (3, 2), (5, -4), (8, 8), (8, -1)):
        theirs = sph_harm_y(n, abs(m), theta, phi) * (-1) ** m
        expected = theirs.real if m == 0 else np.sqrt(2) * (theirs.real if m > 0 else theirs.imag)
        np.testing.assert_allclose(found[:, n * n + n + m], expected, rtol=0.0, atol=1e-13)


def test_a_panorama_without_its_high_harmonics():
    flat = PanoramaSky(np.full((4, 8), 0.3)).harmonic(3)
    np.testing.assert_allclose(flat(everywhere(9)), 0.3, rtol=1e-13)
    # a smooth sky on a fine picture comes back, with the second order of straight lines
    wanted, errors = HarmonicSky(RNG.normal(size=9) + 20.0 * np.eye(9)[0]), []
    for n in (8, 16):
        i, j = np.mgrid[:n, : 2 * n]
        picture = wanted(jnp.asarray(direction((j + 0.5) / (2 * n), (i + 0.5) / n)))
        found = PanoramaSky(picture).harmonic(2).coefficients
        errors.append(np.max(np.abs(found - wanted.coefficients)))
    assert 1.6 < np.log2(errors[0] / errors[1]) < 2.4


def test_every_number_is_a_leaf_with_a_slope():
    w = jnp.array([0.3, 0.4, 0.2])
    values, center = jax.grad(
        lambda v, c: PanoramaSky(v)(w) + GaussianSky(c)(w), (0, 1)
    )(jnp.asarray(PICTURE), jnp.array([0.1, 0.2, 1.0]))  # fmt: skip
    assert np.count_nonzero(values) == 4
    np.testing.assert_allclose(values.sum(), 1.0, rtol=1e-14)
    assert np.all(np.isfinite(center))
    assert np.any(center != 0.0)


def test_angles_are_those_of_the_convention():
    u, v = np.array([0.1, 0.5, 0.9]), np.array([0.2, 0.5, 0.7])
    psi, theta = _angles(jnp.asarray(3.0 * direction(u, v)))
    np.testing.assert_allclose(psi, 2.0 * np.pi * (u - 0.5), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(theta, np.pi * v, rtol=1e-14)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ConstantSky(-1.0), "Argument `radiance` must not be negative, but is -1.0."),
        (
            lambda: GaussianSky((0.0, 0.0, 0.0)),
            "Argument `center` must have a direction, but is the zero vector.",
        ),
        (lambda: GaussianSky((0.0, 1.0)), "Argument `center` must have shape (3,), but has (2,)."),
        (lambda: GaussianSky(sigma=0.0), "Argument `sigma` must be positive, but is 0.0."),
        (
            lambda: PanoramaSky([[1.0, 2.0]]),
            "Argument `values` must have shape (rows >= 2, columns >= 4), but has (1, 2).",
        ),
        (
            lambda: PanoramaSky(np.full((2, 4), np.nan)),
            "Argument `values` must be finite, but is nan.",
        ),
        (
            lambda: PanoramaSky(np.full((2, 4), -1.0)),
            "Argument `values` must not be negative, but is -1.0.",
        ),
        (
            lambda: HarmonicSky([1.0, 2.0]),
            "Argument `coefficients` must be 1, 4, 9, ... numbers, but has (2,).",
        ),
        (
            lambda: PanoramaSky(PICTURE).harmonic(-1),
            "Argument `degree` must not be negative, but is -1.",
        ),
    ],
)
def test_a_bad_sky_is_one_sentence(make, sentence):
    with pytest.raises(ValueError, match="Argument") as caught:
        make()
    assert str(caught.value) == sentence


@pytest.mark.parametrize(
    "sky",
    [
        ConstantSky,
        lambda L: GaussianSky((0.0, 0.0, 1.0), 0.5, L),
        lambda sigma: GaussianSky((0.0, 0.0, 1.0), sigma),
    ],
)
def test_a_traced_number_that_makes_no_sky_is_no_light(sky):
    L = jax.jit(lambda x: sky(x)(jnp.array([0.6, 0.0, 0.8])))
    assert np.isnan(L(-0.5))
    assert L(0.5) > 0.0


@pytest.mark.parametrize("level", [0, 3])
def test_in_the_middle_of_a_pixel_it_is_the_pixel_wherever_the_sky_is_turned(level):
    """A compiler may round such a direction to both sides of the middle in one program."""
    rng = np.random.default_rng(5)
    picture = rng.uniform(1.0, 2.0, (4, 8))
    i, j = rng.integers(0, 4, 2000), rng.integers(0, 8, 2000)
    theta, psi = np.pi * (i + 0.5) / 4, 2.0 * np.pi * ((j + 0.5) / 8 - 0.5)
    w = np.stack([np.sin(theta) * np.sin(psi), np.sin(theta) * np.cos(psi), np.cos(theta)], -1)
    turn = np.linalg.qr(rng.normal(size=(2000, 3, 3)))[0]

    def light(w, turn):
        x, y, z = (w[k] * turn[k] for k in range(3))
        return PanoramaSky(picture)(x + y + z)

    both = jax.vmap(jax.value_and_grad(light))
    compiled = jax.jit(both, compiler_options={"xla_backend_optimization_level": level})
    found, _ = compiled(np.einsum("nij,nj->ni", turn, w), turn)
    np.testing.assert_allclose(found, picture[i, j], rtol=1e-9)
