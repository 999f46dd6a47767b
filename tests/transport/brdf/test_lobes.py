import functools
import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy as sp
from numpy.polynomial import legendre
from scipy.integrate import quad

from derivations.transport.brdf import lobes as derived
from firstorder.fields import GaussianProfile
from firstorder.numerics._splines import cubic_b_spline
from firstorder.transport.brdf.lobes import (
    MIRROR,
    NORMAL,
    RETRO,
    CosinePowerProfile,
    TabulatedProfile,
    glossy,
    lambert,
    phong,
    retro,
)

leggauss = functools.cache(legendre.leggauss)  # of a thousand nodes it takes half a second
QUARTER = 0.5 * np.pi
TABLE = np.exp(-0.5 * ((np.arange(21) - 10) * 0.1 / 0.2 - 0.4) ** 2)  # off-centre, hence not even
PROFILES = {
    "cos 1": (CosinePowerProfile(1.0, weight=0.7), QUARTER),
    "cos 2.5": (CosinePowerProfile(2.5), QUARTER),
    "cos 40": (CosinePowerProfile(40.0, weight=1.3), QUARTER),
    "table": (TabulatedProfile(TABLE, 0.1, center=0.05), 1.3),
}


@eqx.filter_jit
def derivatives(profile, t):
    """Of a profile at many angles, in one program for all profiles of a kind."""
    return jax.vmap(profile.derivatives)(t)


OMEGA = np.array([-1.7, -0.31, 0.0, 0.2, 0.9, 2.3])


def transform(p, reach, Omega):
    """The Fourier integral by adaptive quadrature."""

    def part(wave):
        return quad(lambda t: p(t) * wave(2.0 * np.pi * Omega * t), -reach, reach, limit=400)[0]

    return part(np.cos) - 1j * part(np.sin)


def interpolated(profile):
    at = jax.jit(lambda t: profile.derivatives(t)[0])
    return lambda t: float(at(jnp.asarray(t)))


def cosine_power(s, weight):
    """Normalised by quadrature, in NumPy."""
    # A power of a cosine at its end, in a variable in which it is smooth.
    total = quad(
        lambda a: np.cos(QUARTER * np.sin(a)) ** s * QUARTER * np.cos(a),
        -QUARTER,
        QUARTER,
        epsabs=1e-13,
    )[0]
    return lambda t: weight * np.cos(t) ** s / total


TRUTH = {
    "cos 1": cosine_power(1.0, 0.7),
    "cos 2.5": cosine_power(2.5, 1.0),
    "cos 40": cosine_power(40.0, 1.3),
}


@pytest.mark.smoke
@pytest.mark.parametrize("name", TRUTH)
def test_a_cosine_power_is_normalised(name):
    profile, _ = PROFILES[name]
    for t in (-1.2, 0.0, 0.4):
        p = profile.derivatives(jnp.asarray(t))[0]
        np.testing.assert_allclose(p, TRUTH[name](t), rtol=1e-11)


@pytest.mark.parametrize(
    ("s", "peak"), [(1.0, 1 / 2), (2.0, 2 / np.pi), (3.0, 3 / 4), (5.0, 15 / 16)]
)
def test_peaks_of_whole_powers_are_known_to_rounding(s, peak):
    found = CosinePowerProfile(s).derivatives(jnp.asarray(0.0))[0]
    np.testing.assert_allclose(found, peak, rtol=1e-14)


@pytest.mark.parametrize("name", PROFILES)
def test_transforms_are_fourier_integrals(name):
    profile, reach = PROFILES[name]
    p = TRUTH.get(name) or interpolated(profile)
    reach = reach if name in TRUTH else 1.3
    found = [complex(profile.transform(jnp.asarray(w))) for w in OMEGA[[0, 3, 5]]]
    np.testing.assert_allclose(
        found,
        [transform(p, reach, w) for w in OMEGA[[0, 3, 5]]],
        rtol=0.0,
        atol=3e-8 if name == "table" else 1e-10,
    )


WRONG_TRANSFORMS = {
    "drop the 2 pi": lambda p, w: p.transform(w / (2.0 * np.pi)),
    "drop the energy": lambda p, w: p.transform(w) / p.transform(jnp.asarray(0.0)),
    "flip the sign of the frequency's half": lambda p, w: p.transform(w) * jnp.cos(w),
}


