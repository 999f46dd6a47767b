import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad

from derivations.transport.shading import _shading as setup
from derivations.transport.shading import surface as derived
from derivations.transport.shading._shading import LIGHT, NORMAL, RAYS, bell, bent, normal
from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.errors import Refused
from firstorder.fields import Affine, Constant, GaussianProfile, autodiff_jet, gaussian, half_plane
from firstorder.laws import Integrate, Map, Move, Multiply, Warp
from firstorder.transport import Blend, Bump, Mirror, Reflection
from firstorder.transport.brdf.general import Ggx, LobeBrdf, TabulatedBrdf
from firstorder.transport.brdf.lobes import (
    RETRO,
    Lobe,
    TabulatedProfile,
    glossy,
    lambert,
    phong,
    retro,
)
from firstorder.transport.events.interface import Schlick
from firstorder.transport.events.slopes import ToAngle
from firstorder.transport.events.texture import wave
from firstorder.transport.events.travel import Travel
from firstorder.transport.shading._flat_jets import FlatlandLight
from firstorder.transport.shading.surface import ReflectedField, Surface, far_light_ratio

QUARTER = 0.5 * np.pi
H = np.linspace(-QUARTER, QUARTER, 9)
TABLE = np.exp(-0.5 * ((np.arange(21) - 10) * 0.1 / 0.25 - 0.3) ** 2)
MATERIALS = {
    "lobes": (
        glossy(0.2, 0.4),
        phong(6.5),
        lambert(0.7),
        retro(0.3),
        Lobe(TabulatedProfile(TABLE, 0.1)),
    ),
    "weights that vary": (
        setup.VARYING,
        glossy(0.3, cosine=True),
        Lobe(GaussianProfile(0.4), RETRO, True),
    ),
    "general": (Ggx(0.3, Schlick(0.05)), TabulatedBrdf(1.0 + np.cos(H[:, None]) * np.cos(2 * H))),
}
PAINT = wave(0.3, 0.4, mean=0.6)
PARTS = ("value", "gradient", "hessian")


def slopes(B, rays=RAYS):
    """Entries, and the same by autodiff: of the value, and of the closed gradient."""

    def one(u):
        def first(u):
            e, value = B.entries(u[0], u[1]), B.at(u)
            return jnp.stack([value, e.x, e.theta]), (e, value)

        J, (e, value) = jax.jacfwd(first, has_aux=True)(u)
        return e, type(e)(value, *J[0], J[1, 0], J[1, 1], J[2, 1]), J[2, 0]

    closed, truth, mixed = jax.jit(jax.vmap(one))(jnp.asarray(rays))
    np.testing.assert_allclose(mixed, closed.x_theta, rtol=1e-8, atol=1e-9)
    return closed, truth


def error(closed, truth):
    """Largest normwise error of value, gradient and Hessian."""
    groups = (slice(0, 1), slice(1, 3), slice(3, 6))
    return max(normwise(np.stack(closed[g]), np.stack(truth[g])) for g in groups)


@eqx.filter_jit
def entries_of(B, ray):
    return B.entries(*ray)


def jets_of(*fields):
    """Jets of several fields at `RAYS`."""
    return jax.jit(jax.vmap(lambda u: [f.jet(u) for f in fields]))(jnp.asarray(RAYS))


@pytest.mark.smoke
@pytest.mark.parametrize("name", MATERIALS)
def test_closed_forms_are_the_derivatives(name):
    B = Surface(NORMAL, MATERIALS[name], PAINT).reflect(LIGHT, nodes=48)
    closed, truth = slopes(B)
    assert error(closed, truth) < 1e-10
    terms = jax.jit(lambda x, t: B.terms(x, t))(*RAYS.T)
    np.testing.assert_allclose(
        sum(t.SV + t.CDV + t.MV for t in terms), closed.x, rtol=0.0, atol=1e-12
    )


