import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import linprog

from firstorder.bandwidth import BandLimit, band_limit, band_limit_after, path_band_limits
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    BoxProfile,
    Constant,
    DiracProfile,
    Environment,
    Function,
    GaussianProfile,
    Grid,
    Harmonics,
    Separable,
    UniformProfile,
    gaussian,
    half_plane,
)
from firstorder.laws import Convolve, Hemisphere, Integrate, Move, Multiply
from firstorder.transport import (
    ClampedCosine,
    Cosine,
    Curvature,
    Mirror,
    Outgoing,
    Reflection,
    ToSlope,
    Travel,
    Wave,
    half_plane_blocker,
)

# --- the set: a linear program that another solver agrees with ---------------------------------


def random_set(rng, n=2, m=4, q=2):
    G, rows = rng.normal(size=(n, m)), rng.normal(size=(q, m))
    bounds, limits = rng.uniform(0.2, 2.0, m), rng.uniform(0.0, 2.0, q)
    frame = Frame(("x", "theta")) if n == 2 else SPACE
    return BandLimit(*map(jnp.asarray, (G, bounds, rows, limits)), frame)


def solved(band, w):
    """The reach by HiGHS, from the primal program."""
    G, bounds, rows, limits = map(
        np.asarray, (band.generators, band.bounds, band.rows, band.limits)
    )
    found = linprog(
        -(w @ G),
        A_ub=np.concatenate([rows, -rows]),
        b_ub=np.concatenate([limits, limits]),
        bounds=[(-b if np.isfinite(b) else None, b if np.isfinite(b) else None) for b in bounds],
    )
    return np.inf if found.status == 3 else -found.fun