@pytest.mark.parametrize("fault", WRONG_TRANSFORMS)
def test_a_transform_fault_is_seen(fault):
    profile, reach = PROFILES["cos 40"]
    right = transform(TRUTH["cos 40"], reach, 0.9)
    wrong = complex(WRONG_TRANSFORMS[fault](profile, jnp.asarray(0.9)))
    assert abs(wrong - right) > 1e-3


@pytest.mark.parametrize("name", PROFILES)
def test_derivatives_are_those_of_the_value(name):
    """Each derivative is the slope of the one before."""
    profile, _ = PROFILES[name]
    t = jnp.array([-1.1, -0.33, 0.04, 0.21, 0.9])

    def both(s):
        return jax.jvp(lambda s: profile.derivatives(s)[:2], (s,), (jnp.ones_like(s),))

    (_, d), (slope, bend) = jax.jit(jax.vmap(both))(t)
    np.testing.assert_allclose(d, slope, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(derivatives(profile, t)[2], bend, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("name", ["cos 1", "cos 2.5", "cos 40"])
def test_spread_is_the_second_moment_of_the_power_spectrum(name):
    profile, _ = PROFILES[name]
    t, w = leggauss(200)
    p, d, _ = derivatives(profile, QUARTER * t)
    want = np.sum(w * d**2) / (4.0 * np.pi**2 * np.sum(w * p**2))
    np.testing.assert_allclose(profile.spread(), want, rtol=1e-6)  # 2.5: cos^3 has no closed rule


def test_a_table_is_met_at_its_nodes_and_smooth_between():
    lobe = TabulatedProfile(TABLE, 0.1, center=0.05)
    nodes = 0.05 + (np.arange(21) - 10) * 0.1
    found = jax.vmap(lambda t: lobe.derivatives(t)[0])(jnp.asarray(nodes))
    np.testing.assert_allclose(found, TABLE, rtol=0.0, atol=1e-14)
    for one in lobe.derivatives(jnp.asarray(0.1 + 1e-9)), lobe.derivatives(jnp.asarray(3.0)):
        assert np.all(np.isfinite(one))
    before, after = (lobe.derivatives(jnp.asarray(0.25 + e)) for e in (-1e-9, 1e-9))
    np.testing.assert_allclose(before, after, rtol=0.0, atol=1e-5)
    assert lobe.derivatives(jnp.asarray(3.0))[0] == 0.0


def test_a_table_bends_at_its_knots_alone():
    """Its second derivative is straight between knots, and zero before the first and behind."""
    lobe = TabulatedProfile(TABLE, 0.1, center=0.05)
    knots = np.asarray(lobe.knots())

    def bend(t):
        return float(lobe.derivatives(jnp.asarray(t))[2])

    assert bend(knots[0] - 0.01) == bend(knots[-1] + 0.01) == 0.0
    np.testing.assert_allclose(lobe.half_width(), np.max(np.abs(knots)), rtol=1e-14)
    for start, end in itertools.pairwise(knots):
        first, middle, last = (bend(start + x * (end - start)) for x in (0.1, 0.5, 0.9))
        np.testing.assert_allclose(middle, 0.5 * (first + last), rtol=0.0, atol=1e-9)
        assert abs(first) + abs(last) > 0.0


def test_a_table_can_be_given_its_energy():
    lobe = TabulatedProfile(TABLE, 0.1, weight=0.8)
    np.testing.assert_allclose(complex(lobe.transform(jnp.asarray(0.0))), 0.8, rtol=0.0, atol=1e-14)


def test_the_b_spline_adds_up_to_one():
    b, d, dd = cubic_b_spline(0.3 - np.arange(-3, 4))
    np.testing.assert_allclose([b.sum(), d.sum(), dd.sum()], [1.0, 0.0, 0.0], rtol=0.0, atol=1e-14)


def test_a_rigid_rotation_changes_no_argument():
    for a in (MIRROR, NORMAL, RETRO):
        assert a.turn + a.look == 1.0
    assert [lobe.argument for lobe in (glossy(0.1), phong(3.0), lambert(), retro(0.1))] == [
        MIRROR,
        MIRROR,
        NORMAL,
        RETRO,
    ]


@pytest.mark.parametrize("s", [1.0, 1.5, 2.0, 7.3])
def test_no_nan_at_the_ends_of_a_cosine_power(s):
    lobe = CosinePowerProfile(s)
    ends = jnp.array([-QUARTER, QUARTER, QUARTER * (1 + 1e-15), 2.0, np.nextafter(QUARTER, 0.0)])
    for column in derivatives(lobe, ends):
        assert np.all(np.isfinite(column))
    slopes, by_s = slopes_of_a_power(s, ends)
    assert np.all(np.isfinite(slopes))
    assert np.isfinite(by_s)


@jax.jit
def slopes_of_a_power(s, t):
    """By the angle at each t, and by the power at the end."""
    slopes = jax.vmap(jax.grad(lambda t: CosinePowerProfile(s).derivatives(t)[0]))(t)
    return slopes, jax.grad(lambda s: CosinePowerProfile(s).derivatives(jnp.asarray(QUARTER))[0])(s)


def test_a_transform_has_no_nan_at_its_zeros():
    lobe = CosinePowerProfile(2.0)
    zero = (1.0 + 0.5 * 2.0 + 3.0) / np.pi  # a pole of a Gamma function
    value, slope = jax.value_and_grad(lobe.transform)(zero)
    assert abs(value) < 1e-12
    assert np.isfinite(slope)


@pytest.mark.parametrize(
    ("dtype", "s", "close"),
    [
        (jnp.float64, 1.0, 1e-13),
        (jnp.float64, 50.0, 1e-13),
        (jnp.float64, 250.0, 1e-12),
        (jnp.float64, 1e4, 1e-10),
        (jnp.float32, 1.0, 2e-6),
        (jnp.float32, 60.0, 2e-5),
        (jnp.float32, 1e3, 2e-6),
    ],
)
def test_sharp_cosine_powers_have_transforms(dtype, s, close):
    lobe = jax.tree.map(lambda a: a.astype(dtype), CosinePowerProfile(s))
    Omega = np.array([0.0, 0.3, 0.1 * np.sqrt(s), (1.0 + 0.5 * s) / np.pi, 2.3 + s / 6.0])
    t, w = leggauss(1000)
    t, w = t * float(lobe.half_width()), w * np.cos(t * float(lobe.half_width())) ** s
    want = np.cos(2.0 * np.pi * Omega[:, None] * t) @ w / w.sum()
    found, slopes = transforms_of_powers(Omega.astype(dtype), np.full(Omega.shape, s, dtype))
    np.testing.assert_allclose(found, want, rtol=0.0, atol=close)
    assert np.all(np.isfinite(slopes))


@jax.jit
@jax.vmap
def transforms_of_powers(Omega, s):
    def value(Omega, s):
        return CosinePowerProfile(s).transform(Omega)

    return jax.value_and_grad(value, (0, 1))(Omega, s)


@pytest.mark.parametrize("s", [1.0, 7.3, 50.0, 1e3, 1e4])
def test_cosine_powers_are_normalised_in_single_precision(s):
    lobe = jax.tree.map(lambda a: a.astype(jnp.float32), CosinePowerProfile(s))
    t, w = leggauss(200)
    h = float(lobe.half_width())
    p = np.asarray(derivatives(lobe, np.asarray(h * t, np.float32))[0], float)
    assert abs(h * np.sum(w * p) - 1.0) < 1e-6


def test_lobes_keep_their_precision():
    t = jnp.asarray(0.2, jnp.float32)
    lobes = (CosinePowerProfile(3.0), GaussianProfile(0.3), TabulatedProfile(TABLE, 0.1))
    for lobe in jax.tree.map(lambda a: a.astype(jnp.float32), lobes):
        assert {a.dtype for a in lobe.derivatives(t)} == {jnp.dtype("float32")}


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: CosinePowerProfile(0.5), r"Argument `s` must lie in \[1, inf\], but is 0.5\."),
        (lambda: CosinePowerProfile(np.nan), "Argument `s` must be finite"),
        (lambda: CosinePowerProfile(2.0, weight=np.inf), "Argument `weight` must be finite"),
        (lambda: glossy(0.0), "Argument `sigma` must be positive, but is 0.0."),
        (lambda: lambert(1.2), r"Argument `albedo` must lie in \[0, 1\], but is 1.2\."),
        (
            lambda: TabulatedProfile([0.0, 0.0, 0.0], 0.1),
            "Argument `values` must have a positive integral",
        ),
        (lambda: TabulatedProfile([1.0, np.nan], 0.1), "Argument `values` must be finite"),
        (lambda: TabulatedProfile([1.0], 0.1), "Argument `values` must be a list of two or more"),
        (lambda: TabulatedProfile([1.0, 1.0], 0.0), "Argument `step` must be positive"),
    ],
)
def test_bad_lobes_are_refused_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