def by_quadrature(weight, ends):
    """B by adaptive quadrature over the global direction."""

    def one(x, t):
        close = {"epsabs": 1e-13, "epsrel": 1e-13, "limit": 400}
        return quad(lambda w: bell(x, w) * weight(x, t, w), *ends(x, t), **close)[0]

    return [one(x, t) for x, t in RAYS]


def mirror_lobe(p):
    return lambda x, t, w: p(2.0 * normal(x) - t - w)


def gauss(t, s=0.2):
    return np.exp(-0.5 * (t / s) ** 2) / (s * np.sqrt(2.0 * np.pi))


def sphere(x, t):
    """The hemisphere above a point."""
    return normal(x) - QUARTER, normal(x) + QUARTER


def far(x, t):
    return -4.0, 4.0


TRUTHS = {
    "glossy": (glossy(0.2), mirror_lobe(gauss), far),
    "diffuse": (lambert(0.8), lambda x, t, w: 0.4 * np.cos(w - normal(x)), sphere),
    "retro": (retro(0.3), lambda x, t, w: gauss(t - w, 0.3), far),
    "wide, with cosine": (
        glossy(0.6, cosine=True),
        lambda x, t, w: gauss(2.0 * normal(x) - t - w, 0.6) * np.cos(w - normal(x)),
        sphere,
    ),
}


@pytest.mark.parametrize("name", TRUTHS)
def test_values_are_integrals_over_directions(name):
    r, weight, ends = TRUTHS[name]
    B = Surface(NORMAL, (r,)).reflect(LIGHT, nodes=96)
    found = jax.jit(lambda x, t: B(x, t))(*RAYS.T)
    np.testing.assert_allclose(found, by_quadrature(weight, ends), rtol=1e-10)


def test_it_is_the_chain_of_four_events():
    """Rotate, mirror, convolve, rotate back (R07 22), for an even lobe."""
    path = LIGHT >> Bump(NORMAL) >> Mirror() >> Reflection(GaussianProfile(0.2))
    chain = (path >> Bump(NORMAL, back=True)).light
    B = Surface(NORMAL, (glossy(0.2),)).reflect(LIGHT)
    ours, theirs = jets_of(B, chain)
    for part in PARTS:
        assert normwise(getattr(ours, part), getattr(theirs, part)) < 1e-10, part


def test_a_general_brdf_equals_the_convolution():
    """Rays for which the horizon does not cut the lobe, and one for which it does."""
    rays = np.vstack([RAYS, [[0.1, 1.2]]])
    lobe = glossy(0.25, cosine=True)
    one = Surface(NORMAL, (lobe,)).reflect(LIGHT, nodes=96)
    other = Surface(NORMAL, (LobeBrdf(lobe),)).reflect(LIGHT, nodes=64)
    ours, theirs = jax.jit(jax.vmap(lambda u: (one.jet(u), other.jet(u))))(rays)
    for part in PARTS:
        assert normwise(getattr(ours, part), getattr(theirs, part)) < 1e-10, part


def test_a_constant_brdf_is_diffuse():
    white = Surface(NORMAL, (TabulatedBrdf(np.full((4, 4), 0.4)),)).reflect(LIGHT)
    matte = Surface(NORMAL, (lambert(0.8),)).reflect(LIGHT)
    a, b = jets_of(white, matte)
    for part in PARTS:
        assert normwise(getattr(a, part), getattr(b, part)) < 1e-10, part


# --- horizons and edges -------------------------------------------------------------------------

GRAZING = jnp.array([[0.1, 1.2], [0.3, -1.3]])


def test_the_horizon_has_its_end_term():
    B = Surface(NORMAL, (glossy(0.4, cosine=True),)).reflect(LIGHT, nodes=96)
    r, u = B.surface.reflectance[0], GRAZING[0]
    n = B.surface.normal_at(u[0])
    term = B._horizons(r, n, u[0], u[1])
    assert abs(term.theta_theta) > 1e-3  # it matters here
    assert error(*slopes(B, GRAZING)) < 1e-10


