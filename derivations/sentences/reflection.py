"""R07 §3 to §5 in words: determinants, general BRDFs, frames, shadows, space, distance."""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.transport.shading._shading import (
    CLOSED,
    LIGHT,
    MODULE,
    NORMAL,
    RAYS,
    autodiff,
    bell,
    bent,
    brute,
    complex_step,
    derivatives,
    flatless,
    gauss,
    lt,
    lx,
    n1,
    near,
    normal,
    r0,
    reflected,
    slope_w,
    slope_x,
)
from firstorder.checks.tolerance import normwise
from firstorder.fields import gaussian, half_plane
from firstorder.laws import Move, Multiply
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.transport.brdf.general import Ggx
from firstorder.transport.brdf.lobes import glossy
from firstorder.transport.shading.surface import Surface, far_light_ratio

# --- Fig. 2: the determinant ---------------------------------------------------------------------

FLIP = np.array([[0.8, 0.3], [0.2, -1.1]])  # of negative determinant


def flipped_bell():
    """`int f(-k u) exp(-2 pi i W u) du` for f(u) = exp(-pi u^2): an even f, k > 0."""
    u, W = sp.symbols("u Omega", real=True)
    k = sp.Symbol("k", positive=True)
    f = sp.exp(-sp.pi * (-k * u) ** 2)
    F = sp.integrate(f * sp.cos(2 * sp.pi * W * u), (u, -sp.oo, sp.oo))
    return sp.simplify(F - sp.exp(-sp.pi * (W / k) ** 2) / k)


def _bell(u):
    d = (u - np.array([0.1, -0.2])) / np.array([0.5, 0.7])
    return np.exp(-0.5 * np.sum(d**2, -1))


def summed_transform(Omega_x, Omega_theta):
    """Real part of the transform of a bell seen through the flip, by a trapezoid sum."""
    axis = np.linspace(-8.0, 8.0, 321)
    u = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)
    wave = np.exp(-2j * np.pi * (u @ np.array([Omega_x, Omega_theta])))
    return float(np.real(np.sum(_bell(u @ FLIP.T) * wave)) * (axis[1] - axis[0]) ** 2)


def without_modulus(Omega_x, Omega_theta):
    """F(M^-T Omega) / det M, with the bell's transform by hand."""
    W = np.linalg.solve(FLIP.T, [Omega_x, Omega_theta])
    size = 2.0 * np.pi * 0.35 * np.exp(-2.0 * np.sum((np.pi * np.array([0.5, 0.7]) * W) ** 2))
    return float(size * np.cos(2.0 * np.pi * W @ [0.1, -0.2]) / np.linalg.det(FLIP))


FREQUENCIES = ((0.2, 0.1), (0.0, 0.0), (-0.3, 0.4))


def moved_spectrum() -> float:
    """The library's spectrum of that bell against the sum."""
    F = Move(FLIP)(gaussian((0.1, -0.2), (0.5, 0.7))).spectrum()
    found = [float(jnp.real(F(*W))) for W in FREQUENCIES]
    return normwise(np.array(found), np.array([summed_transform(*W) for W in FREQUENCIES]))


# --- step 3: any BRDF ----------------------------------------------------------------------------


def general_integral():
    """`L rho_theta` beside `L_w rho`: apart by an end term and by `L (rho_w + rho_theta)`.

    The last is zero for a function of w - theta.
    """
    w, theta = sp.symbols("omega theta", real=True)
    L, rho = sp.Function("L")(w), sp.Function("rho")(w, theta)
    apart = L * rho.diff(theta) - L.diff(w) * rho
    difference = sp.Function("f")(w - theta)
    return [
        sp.simplify(apart + (L * rho).diff(w) - L * (rho.diff(w) + rho.diff(theta))),
        sp.simplify((difference.diff(w) + difference.diff(theta)).doit()),
    ]


ROUGHNESS = 0.4


def _facets(w, o):
    """GGX in flatland times the cosine, as its derivation has it."""
    s = ROUGHNESS**2
    h, d = 0.5 * (w + o), 0.5 * (w - o)
    D = 0.5 * s / (s * np.cos(h) ** 2 + np.sin(h) ** 2) ** 1.5
    aw, ao = (np.sqrt(np.cos(t) ** 2 + s * np.sin(t) ** 2) for t in (w, o))
    return D * np.cos(d) / (aw * np.cos(o) + ao * np.cos(w)) * np.cos(w)