@pytest.mark.parametrize(("n", "m", "q"), [(2, 3, 0), (2, 4, 1), (2, 4, 2), (4, 6, 3)])
def test_reach_solves_the_linear_program(n, m, q):
    rng = np.random.default_rng(n + m + q)
    for unlimited in (False, True):
        band = random_set(rng, n, m, q)
        if unlimited:
            band = eqx.tree_at(lambda b: b.bounds, band, band.bounds.at[1].set(jnp.inf))
        W = rng.normal(size=(12, n))
        if unlimited:  # along x, of which half of the directions see nothing
            generators = band.generators.at[1:, 1].set(0.0)
            band = eqx.tree_at(lambda b: b.generators, band, generators)
            W[6:, 0] = 0.0
        ours = reaches(band, jnp.asarray(W))
        for reach, w in zip(ours, W, strict=True):
            assert reach == pytest.approx(solved(band, w), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("unit", [1e-15, 1e15])
def test_reach_does_not_depend_on_the_unit_of_length(unit):
    plain = BandLimit.spanned([[1.0, 0.5, -0.3], [0.2, 1.0, 0.7]], [1.0, 2.0, 3.0])
    w = jnp.array([0.3, 0.8])
    scaled = plain.moved(jnp.diag(jnp.array([unit, 1.0])))
    cut = plain.cut("x", 0.4).cut("theta", 0.7)
    other = scaled.cut("x", 0.4 * unit).cut("theta", 0.7)
    found = other.reach(w / jnp.array([unit, 1.0]))
    np.testing.assert_allclose(found, solved(cut, np.asarray(w)), rtol=1e-12)


def test_an_edge_has_no_frequencies_along_itself():
    """0.3 - 0.1 * 3.0 is zero but for rounding."""
    edge = band_limit(half_plane(0.2)).moved([[1.0, -0.1], [0.0, 1.0]])
    assert edge.reach(np.array([0.3, 3.0])) == 0.0
    assert edge.reach(np.array([0.3, 3.1])) == jnp.inf


def test_the_farthest_point_reaches_farthest_and_lies_in_the_set():
    rng = np.random.default_rng(5)
    band = random_set(rng)
    W = rng.normal(size=(40, 2))
    points, reach = farthests(band, jnp.asarray(W)), reaches(band, jnp.asarray(W))
    assert np.allclose(np.sum(points * W, axis=1), reach, rtol=1e-7)
    assert np.all(points @ W.T <= reach + 1e-10)


def test_a_set_moves_as_its_points_do():
    band, rng = random_set(np.random.default_rng(6)), np.random.default_rng(7)
    M, N, w = rng.normal(size=(2, 2)), rng.normal(size=(2, 2)), rng.normal(size=2)
    assert band.moved(M).reach(w) == pytest.approx(band.reach(M @ w))  # w . M^T Omega
    both = band_limit_after(Move(N), band_limit_after(Move(M), band))
    assert both.reach(w) == pytest.approx(band_limit_after(Move(M @ N), band).reach(w))


def test_equal_edges_that_are_cut_are_no_more_unlimited_than_one():
    edge = band_limit(half_plane(0.2)).moved([[1.0, 1.0 / 3.0], [0.0, 1.0]])
    assert (edge + edge).cut("theta", 2.0).extent("x") == pytest.approx(6.0)
    assert edge.extent("theta") == jnp.inf


def test_the_farthest_point_of_a_cut_edge_is_finite():
    """An edge has no end of its own; what it costs at other corners made the slope NaN."""
    edge = band_limit(half_plane(0.2)).moved([[1.0, 1.0 / 3.0], [0.0, 1.0]])
    cut = edge.cut("theta", 2.0)
    np.testing.assert_allclose(cut.farthest(np.array([1.0, 0.5])), (6.0, 2.0))
    np.testing.assert_allclose(jax.grad(cut.reach)(np.array([1.0, 0.5])), (6.0, 2.0))
    assert np.all(np.isnan(edge.farthest(np.array([1.0, 0.5]))))  # without end that way


# --- what laws do to it, against spectra -------------------------------------------------------


reaches = eqx.filter_jit(lambda band, W: jax.vmap(band.reach)(W))
asked_at = eqx.filter_jit(lambda F, Omega: F(*Omega.T))
farthests = eqx.filter_jit(lambda band, W: jax.vmap(band.farthest)(W))


def inside(band, frequencies, slack=1e-9):
    """Whether frequencies lie in a set, by its reach in many directions."""
    a = np.linspace(0.0, 2.0 * np.pi, 73)
    W = np.stack([np.cos(a), np.sin(a)], -1)
    return np.all(frequencies @ W.T <= np.asarray(reaches(band, jnp.asarray(W))) + slack, axis=1)


GLOSSY = Curvature(1.5) >> Mirror() >> Reflection(GaussianProfile(0.2)) >> Curvature(1.5, back=True)


def test_a_spectrum_is_below_its_level_outside_the_band_limit_at_every_step():
    path = gaussian((0.2, -0.1), (0.6, 0.15), 0.3) >> GLOSSY >> Outgoing(0.7)
    path = path >> ToSlope().linearised(jnp.zeros(2)) >> Travel(1.2)
    rng = np.random.default_rng(8)
    for band, F in zip(path_band_limits(path, level=1e-3), path.spectra, strict=True):
        assert not isinstance(band, Refused)
        assert not isinstance(F, Refused)
        far = np.array([band.extent(c) for c in band.frame.coordinates])
        Omega = rng.uniform(-2.0, 2.0, (400, 2)) * far
        ends = farthests(band, jnp.eye(2))
        asked = np.concatenate([Omega, 0.5 * ends, np.zeros((1, 2))])
        F = np.abs(asked_at(F, asked))
        size, half_way = F[:400] / F[-1], F[400:-1] / F[-1]
        out = ~inside(band, Omega)
        assert out.sum() > 100
        assert np.max(size[out]) <= 1e-3 * (1 + 1e-9)
        # ... and the set is no larger than it must be: half way to its ends there is more
        assert np.min(half_way) > 1e-3


def test_a_product_has_the_sums_of_frequencies():
    sky = Environment(Harmonics([1.0, 0.5, 0.3, 0.1], [0.0, 0.2, 0.4, 0.3]))
    light = Multiply(Wave([0.4, -0.3], mean=1.0))(Multiply(Wave([0.1, 0.5], mean=0.5))(sky))
    frequencies = np.asarray(light.series(Grid.spanning((8, 8), (1.0, 1.0))).frequencies)
    assert len(frequencies) == 7 * 9
    assert inside(band_limit(light), frequencies).all()
    assert np.max(frequencies, axis=0) == pytest.approx(
        [float(band_limit(light).extent(c)) for c in ("x", "theta")]
    )


def test_an_integral_keeps_the_slice():
    light = Move([[1.0, 0.5], [0.0, 1.0]])(gaussian((0.0, 0.0), (1.0, 0.2)))
    band = band_limit(Integrate("theta", -9.0, 9.0)(light))
    F = Integrate("theta", -9.0, 9.0)(light.spectrum())
    assert band.frame.coordinates == ("x",)
    Omega = band.extent("x") * jnp.array([1.001, 0.6])
    size = np.abs(asked_at(F, np.append(Omega, 0.0)[:, None]))
    assert size[0] / size[2] < 1e-3 < size[1] / size[2]


def test_bands_of_the_known_fields():
    slope = FLATLAND_SLOPE
    point = Separable([0.3, 0.0], (DiracProfile("x"), UniformProfile("v")))
    assert band_limit(point).extent("x") == jnp.inf
    assert band_limit(point).extent("v") == 0.0
    assert band_limit(BoxProfile(0.5, "x", slope)).extent("x") == jnp.inf
    assert band_limit(Constant(2.0)).extent("theta") == 0.0
    bell = gaussian((0.0, 0.0), (0.5, 2.0))
    total = gaussian((0.0, 0.0), (1.0, 1.0)) + bell
    assert band_limit(total).extent("x") >= band_limit(bell).extent("x")
    assert band_limit(Constant(2.0) + bell).extent("x") == band_limit(bell).extent("x")
    hump = band_limit(ClampedCosine(), 0.01).extent("theta")
    from firstorder.transport import clamped_cosine_transform

    beyond = jnp.abs(clamped_cosine_transform(hump * jnp.linspace(1.0, 30.0, 2000))) / 2.0
    assert 0.005 < beyond.max() <= 0.01


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda b: band_limit_after(Travel(1.0).law(b.frame), b), "linearise"),
        (lambda b: band_limit(Function(lambda x, t: x)), "give one"),
        (
            lambda b: band_limit_after(
                Convolve(GaussianProfile(0.1), Hemisphere(Constant(0.0))), b
            ),
            "horizon",
        ),
        (lambda b: band_limit_after(Integrate("theta", 0.0, lambda x: jnp.sin(x)), b), "ends"),
    ],
)
def test_what_has_no_band_limit_says_why(make, reason):
    with pytest.raises(Refused, match=reason):
        make(BandLimit.box((1.0, 1.0)))