EDGE, BELOW, ABOVE = 0.35, 0.2, 1.0
CUT = Multiply(half_plane(EDGE, BELOW, ABOVE, "theta"))(LIGHT)
W, WEIGHTS = np.polynomial.legendre.leggauss(120)


def cut(weight, ends):
    """B by two pieces that stop at the edge, in NumPy: entire in x and theta."""

    def value(x, t):
        total = 0.0
        for a, b, shade in ((ends(x)[0], EDGE, BELOW), (EDGE, ends(x)[1], ABOVE)):
            w = 0.5 * (a + b) + 0.5 * (b - a) * W
            total += shade * 0.5 * (b - a) * np.sum(WEIGHTS * bell(x, w) * weight(x, t, w))
        return total

    return value


EDGES = {
    "glossy": (
        glossy(0.2),
        lambda x, t, w: gauss(2.0 * normal(x) - t - w),
        lambda x: (-2.2, 2.2),
    ),
    "diffuse": (
        lambert(0.8),
        lambda x, t, w: 0.4 * np.cos(w - normal(x)),
        lambda x: (normal(x) - QUARTER, normal(x) + QUARTER),
    ),
    "table": (
        TabulatedBrdf(np.full((4, 4), 0.4)),
        lambda x, t, w: 0.4 * np.cos(w - normal(x)),
        lambda x: (normal(x) - QUARTER, normal(x) + QUARTER),
    ),
}


@pytest.mark.parametrize("name", EDGES)
def test_edges_in_the_light_are_split_and_have_boundary_terms(name):
    r, weight, ends = EDGES[name]
    B, truth = Surface(NORMAL, (r,)).reflect(CUT, nodes=80), cut(weight, ends)
    (found,) = jets_of(B)
    for part, by in (
        ("value", truth),
        ("gradient", lambda x, t: setup.complex_step(truth, x, t)),
        ("hessian", lambda x, t: setup.differences(truth, x, t)),
    ):
        brute = np.array([by(x, t) for x, t in RAYS])
        assert normwise(getattr(found, part), brute) < 1e-9, part


FAR = {
    "ggx": Ggx(0.01),
    "glossy": LobeBrdf(glossy(0.01)),
    "table": Lobe(TabulatedProfile(TABLE, 0.1, center=0.03)),
}


@pytest.mark.parametrize("name", FAR)
def test_an_edge_far_outside_equals_no_edge(name):
    """It plays no part, but takes another path."""
    surface = Surface(Affine([0.1, 0.0], 0.05), (FAR[name],))
    edge = -1.5 if name != "table" else -4.0
    lit = Multiply(half_plane(edge, 1.0, 1.0, "theta"))(LIGHT)  # the two sides are alike
    dark = Multiply(half_plane(-4.0, 0.0, 1.0, "theta"))(LIGHT)
    rays = jnp.asarray(RAYS)
    one, *others = jax.jit(
        jax.vmap(lambda u: [surface.reflect(light).jet(u) for light in (LIGHT, lit, dark)])
    )(rays)
    values = jax.jit(jax.vmap(surface.reflect(lit).at))(rays)
    np.testing.assert_allclose(values, one.value, rtol=1e-10)
    for other in others:
        for part in PARTS:
            assert normwise(getattr(other, part), getattr(one, part)) < 1e-10, part


SLANTED = gaussian((0.1, -0.2), (0.6, 1.5), frame=FLATLAND_SLOPE)
ABOVE_THE_LINE = {
    "glossy": (glossy(0.2), lambda x, t, w: gauss(2.0 * normal(x) - t - w)),
    "diffuse": (lambert(0.5), lambda x, t, w: 0.25 * max(np.cos(w - normal(x)), 0.0)),
    "with cosine": (
        glossy(0.4, cosine=True),
        lambda x, t, w: gauss(2.0 * normal(x) - t - w, 0.4) * max(np.cos(w - normal(x)), 0.0),
    ),
}