def _nodes():
    t, weights = np.polynomial.legendre.leggauss(240)
    return 0.5 * np.pi * t, 0.5 * np.pi * weights


def rough(x, theta):
    """B of a flat patch of facets."""
    w, weights = _nodes()
    return np.sum(weights * bell(x, w) * _facets(w, theta))


def printed_slope(x, theta):
    """The mirrored light's own derivative under the integral, read back at the light's angle."""
    w, weights = _nodes()
    return float(-np.sum(weights * slope_w(bell, x, w) * _facets(w, theta)))


def true_slope(x, theta):
    return float(complex_step(rough, x, theta)[1])


@functools.cache
def _rough_gradients():
    B = Surface(0.0, (Ggx(ROUGHNESS),)).reflect(LIGHT, nodes=96)
    rays = jnp.asarray(RAYS)
    closed = jax.jit(jax.vmap(lambda u: B.jet(u).gradient))(rays)
    by_autodiff = jax.jit(jax.vmap(jax.grad(B.at)))(rays)
    return np.asarray(closed), np.asarray(by_autodiff)


def rough_gradient(route) -> float:
    closed, by_autodiff = _rough_gradients()
    if route == "autodiff":
        return normwise(closed, by_autodiff)
    return normwise(closed, np.array([complex_step(rough, *ray) for ray in RAYS]))


# --- the frame of the incident light -------------------------------------------------------------


def moving_frame():
    """(25) in the frame that moves along, where `L^s_x = L_x + n_x L_theta` by (11).

    Curvature then counts once more, not twice; and turning the whole scene changes nothing.
    """
    along = lx + n1 * lt  # L^s_x
    _, x, theta, *_ = derivatives(reflected())
    return [x - (along + n1 * lt) * r0, theta + lt * r0]


# --- shadowed light on a curved surface ----------------------------------------------------------


def behind_an_edge():
    """(25) with L V for L: V = H(omega - e) steps at a place that moves, omega_e = e(x).

    The convolution is an integral from e, of `L(x, omega) rho(theta_r - omega)`. Differentiated
    whole, beside (L_x V + L V_x) (x) rho + 2 n_x (L_w V + L V_w) (x) rho with Diracs read out.
    """
    x, theta, w, far = sp.symbols("x theta omega far", real=True)
    n, e = sp.Function("n")(x), sp.Function("e")(x)
    L, rho = (sp.Function("L1")(x) * sp.Function("L2")(w), sp.Function("rho"))
    seen = 2 * n - theta
    whole = sp.Integral(L * rho(seen - w), (w, e, far)).diff(x)
    # int L_w rho(seen - w) from e: by parts, of which the Dirac L V_w takes the end at e.
    t = sp.Symbol("t")
    slope = rho(t).diff(t).subs(t, seen - w)
    SV = sp.Integral(L.diff(x) * rho(seen - w), (w, e, far))
    step_x = -(L * rho(seen - w)).subs(w, e) * e.diff(x)
    DV = sp.Integral(L * slope, (w, e, far))  # = int (L V)_w rho, V zero beyond far
    parts = (L * rho(seen - w)).diff(w) - L.diff(w) * rho(seen - w) + L * slope
    return [
        sp.simplify((whole - SV - step_x - 2 * n.diff(x) * DV).doit()),
        sp.simplify(parts.doit()),
    ]


EDGE = -0.15


def edged(x, theta):
    """B behind a fixed edge in the global angle: nodes beyond it, the bell's light."""
    t, weights = np.polynomial.legendre.leggauss(200)
    w = EDGE + 0.5 * (3.0 - EDGE) * (t + 1.0)
    half = 0.5 * (3.0 - EDGE)
    return half * np.sum(weights * bell(x, w) * gauss(2.0 * normal(x) - theta - w, 0.2))