@pytest.mark.parametrize("proof", derived.PROOFS, ids=lambda p: p.__name__)
def test_the_formulas_follow_from_their_integrals(proof):
    assert all(sp.simplify(e) == 0 for e in proof())


@pytest.mark.parametrize("s", [1e3, 1e5, 1e7])
def test_a_sharp_cosine_power_is_its_bell_in_single_precision(s):
    """Of variance 1 / s, to first order in that: transform and reach."""
    lobe = jax.tree.map(lambda a: a.astype(jnp.float32), CosinePowerProfile(s))
    Omega = jnp.asarray(0.1 * np.sqrt(s), jnp.float32)
    bell = np.exp(-2.0 * np.pi**2 * float(Omega) ** 2 / s)
    np.testing.assert_allclose(lobe.transform(Omega), bell, rtol=2e-6 + 1.0 / s)
    reach = np.sqrt(2.0 * 18.0 * np.log(10.0) / s)
    np.testing.assert_allclose(lobe.half_width(), reach, rtol=2e-6 + 7.0 / s)


@pytest.mark.parametrize(
    ("look", "bad", "good"),
    [
        (lambda s: CosinePowerProfile(s).derivatives(jnp.array(0.2))[0], (0.5, -2.0), (1.0, 3.0)),
        (lambda s: CosinePowerProfile(s).transform(jnp.array(0.2)).real, (0.5, -2.0), (1.0, 3.0)),
        (lambda s: CosinePowerProfile(s).spread(), (0.5, -2.0), (1.0, 3.0)),
        (lambda h: TabulatedProfile(TABLE, h)(0.0, 0.1), (0.0, -0.1), (0.1,)),
        (lambda h: TabulatedProfile(h * TABLE, -h)(0.0, 0.1), (0.1, -0.1), ()),
        (lambda w: TabulatedProfile(w * TABLE, 0.1)(0.0, 0.1), (0.0, -1.0), (1.0,)),
        (lambda h: TabulatedProfile(TABLE, h)(0.0, 5.0), (0.0, -0.1), (0.1,)),  # beside it
        (lambda a: lambert(a).kernel(0.0, 0.1), (-0.1, 1.1), (0.0, 1.0)),
    ],
)
def test_traced_numbers_that_make_no_lobe_give_nan(look, bad, good):
    look = jax.jit(look)
    assert all(np.isnan(look(number)) for number in bad)
    assert all(np.isfinite(look(number)) for number in good)


@pytest.mark.parametrize("level", [0, 3])
def test_at_its_nodes_a_table_is_what_it_is_however_the_offset_is_made(level):
    """A compiler may round such an offset to both sides of a node in one program."""
    rng = np.random.default_rng(7)
    lobe = TabulatedProfile(rng.uniform(1.0, 2.0, 9), 0.25)
    node = rng.integers(0, 9, 3000)
    a, b = rng.uniform(-3.0, 3.0, 3000), rng.uniform(1.0, 2.0, 3000)
    t = -1.0 + 0.25 * np.arange(9)
    compiler = {"xla_backend_optimization_level": level}
    for k in range(3):

        def derivative(x, k=k):
            return lobe.derivatives(x[0] + x[1] * x[2])[k]

        both = jax.jit(jax.vmap(jax.value_and_grad(derivative)), compiler_options=compiler)
        found, _ = both(np.stack([t[node] - a, a / b, b], -1))
        true = jax.vmap(lobe.derivatives)(t)[k]
        np.testing.assert_allclose(found, true[node], rtol=0.0, atol=1e-9 * np.max(np.abs(true)))