@pytest.mark.parametrize("name", ABOVE_THE_LINE)
def test_light_through_slopes_is_reflected_above_the_line(name):
    r, weight = ABOVE_THE_LINE[name]
    light = (SLANTED >> ToAngle() >> Travel(0.5)).light
    B = Surface(NORMAL, (r,)).reflect(light, nodes=120, above=True)
    rays = np.array([[0.3, 0.1], [-0.2, 0.9]])  # the second lobe reaches below the line

    def shone(x, w):
        v = np.tan(w)
        return np.exp(-0.5 * (((x - 0.5 * v - 0.1) / 0.6) ** 2 + ((v + 0.2) / 1.5) ** 2))

    def brute(x, t):
        breaks = sorted({e for h in (-QUARTER, QUARTER) if abs(e := normal(x) + h) < QUARTER})
        close = {"epsabs": 1e-13, "epsrel": 1e-13, "limit": 400}
        points = sorted({*breaks, float(np.clip(2 * normal(x) - t, -1.5, 1.5))})
        return quad(
            lambda w: shone(x, w) * weight(x, t, w), -QUARTER, QUARTER, points=points, **close
        )[0]

    found = jax.jit(jax.vmap(B.jet))(jnp.asarray(rays))
    np.testing.assert_allclose(found.value, [brute(x, t) for x, t in rays], rtol=1e-9)
    assert error(*slopes(B, rays)) < 1e-9


def test_terms_under_edges_add_up_too():
    B = Surface(NORMAL, (glossy(0.2),), PAINT).reflect(CUT)
    (terms,), gradient = jax.jit(lambda x, t: (B.terms(x, t), B.jets(x, t).gradient))(*RAYS.T)
    np.testing.assert_allclose(terms.SV + terms.CDV + terms.MV, gradient[:, 0], rtol=1e-10)
    with pytest.raises(Refused, match="homogeneous lobe without cosine"):
        Surface(NORMAL, (Ggx(0.3),)).reflect(CUT).terms(0.1, 0.2)


# --- attacks --------------------------------------------------------------------------------------


def test_rigid_rotation_changes_nothing():
    """Turn light, normal and view by one angle."""
    turn, materials = 0.37, (glossy(0.2), lambert(), retro(0.3), LobeBrdf(glossy(0.4)))
    other = gaussian((0.21, -0.13 + turn), (0.55, 0.4), 0.35, 1.3)
    B = Surface(NORMAL, materials).reflect(LIGHT)
    turned = Surface(NORMAL + Constant(turn), materials).reflect(other)
    a, b = jax.jit(
        jax.vmap(lambda u: (B.jet(u), turned.jet(u + jnp.array([0.0, turn]))))
    )(RAYS)  # fmt: skip
    for part in PARTS:
        assert normwise(getattr(a, part), getattr(b, part)) < 1e-10, part


def test_units_of_length_scale_derivatives():
    s = 3.0
    long = gaussian((0.21 * s, -0.13), (0.55 * s, 0.4), 0.35, 1.3)
    B = Surface(Affine([0.3, 0.0], 0.05), (glossy(0.2),)).reflect(LIGHT)
    C = Surface(Affine([0.3 / s, 0.0], 0.05), (glossy(0.2),)).reflect(long)
    e, f = entries_of(B, np.array([0.3, 0.1])), entries_of(C, np.array([0.3 * s, 0.1]))
    scale = (1.0, s, 1.0, s * s, s, 1.0)
    np.testing.assert_allclose([a * b for a, b in zip(f, scale, strict=True)], e, rtol=1e-12)