@functools.cache
def _edged_gradients():
    L = Multiply(half_plane(EDGE, 0.0, 1.0, "theta"))(LIGHT)
    B = Surface(NORMAL, (glossy(0.2),)).reflect(L, nodes=96)
    rays = jnp.asarray(RAYS)
    closed = jax.jit(jax.vmap(lambda u: B.jet(u).gradient))(rays)
    return np.asarray(closed), np.asarray(jax.jit(jax.vmap(jax.grad(B.at)))(rays))


def edged_gradient(route) -> float:
    closed, by_autodiff = _edged_gradients()
    if route == "autodiff":
        return normwise(closed, by_autodiff)
    return normwise(closed, np.array([complex_step(edged, *ray) for ray in RAYS]))


# --- space and distance --------------------------------------------------------------------------


def turned_twice():
    """How far the mirrored direction turns as the normal does, in and across the plane of view."""
    theta, s = sp.symbols("theta s", real=True)
    eye = sp.Matrix([sp.sin(theta), 0, sp.cos(theta)])

    def rate(axis):
        lean = sp.Matrix([s if axis == 0 else 0, s if axis == 1 else 0, 1])
        n = lean / sp.sqrt(1 + s**2)
        r = 2 * n * n.dot(eye) - eye
        return r.diff(s).subs(s, 0)

    return [
        sp.simplify(rate(0).dot(rate(0)) - 4),
        sp.simplify(rate(1).norm() ** 2 - 4 * sp.cos(theta) ** 2),
    ]


def traced_turn(theta, kappa):
    """B_y of a mirror that bends across the plane of view alone, under light w_y, by a trace."""
    eye = np.array([np.sin(theta), 0.0, np.cos(theta)])

    def seen(y):
        n = np.array([0.0 * y, np.sin(kappa * y), np.cos(kappa * y)])
        return (2.0 * n * (n @ eye) - eye)[1]

    return float(seen(1e-30j).imag / 1e-30)


def mirror_in_space() -> float:
    """The library's gradient of a mirror that bends both ways, under light that grows with w_y."""
    from firstorder.imaging._reflection import reflected_radiance, surface_point

    worst = 0.0
    for theta in (0.0, 0.5, 1.2):
        patch = surface_point(jnp.zeros(3), jnp.eye(3), -0.7 * jnp.eye(2))
        eye = jnp.array([np.sin(theta), 0.0, np.cos(theta)])
        B = reflected_radiance(lambda x, w: w[1] + 0.0 * x[0], patch, eye)
        worst = max(worst, float(abs(B.spatial[1] - traced_turn(theta, 0.7))))
    return worst


def by_autodiff_in_space() -> float:
    """The same against autodiff of the mirrored direction, with the normal that leans."""
    from firstorder.imaging._reflection import mirrored, reflected_radiance, surface_point

    S = jnp.array([[-0.7, 0.2], [0.2, -0.4]])
    eye = jnp.array([np.sin(0.5), 0.0, np.cos(0.5)])
    B = reflected_radiance(
        lambda x, w: w[1] + 0.0 * x[0], surface_point(jnp.zeros(3), jnp.eye(3), S), eye
    )

    def seen(step):
        n = jnp.append(-S @ step, 1.0)
        return mirrored(eye, n / jnp.sqrt(n @ n))[1]

    return normwise(B.spatial, jax.grad(seen)(jnp.zeros(2)))


def nearer_and_farther() -> float:
    """|CDV| / |SV| under a line of light at growing heights, by complex steps: in proportion."""
    x, w, kappa = 0.3, 0.2, bent(0.3)[1]
    worst = 0.0
    for d in (1.0, 2.0, 4.0):
        ratio = abs(2.0 * kappa * slope_w(near(d), x, w) / slope_x(near(d), x, w))
        ours = 1.0 / float(far_light_ratio(d / np.cos(w), w, kappa))
        worst = max(
            worst, abs(ours / ratio - 1.0), abs(ratio / d * np.cos(w) ** 2 / (2 * kappa) - 1.0)
        )
    return worst