def test_a_refusal_stays_to_the_end_of_the_path():
    path = gaussian((0.0, 0.0), (1.0, 1.0)) >> Curvature(1.0) >> Travel(1.0) >> Travel(1.0)
    found = path_band_limits(path)
    assert [isinstance(b, Refused) for b in found] == [False, False, True, True]
    assert all(
        isinstance(b, Refused) for b in path_band_limits(Function(lambda x, t: x) >> Mirror())
    )


def test_two_principal_curvatures_in_space():
    K, d = np.array([[0.8, 0.3], [0.3, -0.5]]), 1.7
    band = BandLimit.box((0.0, 0.0, 5.0, 4.0), SPACE)
    for event in (Curvature(K), Mirror()):
        band = band_limit_after(event.law(band.frame), band)
    band = band_limit_after(
        Curvature(K, back=True).law(band.frame), band.cut("theta", 3.0).cut("phi", 2.0)
    )
    shear = np.eye(4)
    shear[:2, 2:] = d * np.eye(2)
    band = band.moved(shear)
    J = np.eye(2) - 2.0 * d * K
    for w in np.random.default_rng(9).normal(size=(5, 2)):
        expected = np.abs(w @ J) @ [3.0, 2.0]
        assert band.reach(np.concatenate([[0.0, 0.0], w])) == pytest.approx(expected)


BANDS = [
    ("points move by M", lambda b, M: b.moved(np.asarray(M).T)),
    ("points move by M^-1", lambda b, M: b.moved(np.linalg.inv(M))),
    ("flip the shear", lambda b, M: b.moved(np.asarray(M) * [[1, -1], [1, 1]])),
]


@pytest.mark.parametrize(("name", "wrong"), BANDS)
def test_a_wrong_move_of_the_set_is_seen(name, wrong):
    M = np.array([[1.0, -0.6], [0.4, 0.9]])
    light = Wave([0.3, 0.5])
    moved = np.asarray(Move(M)(light).series(Grid.spanning((8, 8), (1.0, 1.0))).frequencies)
    assert inside(band_limit(Move(M)(light)), moved).all()
    assert not inside(wrong(band_limit(light), M), moved).all(), f"survivor: {name}"


PRODUCTS = [
    ("forget the factor", lambda f, g: f),
    ("forget the light", lambda f, g: g),
    ("the larger instead of the sum", lambda f, g: max(f, g, key=lambda b: float(b.extent("x")))),
]


@pytest.mark.parametrize(("name", "wrong"), PRODUCTS)
def test_a_wrong_product_of_sets_is_seen(name, wrong):
    f, g = Wave([0.3, 0.5]), Wave([-0.2, 0.4])
    product = np.asarray(Multiply(g)(f).series(Grid.spanning((8, 8), (1.0, 1.0))).frequencies)
    assert inside(band_limit(Multiply(g)(f)), product).all()
    assert not inside(wrong(band_limit(f), band_limit(g)), product).all(), f"survivor: {name}"


BLURS = [
    ("forget the lobe", lambda b, c: b),
    ("cut the positions", lambda b, c: b.cut("x", c)),
    ("cut at twice the frequency", lambda b, c: b.cut("theta", 2.0 * c)),
]