def test_a_sharp_lobe_is_a_mirror():
    x, theta = jnp.array([0.3, 0.1])
    B = Surface(NORMAL, (glossy(1e-4),)).reflect(LIGHT)
    B = entries_of(B, np.array([x, theta]))
    n = Surface(NORMAL, (glossy(1e-4),)).normal_at(x)
    j = LIGHT.jet(jnp.stack([x, 2.0 * n.value - theta]))
    mirror = (
        j.value,
        j.gradient[0] + 2 * n.x * j.gradient[1],
        -j.gradient[1],
    )
    np.testing.assert_allclose(B[:3], mirror, rtol=1e-6)


def test_a_flat_surface_in_distant_light_is_uniform():
    L = FlatlandLight(lambda x, w: jnp.exp(-(w**2)) + 0.0 * x, setup.distant_entries)
    B = Surface(Constant(0.2), (glossy(0.2), lambert(), Ggx(0.4))).reflect(L)
    e = jax.jit(lambda x, t: B.entries(x, t))(*jnp.array([0.3, 0.1]))
    assert max(abs(e.x), abs(e.xx), abs(e.x_theta)) < 1e-15


def test_a_light_that_is_far_for_a_bump_is_near_for_a_floor():
    assert far_light_ratio(5.0, 0.2, 20.0) < 0.01 < 1.0 < far_light_ratio(5.0, 0.2, 0.05)
    np.testing.assert_allclose(far_light_ratio(2.0, 0.0, 0.25, turn=1.0), 2.0)
    assert np.isinf(far_light_ratio(2.0, 0.0, 0.0))


def test_a_valley_focused_on_the_source_does_not_vary():
    """SV and CDV cancel for n_x = cos(w)^2 / (2 d)."""
    d, w = 2.0, 0.4

    def L(x, w):
        return jnp.sin(x - d * jnp.tan(w))

    light = FlatlandLight(L, lambda x, w: _entries(L, x, w))
    k = np.cos(w) ** 2 / (2.0 * d)
    valley = Surface(Affine([k, 0.0], 0.0), (glossy(1e-5),)).reflect(light)
    (terms,) = jax.jit(lambda x, t: valley.terms(x, t))(0.0, -w)
    assert abs(terms.SV + terms.CDV) < 1e-8 * abs(terms.SV)


def _entries(f, x, w):
    j = autodiff_jet(lambda u: f(u[0], u[1]), jnp.stack([x, w]), LIGHT.frame)
    (a, b), (c, d) = j.hessian
    del c
    return j.value, j.gradient[0], j.gradient[1], a, b, d


def test_both_proofs_without_a_number_hold():
    for proof in derived.UNNUMBERED:
        assert [sp.simplify(e) for e in proof()] == [0] * len(proof())


# --- faults ---------------------------------------------------------------------------------------

# One-line wrong twins of what is printed, made from the convolved jet of the light and the normal
# (n, k, kk), and compared with complex steps of a dense sum.
WRONG = {
    "gradient": {
        "forget the 2": lambda C, k, kk: [C[1, 0] + k * C[0, 1], -C[0, 1]],
        "flip DV": lambda C, k, kk: [C[1, 0] + 2 * k * C[0, 1], C[0, 1]],
        "flip the curvature": lambda C, k, kk: [C[1, 0] - 2 * k * C[0, 1], -C[0, 1]],
        "forget SV": lambda C, k, kk: [2 * k * C[0, 1], -C[0, 1]],
        "rows for columns": lambda C, k, kk: [-C[0, 1], C[1, 0] + 2 * k * C[0, 1]],
    },
    "hessian": {
        "drop n_xx": lambda C, k, kk: _hessian(C, k, 0.0),
        "2 for the mixed 4": lambda C, k, kk: _hessian(C, k, kk, mixed=2.0),
        "2 for the square's 4": lambda C, k, kk: _hessian(C, k, kk, square=2.0),
        "flip B_xtheta": lambda C, k, kk: _hessian(C, k, kk) * np.array([[1, -1], [-1, 1]]),
        "flip B_thetatheta": lambda C, k, kk: _hessian(C, k, kk) * np.array([[1, 1], [1, -1]]),
    },
}