def distance_of_a_line():
    """|CDV| / |SV| of a mirror below a line at height d: it grows as d does."""
    d, w, n_x = sp.symbols("d omega n_x", positive=True)
    x = sp.Symbol("x", real=True)
    L = sp.Function("s")(x - d * sp.tan(w))
    ratio = sp.simplify((2 * n_x * L.diff(w) / L.diff(x)).doit())
    return [
        sp.simplify(ratio + 2 * n_x * d / sp.cos(w) ** 2),
        sp.simplify(d * ratio.diff(d) - ratio),
    ]


def ratio_by_autodiff() -> float:
    """d/dd of the library's |CDV| / |SV|, a constant over cos(w)^2."""
    w, kappa = jnp.array([-0.7, 0.1, 0.6]), 0.5

    def ratio(d):
        return 1.0 / far_light_ratio(d / jnp.cos(w), w, kappa)

    return normwise(jax.jacfwd(ratio)(2.0), 2.0 * kappa / jnp.cos(w) ** 2)


ROWS = [
    Row(
        "R07.s3.1a",
        "misprint",
        implements="firstorder.laws.move.Move.spectrum",
        symbolic=flipped_bell,
        autodiff=na("spectral"),
        fourier=Check(moved_spectrum, 1e-12),
        brute_force=na("one route"),
        corrected="H(Omega) = F(M^-T Omega) / |det M|, as (6) has it",
        counterexample=Counterexample(
            {"Omega_x": 0.2, "Omega_theta": 0.1}, printed=without_modulus, true=summed_transform
        ),
        note="In the text extraction, whose table may have lost the bars (look at the page). It "
        "matters for maps that flip, such as the mirror of (13).",
    ),
    Row(
        "R07.s4.1i",
        "over-claim",
        implements="firstorder.transport.shading.surface.ReflectedField",
        symbolic=general_integral,
        autodiff=Check(lambda: rough_gradient("autodiff"), 1e-9),
        fourier=flatless,
        brute_force=Check(lambda: rough_gradient("brute"), 1e-9),
        corrected="B^s_x = int L^m_x rho(w, theta) dw, but B^s_theta = int L^m rho_theta dw, which "
        "is int L^m_w rho for a function of w - theta alone",
        counterexample=Counterexample(
            {"x": 0.3, "theta": 0.4}, printed=printed_slope, true=true_slope
        ),
        note="Shown on microfacets. Back in the global frame -k B^s_theta is in B_x as well.",
    ),
    Row(
        "R07.s4.3e",
        "identity",
        implements=CLOSED,
        symbolic=moving_frame,
        autodiff=autodiff("glossy", "gradient"),
        fourier=na("one route"),
        brute_force=brute("glossy", "gradient", 1e-10),
        note="The tangent frame of the point, which stands still while x moves. In the frame that "
        "moves along L^s_x has n_x L_theta in it already, and (25) reads L^s_x + n_x L_theta.",
    ),
    Row(
        "R07.s5.1c",
        "over-claim",
        implements="firstorder.imaging._reflection.ReflectedRadiance",
        symbolic=turned_twice,
        autodiff=Check(by_autodiff_in_space, 1e-12),
        fourier=flatless,
        brute_force=Check(mirror_in_space, 1e-12),
        corrected="2 kappa in the plane of view; across it 2 kappa cos(theta), from the normal",
        counterexample=Counterexample(
            {"theta": 1.2, "kappa": 0.7},
            printed=lambda theta, kappa: 2.0 * kappa + 0.0 * theta,
            true=traced_turn,
        ),
        note="A mirror under light that grows with w_y, bent across the plane of view alone.",
    ),
    Row(
        "R07.s5.2i",
        "identity",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=distance_of_a_line,
        autodiff=Check(ratio_by_autodiff, 1e-12),
        fourier=flatless,
        brute_force=Check(nearer_and_farther, 1e-12),
        note="Of a mirror under a line of light, in proportion to its height; a lobe blurs both.",
    ),
    Row(
        "R07.s6.1a",
        "identity",
        implements=CLOSED,
        symbolic=behind_an_edge,
        autodiff=Check(lambda: edged_gradient("autodiff"), 1e-9),
        fourier=flatless,
        brute_force=Check(lambda: edged_gradient("brute"), 1e-9),
        note="Diracs of V_x and V_theta are those at directions that stand still: on a curved "
        "surface 2 n_x L V_theta is an edge term too.",
    ),
]
