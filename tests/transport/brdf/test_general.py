import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad

from derivations.transport.brdf import general as derived
from firstorder.fields import GaussianProfile
from firstorder.transport.brdf.general import Ggx, LobeBrdf, TabulatedBrdf
from firstorder.transport.brdf.lobes import glossy, lambert, retro
from firstorder.transport.events.interface import Fresnel, Schlick

QUARTER = 0.5 * np.pi
H = np.linspace(-QUARTER, QUARTER, 9)
BRDFS = {
    "ggx": Ggx(0.35),
    "ggx, Schlick": Ggx(0.2, Schlick(0.04)),
    "ggx, Fresnel": Ggx(0.6, Fresnel(1.5)),
    "ggx, round": Ggx(1.0),
    "lobe": LobeBrdf(glossy(0.3)),
    "table": TabulatedBrdf(1.0 + 0.5 * np.cos(H[:, None]) * np.cos(2.0 * H) + 0.2 * np.sin(H)),
}


def ggx(w, o, alpha):
    """Microfacets from their definition, in NumPy: D from slopes, masking from visible width."""
    h, d = 0.5 * (w + o), 0.5 * (w - o)
    slope = np.tan(h)
    D = 0.5 * alpha**2 / (alpha**2 + slope**2) ** 1.5 / np.cos(h) ** 3

    def Lambda(t):
        return 0.5 * (np.sqrt(1.0 + (alpha * np.tan(t)) ** 2) - 1.0)

    G = 1.0 / (1.0 + Lambda(w) + Lambda(o))
    return G * D * np.cos(d) / (2.0 * np.cos(w) * np.cos(o))


@pytest.mark.smoke
def test_ggx_is_that_of_microfacets():
    for w, o in ((0.1, -0.3), (-1.2, 0.9), (0.7, 0.7)):
        np.testing.assert_allclose(Ggx(0.35)(w, o), ggx(w, o, 0.35), rtol=1e-12)


WRONG_GGX = {
    "a Jacobian of four, as in space": lambda w, o: 0.5 * ggx(w, o, 0.35),
    "roughness squared": lambda w, o: ggx(w, o, 0.35**2),
    "half the half angle": lambda w, o: ggx(0.5 * w, 0.5 * o, 0.35),
}


@pytest.mark.parametrize("fault", WRONG_GGX)
def test_a_ggx_fault_is_seen(fault):
    assert abs(WRONG_GGX[fault](-0.5, 0.9) / float(Ggx(0.35)(-0.5, 0.9)) - 1.0) > 1e-2


@pytest.mark.parametrize("alpha", [0.1, 0.5, 1.0, 2.0])
def test_facets_cover_the_surface_once(alpha):
    rho = Ggx(alpha)

    def cover(h):
        return float(rho._facets(jnp.asarray(h))[0]) * np.cos(h)

    whole = quad(cover, -QUARTER, QUARTER, points=[0.0], epsabs=1e-12)[0]
    assert abs(whole - 1.0) < 1e-9


@pytest.mark.parametrize("o", [0.0, 0.6, -1.3])
def test_visible_facets_fill_the_view(o):
    """The weak furnace: masked by the view alone, all facets send on all that they get."""
    alpha = 0.4
    rho = Ggx(alpha)
    a = float(rho._apparent(jnp.asarray(o))[0])

    def seen(h):
        D = 0.5 * alpha**2 / (alpha**2 * np.cos(h) ** 2 + np.sin(h) ** 2) ** 1.5
        return D * max(np.cos(o - h), 0.0) * 2.0 / (np.cos(o) + a)

    assert abs(quad(seen, -QUARTER, QUARTER, points=[0.0], epsabs=1e-12)[0] - 1.0) < 1e-8