def _hessian(C, k, kk, mixed=4.0, square=4.0):
    xx = C[2, 0] + mixed * k * C[1, 1] + square * k**2 * C[0, 2] + 2 * kk * C[0, 1]
    xt = -C[1, 1] - 2 * k * C[0, 2]
    return np.array([[xx, xt], [xt, C[0, 2]]])


def _by_frequencies(part, formula):
    """Error of a formula whose convolutions are made by frequencies."""
    errors = []
    for x, theta in RAYS:
        n, k, kk = bent(x)
        orders = [(i, j) for i in range(3) for j in range(3 - i)]
        C = {ij: setup.convolved(x, 2.0 * n - theta, *ij) for ij in orders}
        truth = setup.complex_step if part == "gradient" else setup.differences
        errors.append(normwise(np.array(formula(C, k, kk)), truth(setup.dense, x, theta)))
    return max(errors)


def test_the_printed_formulas_pass_where_their_faults_fail():
    assert (
        _by_frequencies("gradient", lambda C, k, kk: [C[1, 0] + 2 * k * C[0, 1], -C[0, 1]]) < 1e-9
    )
    assert _by_frequencies("hessian", lambda C, k, kk: _hessian(C, k, kk)) < 1e-8


@pytest.mark.parametrize(("part", "fault"), [(p, f) for p in WRONG for f in WRONG[p]])
def test_a_fault_in_a_printed_formula_is_seen(part, fault):
    assert _by_frequencies(part, WRONG[part][fault]) > 1e-3


class _Sly(ReflectedField):
    """A reflected field in which one piece can be left out."""

    def _painted(self, x):
        return super()._painted(x)._replace(x=0.0 * x, xx=0.0 * x)


class _NoHorizon(ReflectedField):
    def _horizons(self, r, n, x, theta):
        return super()._horizons(r, n, x, theta).scaled(0.0)


def _twin(kind, material, texture=None, light=LIGHT):
    return kind(light, Surface(NORMAL, (material,), texture), 64)


TWINS = {
    "forget the texture term": lambda: (_twin(_Sly, glossy(0.2), PAINT), RAYS),
    "forget the horizon's end term": lambda: (_twin(_NoHorizon, glossy(0.4, cosine=True)), GRAZING),
    "a diffuse lobe in the mirror's argument": lambda: (_Wrong(lambert(), glossy(0.2)), RAYS),
    "a cosine that stands still": lambda: (_Wrong(glossy(0.3, cosine=True), glossy(0.3)), RAYS),
    "forget rho_x": lambda: (_Wrong(setup.VARYING, glossy(0.3)), RAYS),
    "a BRDF that forgets its turn": lambda: (_Wrong(Ggx(0.3), lambert()), RAYS),
}


class _Wrong:
    """The value of one material with the jets of another, scaled to it."""

    def __init__(self, true, jets):
        self.at = Surface(NORMAL, (true,)).reflect(LIGHT).at
        self.other = Surface(NORMAL, (jets,)).reflect(LIGHT)
        self.frame = self.other.frame

    def jet(self, u):
        j = self.other.jet(u)
        return j.scaled(self.at(u) / j.value)


@pytest.mark.parametrize("fault", TWINS)
def test_a_fault_in_a_term_is_seen(fault):
    B, rays = TWINS[fault]()
    closed, truth = jax.jit(
        jax.vmap(lambda u: (B.jet(u).hessian, jax.jacfwd(jax.jacfwd(B.at))(u)))
    )(jnp.asarray(rays))  # fmt: skip
    assert normwise(closed, truth) > 1e-3


# --- manners --------------------------------------------------------------------------------------


def test_many_rays_go_in_blocks():
    B = Surface(NORMAL, (glossy(0.2),)).reflect(LIGHT)
    x, theta = np.linspace(-0.5, 0.5, 11), np.linspace(0.3, -0.2, 11)
    blocks = B.over(jnp.asarray(x), jnp.asarray(theta), block=4)
    np.testing.assert_allclose(blocks.xx, B.jets(x, theta).hessian[:, 0, 0], rtol=1e-12)