@pytest.mark.parametrize(("name", "wrong"), BLURS)
def test_a_wrong_cut_is_seen(name, wrong):
    lobe = GaussianProfile(0.3)
    cutoff = float(band_limit(lobe).extent("theta"))
    band = BandLimit.box((0.7 * cutoff, 3.0 * cutoff)).moved([[1.0, 0.5], [0.0, 1.0]])
    W = np.random.default_rng(16).normal(size=(20, 2))
    reach = reaches(band_limit_after(Convolve(lobe), band), jnp.asarray(W))
    right = [solved(band.cut("theta", cutoff), w) for w in W]
    assert np.allclose(reach, right, rtol=1e-9)
    assert not np.allclose(reach, reaches(wrong(band, cutoff), jnp.asarray(W))), f"survivor: {name}"


# --- manners -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: BandLimit.box((-1.0, 1.0)), "half_widths"),
        (lambda: BandLimit.spanned(np.ones((3, 2)), (1.0, 1.0)), "generators"),
        (lambda: BandLimit.spanned(np.ones(2), (1.0, 1.0)), "generators"),
        (lambda: BandLimit.spanned(np.ones((2, 3)), (1.0, 1.0)), "bounds"),
        (lambda: BandLimit.spanned(np.ones((2, 2)), (1.0, -1.0)), "bounds"),
        (lambda: BandLimit.box((1.0, 1.0)).cut("theta", -1.0), "limit"),
        (lambda: BandLimit.box((1.0, 1.0)).moved(np.eye(3)), "M"),
        (lambda: band_limit(gaussian((0.0, 0.0), (1.0, 1.0)), 2.0), "level"),
    ],
)
def test_a_bad_argument_is_one_sentence(call, argument):
    with pytest.raises(ValueError, match=f"^Argument `{argument}` must .*\\.$"):
        call()


def test_the_cosine_is_a_narrow_factor_of_a_glossy_path():
    lobe = Reflection(GaussianProfile(0.1))
    for events in (
        Curvature(1.0) >> Cosine() >> Mirror() >> lobe,
        Curvature(1.0) >> Mirror() >> lobe,
    ):
        path = Environment(Harmonics(jnp.ones(40), jnp.zeros(40))) >> events
        final = path_band_limits(path)[-1]
        assert not isinstance(final, Refused)
        assert float(final.extent("theta")) == pytest.approx(5.9156, rel=1e-4)


def test_a_blocker_in_a_path_has_all_frequencies():
    sky = Environment(Harmonics(jnp.ones(4), jnp.zeros(4), Frame(("v",))), FLATLAND_SLOPE)
    blocked = path_band_limits(sky >> half_plane_blocker(0.1, FLATLAND_SLOPE) >> Travel(0.5))
    assert not isinstance(blocked[-1], Refused)
    assert blocked[-1].extent("v") == jnp.inf


@pytest.mark.parametrize("coordinates", [("theta", "x"), ("x", "theta", "t")])
@pytest.mark.parametrize("law", [Multiply, Convolve])
def test_a_profile_of_other_light_is_refused_in_one_sentence(law, coordinates):
    """As the laws do: its axis would be another one of the light, or none."""
    light = BandLimit.box(np.arange(1.0, 1.0 + len(coordinates)), Frame(coordinates))
    with pytest.raises(ValueError, match="like the light that it meets"):
        band_limit_after(law(GaussianProfile(0.1)), light)


def test_what_is_no_path_has_no_band_limits():
    light = gaussian((0.0, 0.0), (1.0, 1.0))
    with pytest.raises(TypeError, match=r"`path` must be a path|violates type hint"):
        path_band_limits(light)  # pyright: ignore[reportArgumentType]
    with pytest.raises(TypeError, match=r"`source` must be a `BandLimit`|violates type hint"):
        path_band_limits(light >> Mirror(), 3.0)  # pyright: ignore[reportArgumentType]


def test_bands_of_the_same_coordinates_add_whatever_their_sense():
    one, other = BandLimit.box((1.0, 2.0)), BandLimit.box((0.5, 0.5), FLATLAND.turned())
    assert (one + other).extent("x") == 1.5
    with pytest.raises(ValueError, match=r"the same coordinates, but have x, theta and x, y, "):
        _ = one + BandLimit.box((1.0, 1.0, 1.0, 1.0), SPACE)


def test_a_direction_has_an_entry_for_each_coordinate():
    with pytest.raises(ValueError, match="`direction` must have shape"):
        BandLimit.box((1.0, 3.0)).reach(jnp.ones(1))