@pytest.mark.parametrize("name", ["ggx", "ggx, Schlick", "ggx, Fresnel", "ggx, round"])
def test_ggx_is_reciprocal_and_creates_no_energy(name):
    rho = BRDFS[name]
    np.testing.assert_allclose(rho(0.3, -0.8), rho(-0.8, 0.3), rtol=1e-14)
    w = np.linspace(-QUARTER, QUARTER, 20001)[1:-1]
    for o in (0.0, 0.9, 1.5):
        assert np.trapezoid(np.asarray(rho(w, o)) * np.cos(w), w) < 1.0


@eqx.filter_jit
def derivatives(rho, w, o):
    return jax.vmap(rho.derivatives)(w, o)


@pytest.mark.parametrize("name", BRDFS)
def test_derivatives_are_in_the_outgoing_angle(name):
    rho = BRDFS[name]
    w, o = jnp.array([0.3, -1.1, 0.9]), jnp.array([0.2, 0.7, -1.3])

    def both(a, b):
        return jax.jvp(lambda b: rho.derivatives(a, b)[:2], (b,), (jnp.ones_like(b),))

    (_, d), (slope, bend) = jax.jit(jax.vmap(both))(w, o)
    np.testing.assert_allclose(d, slope, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(derivatives(rho, w, o)[2], bend, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", BRDFS)
def test_nothing_is_nan_at_grazing_angles(name):
    rho = BRDFS[name]
    angles = jnp.array([-2.0, -QUARTER, -QUARTER + 1e-12, 0.0, QUARTER - 1e-9, QUARTER, 2.0])
    w, o = (a.ravel() for a in jnp.meshgrid(angles, angles))
    for found in derivatives(rho, w, o):
        assert not np.any(np.isnan(found))


def test_a_lobe_in_local_angles():
    n, theta, omega = 0.4, 0.9, 0.6
    for lobe in glossy(0.3), retro(0.3):
        a = lobe.argument
        t = a.turn * n + a.look * theta - omega
        want = lobe.kernel.derivatives(jnp.asarray(t))[0]
        np.testing.assert_allclose(LobeBrdf(lobe)(omega - n, theta - n), want, rtol=1e-12)
    assert lambert().argument.look == 0.0


def test_a_table_is_met_at_its_nodes_and_exact_for_cubics():
    values = np.outer(1.0 + H**3, 2.0 - H**2)
    rho = TabulatedBrdf(values)
    np.testing.assert_allclose(rho(H[:, None], H), values, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(rho.peaks(jnp.asarray(0.2)), H[1:-1], 1e-15, 1e-15)
    np.testing.assert_allclose(rho(0.33, -1.21), (1.0 + 0.33**3) * (2.0 - 1.21**2), rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Ggx(0.0), "Argument `roughness` must be positive, but is 0.0."),
        (lambda: TabulatedBrdf(np.ones((3, 5))), "Argument `values` must be a table of four"),
        (lambda: TabulatedBrdf(np.full((5, 5), np.nan)), "Argument `values` must be finite"),
    ],
)
def test_bad_brdfs_are_refused_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def test_a_kernel_alone_is_no_lobe():
    words = "^Argument `lobe` must be a lobe, as `glossy` makes one, but is a G|parameter|type hint"
    with pytest.raises(TypeError, match=words):
        LobeBrdf(GaussianProfile(0.1))


@pytest.mark.parametrize("proof", derived.PROOFS, ids=lambda p: p.__name__)
def test_the_formulas_follow_from_their_integrals(proof):
    assert all(sp.simplify(e) == 0 for e in proof())


def test_a_lobe_reflects_nothing_below_the_horizon():
    rho = LobeBrdf(glossy(0.3))
    assert [float(rho(w, o)) for w, o in ((1.5, -1.6), (1.6, -1.5), (-1.9, 1.9))] == [0.0] * 3
    assert rho(1.5, -1.5) > 0.0


def test_a_traced_roughness_that_is_none_gives_nan():
    look = jax.jit(lambda roughness: Ggx(roughness)(0.1, -0.3))
    assert np.isnan(look(-0.35))
    assert np.isnan(look(0.0))
    assert look(0.35) == pytest.approx(ggx(0.1, -0.3, 0.35), rel=1e-12)