def test_single_precision_stays_single():
    B = Surface(NORMAL, (glossy(0.2), phong(5.0), lambert())).reflect(LIGHT)
    single = jax.tree.map(lambda a: a.astype(jnp.float32), B)
    e = entries_of(single, np.array([0.3, 0.1], np.float32))
    assert {a.dtype for a in e} == {jnp.dtype("float32")}
    np.testing.assert_allclose(e, entries_of(B, np.array([0.3, 0.1])), rtol=1e-4)


def test_materials_have_derivatives():
    def value(sigma):
        return Surface(NORMAL, (glossy(sigma),)).reflect(LIGHT)(0.3, 0.1)

    slope, h = jax.grad(value)(0.2), 1e-5
    np.testing.assert_allclose(slope, (value(0.2 + h) - value(0.2 - h)) / (2 * h), rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Surface(NORMAL, ()), "Argument `reflectance` must hold at least one lobe"),
        (
            lambda: Surface(NORMAL, (glossy(0.1),)).reflect(
                gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
            ),
            "Argument `light` must be incoming",
        ),
        (
            lambda: Surface(NORMAL, (glossy(0.1),)).reflect(LIGHT, nodes=0),
            "Argument `nodes` must be a positive integer",
        ),
        (lambda: far_light_ratio(0.0, 0.0, 1.0), "Argument `D` must be positive"),
    ],
)
def test_bad_surfaces_are_refused_in_one_sentence(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def test_a_blend_of_lobes_reflects_as_they_do_one_by_one():
    """However narrow one is beside the other: value, Hessian and the terms of the derivative."""
    lobes, half = (GaussianProfile(0.02), GaussianProfile(0.5)), Constant(0.5)
    both = Surface(NORMAL, Lobe(Blend(lobes, (half, half)))).reflect(LIGHT)
    each = Surface(NORMAL, tuple(Lobe(Blend((p,), (half,))) for p in lobes)).reflect(LIGHT)
    alone = Surface(NORMAL, tuple(glossy(p.sigma, 0.5) for p in lobes)).reflect(LIGHT)
    together, one_by_one, truth = jets_of(both, each, alone)
    np.testing.assert_allclose(together.hessian, one_by_one.hessian, rtol=1e-12)
    np.testing.assert_allclose(together.hessian, truth.hessian, rtol=1e-9)
    (terms,), separate = jax.jit(lambda *ray: (both.terms(*ray), each.terms(*ray)))(0.2, 0.1)
    np.testing.assert_allclose(terms.CDV, sum(t.CDV for t in separate), rtol=1e-12)
    assert terms.CV == separate[0].CV


def test_the_edges_of_materials_and_of_shadows_on_the_surface_are_edges_of_what_it_reflects():
    left, right = half_plane(0.2, 1.0, 0.0), half_plane(0.2)
    blend = Lobe(Blend((GaussianProfile(0.1), GaussianProfile(0.5)), (left, right)))
    shadow, paint = Multiply(half_plane(0.1))(LIGHT), half_plane(-0.3, 0.2, 1.0)
    B = Surface(NORMAL, (blend, glossy(0.2), lambert(0.5)), paint).reflect(shadow)
    places = sorted({-float(e.level.offset) for e in B.edges()})
    assert places == [-0.3, 0.1, 0.2]
    for place in places:
        here = [e for e in B.edges() if -float(e.level.offset) == place]
        jump = B(place + 1e-9, 0.1) - B(place - 1e-9, 0.1)
        np.testing.assert_allclose(sum(e.jump(place, 0.1) for e in here), jump, rtol=0.0, atol=1e-7)


class Squared(Map):
    """`(x^2, theta)`."""

    def __call__(self, u):
        return jnp.stack([u[0] ** 2, u[1]])


def test_an_edge_that_bends_and_ignores_the_direction_is_one_of_the_reflected_light():
    """It stands at x = 1/2, a bent level of x alone; the midpoint rule does not know it."""
    shadow = Multiply(Warp(Squared())(half_plane(0.25, 0.2, 1.0)))(LIGHT)
    B = Surface(NORMAL, glossy(0.2)).reflect(shadow)
    pixel = Integrate("x", 0.1, 1.3)
    ends = np.concatenate([np.linspace(0.1, 0.5, 2001), np.linspace(0.5, 1.3, 2001)])
    places = np.delete(0.5 * (ends[1:] + ends[:-1]), 2000)
    widths = np.delete(np.diff(ends), 2000)
    assert len(B.edges()) == 1
    np.testing.assert_allclose(pixel(B)(0.1), np.sum(widths * B(places, 0.1)), rtol=1e-6)
    at = jnp.array([0.1])
    traced = jax.jit(lambda light: pixel(Surface(NORMAL, glossy(0.2)).reflect(light)).at(at))
    np.testing.assert_allclose(traced(shadow), pixel(B).at(at), rtol=1e-12)


def test_edges_of_light_that_turn_with_the_place_are_smoothed_away():
    shadow = Multiply(Warp(Squared())(Move([[1.0, 1.0], [0.0, 1.0]])(half_plane(0.25))))(LIGHT)
    assert shadow.edges()
    assert not Surface(NORMAL, glossy(0.2)).reflect(shadow).edges()


def test_a_pixel_over_a_painted_surface_sees_the_paint_move():
    """Its derivative has the paint's edge in it, against the mean of many points."""
    B = Surface(NORMAL, glossy(0.2), half_plane(0.3, 0.2, 1.0)).reflect(LIGHT)
    seen = Move([[1.0, 0.5], [0.0, 1.0]])(B)
    pixel = Integrate("x", -1.0, 1.0)(seen)
    ends = np.linspace(-1.0, 1.0, 20001)
    x, v = 0.5 * (ends[1:] + ends[:-1]), np.array([[0.101], [0.099]])
    sums = 2.0 * jnp.mean(seen(x, v), axis=1)
    np.testing.assert_allclose(pixel.jets(0.1).gradient[0], (sums[0] - sums[1]) / 0.002, rtol=0.01)


def test_a_traced_distance_that_is_none_gives_nan():
    look = jax.jit(lambda D: far_light_ratio(D, 0.3, -0.25))
    assert np.isnan(look(-2.0))
    assert np.isnan(look(0.0))
    assert look(2.0) == pytest.approx(np.cos(0.3))


def test_a_crease_of_the_surface_is_an_edge_of_what_it_reflects():
    """And the derivative by its place has the edge's own term."""

    def pixel(place):
        B = Surface(half_plane(place, -0.2, 0.3), glossy(0.2)).reflect(LIGHT)
        return Integrate("x", -1.0, 1.0)(B).at(jnp.array([0.1]))

    (edge,) = Surface(half_plane(0.2, -0.2, 0.3), glossy(0.2)).reflect(LIGHT).edges()
    low, high = (Surface(n, glossy(0.2)).reflect(LIGHT)(0.2, 0.1) for n in (-0.2, 0.3))
    np.testing.assert_allclose(edge.jump(0.2, 0.1), high - low, rtol=1e-10)
    np.testing.assert_allclose(jax.jit(jax.grad(pixel))(0.2), low - high, rtol=1e-10)


def test_terms_and_entries_at_whole_numbers():
    B = Surface(Affine([0.5, 0.0], 0.0), glossy(0.2)).reflect(gaussian((0.0, 0.1), (1.0, 0.4)))
    one, zero = jnp.array([1]), jnp.array([0])
    for ours, truth in (
        (B.terms(1, 0), B.terms(1.0, 0.0)),
        (B.over(one, zero), B.over(one * 1.0, zero * 1.0)),
    ):
        for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(truth), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-12)
