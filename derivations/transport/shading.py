"""Reflected light of a curved surface, from the integral over incident directions.

R07 §4.1 (step 3) to §5.2, §5.4 and App. C. The proofs differentiate
`B = int L(x, omega) rho(2 n(x) - theta - omega) d omega` at fixed offsets `t = theta_r - omega`:
there x and theta enter through L alone. A derivative up to order two knows L and n by their 2-jets
only, so polynomials with free coefficients prove it for all smooth L and n, at every offset.

Numeric routes: autodiff of the value; the discrete transform of the sampled light, multiplied by
the lobe's transform and by powers of 2 pi i Omega; and, as brute force, a dense sum over directions
in NumPy, differentiated by complex steps.
"""

from __future__ import annotations

import functools

import jax
import jax.numpy as jnp
import numpy as np
import sympy as sp

from derivations.ledger import Check, Counterexample, Row, na
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.fields import Affine, Constant, autodiff_jet, gaussian
from firstorder.transport.brdf import Ggx
from firstorder.transport.lobes import Lobe, glossy, lambert
from firstorder.transport.reflection import VaryingGaussian
from firstorder.transport.shading import Light, Surface, far_light_ratio
from firstorder.transport.texture import wave

MODULE = "firstorder.transport.shading"
RAYS = np.array([[0.3, 0.1], [-0.4, 0.25], [0.7, -0.35]])

# --- symbols ----------------------------------------------------------------------------------

a, b = sp.symbols("dx dtheta", real=True)
n0, n1, n2 = sp.symbols("n n_x n_xx", real=True)
l0, lx, lt, lxx, lxt, ltt = sp.symbols(
    "L L_x L_theta L_xx L_xtheta L_thetatheta", real=True
)  # the jet of L at (x, theta_r - t)
r0, rx, rxx = sp.symbols("rho rho_x rho_xx", real=True)  # that of the lobe at a fixed offset


def light(da, db):
    """The 2-jet of L."""
    return l0 + lx * da + lt * db + lxx * da**2 / 2 + lxt * da * db + ltt * db**2 / 2


def lobe(da):
    """The 2-jet of a lobe that varies in x, at a fixed offset."""
    return r0 + rx * da + rxx * da**2 / 2


turn = n1 * a + n2 * a**2 / 2  # n(x + dx) - n(x)


def derivatives(f):
    """Value, gradient and Hessian at the ray."""
    at = {a: 0, b: 0}
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    return [sp.diff(f, a, i, b, j).subs(at) if i + j else f.subs(at) for i, j in orders]


def reflected():
    """The integrand of (23) at a fixed offset, as a function of the ray."""
    return light(a, 2 * turn - b) * r0


def definition_of_the_convolution():
    """(14), flat: at fixed offsets the ray enters the mirrored light alone. That is (15), (16)."""
    flat = derivatives(light(a, -b) * r0)
    # L_m(x, omega) = L(x, -omega), so L_m,x = L_x and L_m,theta = -L_theta
    return flat[1] - lx * r0, flat[2] + lt * r0


def substitution():
    """(22) -> (23): `omega' = n - omega`, whose Jacobian has size 1 and whose ends swap."""
    w, wp, theta = sp.symbols("omega omega_prime theta", real=True)
    L, rho = sp.Function("L"), sp.Function("rho")
    start = L(-w + n0) * rho(w - theta + n0)
    end = L(wp) * rho(2 * n0 - theta - wp)
    jacobian = sp.Abs(sp.diff(n0 - wp, wp)) - 1
    return (start.subs(w, n0 - wp) - end).simplify(), jacobian


def four_steps():
    """(22) from its definition: rotate, mirror, convolve, rotate back."""
    w, theta, x = sp.symbols("omega theta x", real=True)
    n, L, rho = sp.Function("n"), sp.Function("L"), sp.Function("rho")
    local = lambda x, t: L(x, t + n(x))  # noqa: E731
    mirrored = lambda x, t: local(x, -t)  # noqa: E731
    integrand = lambda x, t: mirrored(x, w) * rho(w - t)  # noqa: E731
    end = L(x, -w + n(x)) * rho(w - theta + n(x))
    return (integrand(x, theta - n(x)) - end).simplify(), mirrored(x, w) - L(x, -w + n(x))


def matrices():
    """(24): the three linear steps, and the derivative itself."""
    product = sp.Matrix([[1, -n1], [0, 1]]) * sp.diag(1, -1) * sp.Matrix([[1, n1], [0, 1]])
    combined = sp.Matrix([[1, 2 * n1], [0, -1]])
    true = sp.Matrix(derivatives(reflected())[1:3])
    return list(product - combined) + list(true - combined * sp.Matrix([lx, lt]) * r0)


def gradient():
    """(25)."""
    _, x, theta, *_ = derivatives(reflected())
    return x - (lx + 2 * n1 * lt) * r0, theta + lt * r0


def hessian():
    """(29)."""
    *_, xx, xt, tt = derivatives(reflected())
    return (
        xx - (lxx + 4 * n1 * lxt + 4 * n1**2 * ltt + 2 * n2 * lt) * r0,
        xt + (lxt + 2 * n1 * ltt) * r0,
        tt - ltt * r0,
    )


def even_lobes():
    """Footnote 2: the odd part of a lobe is what changes the sign; of an even one it is zero."""
    t, c = sp.symbols("t c", real=True)
    even = sp.exp(-(t**2)) * (1 + c * t**2)
    return sp.simplify(even - even.subs(t, -t))


def through_the_reflected_direction():
    """(68): the same with a function f instead of an integral."""
    _, x, theta, *_ = derivatives(light(a, 2 * turn - b))
    return x - lx - 2 * n1 * lt, theta + lt


def of_the_convolved_gradients():
    """(69): L_x and L_theta in the place of L."""
    p, q = a, 2 * turn - b
    first = {"x": lx + lxx * p + lxt * q, "theta": lt + lxt * p + ltt * q}
    at = {a: 0, b: 0}
    dx = {k: sp.diff(e, a).subs(at) for k, e in first.items()}
    dt = {k: sp.diff(e, b).subs(at) for k, e in first.items()}
    return (
        dx["x"] - lxx - 2 * n1 * lxt,
        dt["x"] + lxt,
        dx["theta"] - lxt - 2 * n1 * ltt,
        dt["theta"] + ltt,
    )


def varying():
    """(19), and the second derivatives that the paper does not give."""
    value, x, theta, xx, xt, tt = derivatives(light(a, -b) * lobe(a))
    return (
        value - l0 * r0,
        x - lx * r0 - l0 * rx,
        theta + lt * r0,
        xx - lxx * r0 - 2 * lx * rx - l0 * rxx,
        xt + lxt * r0 + lt * rx,
        tt - ltt * r0,
    )


def varying_on_a_curved_surface():
    """§4.3, last paragraph: L (*) rho_x in B_x and nothing in B_theta; and the Hessian."""
    _, x, theta, xx, xt, tt = derivatives(light(a, 2 * turn - b) * lobe(a))
    smooth = lxx + 4 * n1 * lxt + 4 * n1**2 * ltt + 2 * n2 * lt
    return (
        x - (lx + 2 * n1 * lt) * r0 - l0 * rx,
        theta + lt * r0,
        xx - smooth * r0 - 2 * (lx + 2 * n1 * lt) * rx - l0 * rxx,
        xt + (lxt + 2 * n1 * ltt) * r0 + lt * rx,
        tt - ltt * r0,
    )


def textured():
    """(20) with `E = int L cos+(omega - n) d omega`: product rule; E_x by its own integral."""
    x = sp.symbols("x", real=True)
    E, rho = sp.Function("E")(x), sp.Function("rho")(x)
    product = (E * rho).diff(x) - (E.diff(x) * rho + E * rho.diff(x))
    second = (E * rho).diff(x, 2) - (
        E.diff(x, 2) * rho + 2 * E.diff(x) * rho.diff(x) + E * rho.diff(x, 2)
    )
    return product, second


def diffuse_argument():
    """A diffuse lobe depends on `n - omega`: its derivatives have n_x once, and none in theta."""
    _, x, theta, xx, xt, tt = derivatives(light(a, turn) * r0)
    return (
        x - (lx + n1 * lt) * r0,
        theta,
        xx - (lxx + 2 * n1 * lxt + n1**2 * ltt + n2 * lt) * r0,
        xt,
        tt,
    )


def exact_cosine():
    """B with `cos(omega - n)`, both ways: the missing term, and the horizon's end term.

    `w = m - t` is the local angle, m = n - theta. Over the interior Leibniz' rule holds. At a
    horizon the cosine vanishes and its slope does not: differentiate a whole integral up to
    `t = m + pi/2` in closed form, with a quadratic lobe and a linear light.
    """
    t, m, s = sp.symbols("t m s", real=True)
    weight = sp.cos(n1 * a + n2 * a**2 / 2 - b + s)  # s = w at the ray
    first = derivatives(light(a, 2 * turn - b) * r0 * weight)
    gained = -lt * sp.cos(s) + l0 * sp.sin(s)  # theta: m falls, so the cosine gains a sine
    c1, r1, r2 = sp.symbols("c1 r1 r2", real=True)
    L, rho = lambda t: 1 + c1 * t, lambda t: 1 + r1 * t + r2 * t**2
    start = sp.Rational(-1, 5)
    whole = sp.integrate(sp.expand(L(m - t) * rho(t)) * sp.cos(m - t), (t, start, m + sp.pi / 2))
    inner = sp.integrate(
        sp.diff(sp.expand(L(m - t) * rho(t)) * sp.cos(m - t), m, 2), (t, start, m + sp.pi / 2)
    )
    end = L(-sp.pi / 2) * rho(m + sp.pi / 2)
    return (
        first[1] - ((lx + 2 * n1 * lt) * sp.cos(s) - n1 * l0 * sp.sin(s)) * r0,
        first[2] - gained * r0,
        sp.simplify(sp.diff(whole, m, 2) - inner - end),
    )


def general_brdf():
    """`int L(x, n + w) rho(w, theta - n) cos w dw`: ends at -+ pi/2 stand still, so no end term."""
    p0, p1, p2 = sp.symbols("rho rho_o rho_oo", real=True)
    o = b - turn
    brdf = p0 + p1 * o + p2 * o**2 / 2
    _, x, theta, xx, xt, tt = derivatives(light(a, turn) * brdf)
    gx = lx + n1 * lt
    return (
        x - gx * p0 + n1 * l0 * p1,
        theta - l0 * p1,
        xx
        - (lxx + 2 * n1 * lxt + n1**2 * ltt + n2 * lt) * p0
        + 2 * n1 * gx * p1
        - l0 * (n1**2 * p2 - n2 * p1),
        xt - gx * p1 + n1 * l0 * p2,
        tt - l0 * p2,
    )


def isotropic_source():
    """§5.2: L_x and L_theta of a source that shines equally in all directions.

    First a line at height d, seen from a point that moves along a base with normal n_0; then any
    emitter: two rays hit it in the same place if their distance there, across the ray, is the same.
    """
    x, d, w, m = sp.symbols("x d omega n_0", real=True)
    s = sp.Function("s")
    px, py = sp.cos(m) * x, sp.sin(m) * x  # along the tangent (cos n_0, sin n_0)
    L = s(px - (d - py) * sp.tan(w))
    ratio = (L.diff(x) / L.diff(w)).subs(x, 0).doit()
    D = d / sp.cos(w)
    across_x = sp.Matrix([sp.cos(m), sp.sin(m)]).dot(sp.Matrix([sp.cos(w), sp.sin(w)]))
    across_w = -D  # direction(w) turns counter-clockwise: to the left
    flat = ratio.subs(m, 0) + sp.cos(w) ** 2 / d
    return (
        sp.simplify(ratio + sp.cos(w - m) / D),
        sp.simplify(across_x / across_w + sp.cos(w - m) / D),
        sp.simplify(flat),
    )


def special_cases():
    """Figure 4's rows that hold exactly: what (25) becomes for distant light and flat surfaces."""
    B_x = (lx + 2 * n1 * lt) * r0
    SV, CDV = lx * r0, 2 * n1 * lt * r0
    return (
        B_x - SV - CDV,
        B_x.subs(lx, 0) - CDV,
        B_x.subs(n1, 0) - SV,
        B_x.subs({lx: 0, n1: 0}),
    )


def rotated_axes():
    """§5.1: the size of (B_x, B_y) in turned axes."""
    Bx, By, t = sp.symbols("B_x B_y t", real=True)
    R = sp.Matrix([[sp.cos(t), sp.sin(t)], [-sp.sin(t), sp.cos(t)]])
    return sp.simplify((R * sp.Matrix([Bx, By])).norm() ** 2 - Bx**2 - By**2)


# --- brute force: NumPy, complex steps --------------------------------------------------------

STEP = 1e-30


def bell(x, w):
    """The light: off-centre and correlated, entire in both arguments."""
    p, q = (x - 0.21) / 0.55, (w + 0.13) / 0.4
    return 1.3 * np.exp(-0.5 * (p * p - 0.7 * p * q + q * q) / (1.0 - 0.35**2))


def normal(x):
    """The normal's angle."""
    return 0.05 + 0.3 * x + 0.08 * np.cos(2.0 * np.pi * 0.4 * x)


def gauss(t, sigma):
    """The Gaussian lobe."""
    return np.exp(-0.5 * (t / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))


def dense(x, theta, L=bell, n=normal, sigma=0.2, turn=2.0, look=-1.0, weight=None):
    """B by 4000 equidistant offsets, from the unsimplified steps; spectrally accurate."""
    h = 9.0 * np.max(np.real(sigma if not callable(sigma) else 0.35)) / 2000.0
    t = h * np.arange(-2000, 2001)
    s = sigma(x) if callable(sigma) else sigma
    w = turn * n(x) + look * theta - t
    values = L(x, w) * gauss(t, s)
    return h * np.sum(values if weight is None else values * weight(w - n(x)))


def complex_step(f, x, theta):
    """Gradient of an entire function, without cancellation."""
    return np.array([f(x + 1j * STEP, theta).imag, f(x, theta + 1j * STEP).imag]) / STEP


def differences(f, x, theta, h=2e-3):
    """Hessian: sixth-order differences of the gradient."""
    c = np.array([3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0]) / h
    rows = []
    for e in ((1.0, 0.0), (0.0, 1.0)):
        g = [
            ck * (complex_step(f, x + k * h * e[0], theta + k * h * e[1])
                  - complex_step(f, x - k * h * e[0], theta - k * h * e[1]))
            for k, ck in zip((1, 2, 3), c, strict=True)
        ]  # fmt: skip
        rows.append(sum(g))
    return np.array(rows)


# --- the same by the library ------------------------------------------------------------------

LIGHT = gaussian((0.21, -0.13), (0.55, 0.4), 0.35, 1.3)
NORMAL = Affine([0.3, 0.0], 0.05) + wave(0.4, 0.08)
SIGMA = wave(0.5, 0.05, mean=0.25)
VARYING = Lobe(VaryingGaussian(SIGMA, widest=0.32))
SCENES = {
    "glossy": Surface(NORMAL, (glossy(0.2),)),
    "flat": Surface(Constant(0.0), (glossy(0.2),)),
    "varying": Surface(NORMAL, (VARYING,)),
    "varying, flat": Surface(Constant(0.0), (VARYING,)),
    "painted": Surface(NORMAL, (glossy(0.2),), wave(0.3, 0.4, mean=0.6)),
    "painted, diffuse": Surface(NORMAL, (lambert(0.8),), wave(0.3, 0.4, mean=0.6)),
    "diffuse": Surface(NORMAL, (lambert(0.8),)),
    "cosine": Surface(NORMAL, (glossy(0.2, cosine=True),)),
}
BRUTE = {
    "glossy": dense,
    "flat": functools.partial(dense, n=lambda x: 0.0 * x),
    "varying": functools.partial(dense, sigma=lambda x: 0.25 + 0.05 * np.cos(np.pi * x)),
    "varying, flat": functools.partial(
        dense, n=lambda x: 0.0 * x, sigma=lambda x: 0.25 + 0.05 * np.cos(np.pi * x)
    ),
    "painted": lambda x, t: (0.6 + 0.4 * np.cos(0.6 * np.pi * x)) * dense(x, t),
    "diffuse": lambda x, t: irradiance(x),
    "painted, diffuse": lambda x, t: (0.6 + 0.4 * np.cos(0.6 * np.pi * x)) * irradiance(x),
    "cosine": functools.partial(dense, weight=np.cos),
}


def irradiance(x, L=bell, n=normal, albedo=0.8):
    """`albedo / 2 int L cos+` over the local hemisphere, by Gauss-Legendre."""
    w, weights = np.polynomial.legendre.leggauss(160)
    w, weights = 0.5 * np.pi * w, 0.5 * np.pi * weights
    return 0.5 * albedo * np.sum(weights * np.cos(w) * L(x, n(x) + w))


@functools.cache
def jets(scene):
    """Closed-form jets, and those by autodiff of the value."""
    B = SCENES[scene].reflect(LIGHT)

    def both(u):
        return B.jet(u), autodiff_jet(B.at, u, B.frame)

    return jax.jit(jax.vmap(both))(jnp.asarray(RAYS))


def autodiff(scene, part):
    def error():
        closed, truth = jets(scene)
        return normwise(getattr(closed, part), getattr(truth, part))

    return Check(error, 1e-10)


def brute(scene, part, bound=1e-10):
    def error():
        f = BRUTE[scene]
        make = {
            "value": lambda x, t: f(x, t),
            "gradient": lambda x, t: complex_step(f, x, t),
            "hessian": lambda x, t: differences(f, x, t),
        }[part]
        truth = np.array([make(x, t) for x, t in RAYS])
        return normwise(getattr(jets(scene)[0], part), truth)

    return Check(error, bound)


# --- Fourier ----------------------------------------------------------------------------------


@functools.cache
def spectrum():
    """Discrete transform of the sampled light: frequencies along x and theta, and F."""
    nx, nt, X, T = 96, 97, 5.0, 4.0
    x = (np.arange(nx) - 0.5 * (nx - 1)) * 2.0 * X / nx
    t = (np.arange(nt) - 0.5 * (nt - 1)) * 2.0 * T / nt
    kx, kt = np.fft.fftfreq(nx, 2.0 * X / nx), np.fft.fftfreq(nt, 2.0 * T / nt)
    f = bell(x[:, None], t)
    left = np.exp(-2j * np.pi * kx[:, None] * x) / nx
    right = np.exp(-2j * np.pi * kt[:, None] * t) / nt
    return kx, kt, left @ f @ right.T


def convolved(x, angle, i, j, sigma=0.2):
    """The derivative `d^(i + j) L / dx^i dtheta^j`, convolved with the lobe: all by frequencies."""
    kx, kt, F = spectrum()
    lobe = np.exp(-2.0 * (np.pi * sigma * kt) ** 2)
    left = (2j * np.pi * kx) ** i * np.exp(2j * np.pi * kx * x)
    right = (2j * np.pi * kt) ** j * np.exp(2j * np.pi * kt * angle) * lobe
    return (left @ F @ right).real


def fourier(part, flat=False):
    """(23), (25), (29) as printed, convolved by frequencies, against the closed form."""

    def error():
        found = []
        for x, theta in RAYS:
            n, k, kk = (0.0, 0.0, 0.0) if flat else bent(x)
            r = 2.0 * n - theta
            C = {(i, j): convolved(x, r, i, j) for i in range(3) for j in range(3 - i)}
            if part == "value":
                found.append(C[0, 0])
            elif part == "gradient":
                found.append([C[1, 0] + 2.0 * k * C[0, 1], -C[0, 1]])
            else:
                xx = C[2, 0] + 4.0 * k * C[1, 1] + 4.0 * k**2 * C[0, 2] + 2.0 * kk * C[0, 1]
                xt = -C[1, 1] - 2.0 * k * C[0, 2]
                found.append([[xx, xt], [xt, C[0, 2]]])
        return normwise(np.array(found), getattr(jets("flat" if flat else "glossy")[0], part))

    return Check(error, 1e-9)


def bent(x):
    """n, n_x and n_xx of `normal`, by hand."""
    w = 0.8 * np.pi
    return normal(x), 0.3 - 0.08 * w * np.sin(w * x), -0.08 * w**2 * np.cos(w * x)


# --- over-claims: printed, and true by brute force --------------------------------------------


def near(d, width=1.0):
    """A line of light at height d: the same from all sides."""
    return lambda x, w: np.exp(-0.5 * ((x - d * np.tan(w)) / width) ** 2)


def slope_x(L, x, w):
    return np.imag(L(x + 1j * STEP, w)) / STEP


def slope_w(L, x, w):
    return np.imag(L(x, w + 1j * STEP)) / STEP


def printed_lambertian(x, theta):
    """B_x of a diffuse surface by (25): 2 n_x."""
    del theta
    k = bent(x)[1]
    SV = irradiance(x, L=lambda x_, w: slope_x(bell, x_, w))
    DV = irradiance(x, L=lambda x_, w: slope_w(bell, x_, w))
    return float(SV + 2.0 * k * DV)


def cylinder(kappa, theta):
    """B_x across a cylinder under distant light, traced in its cross-section."""
    f = functools.partial(dense, L=lambda x, w: np.exp(-(w**2)) + 0.0 * x, n=lambda x: kappa * x)
    return float(complex_step(f, 0.0, theta)[0])


def flat_mirror(d, theta):
    """B_x of a flat mirror under a line of light: `L(x, -theta)`, by complex steps."""
    return float(complex_step(lambda x, t: near(d)(x, -t), 0.3, theta)[0])


def off_specular(theta, sign, shift=0.3):
    """A shifted lobe on a flat surface: (14) as printed (sign 1) and turned about."""
    t = np.linspace(-2.5, 2.5, 8001)
    rho = gauss(t - shift, 0.2)
    return float(np.sum(bell(0.3, -(theta + sign * t)) * rho) * (t[1] - t[0]))


# --- approximations: fitted orders ------------------------------------------------------------


def overcast_order():
    """B_x is of first order in the contrast of the sky, at fixed curvature."""

    def size(contrast):
        f = functools.partial(dense, L=lambda x, w: 1.0 + contrast * np.sin(w) + 0.0 * x)
        return abs(complex_step(f, 0.3, 0.1)[0])

    e = np.array([0.2, 0.1, 0.05])
    return abs(fitted_order(e, [size(c) for c in e]) - 1.0)


def near_order():
    """SV grows as 1 / d for light of a given angular pattern."""

    def size(d):
        f = functools.partial(
            dense, L=lambda x, w: np.exp(-((x / d - np.tan(w) + 0.4) ** 2)), n=lambda x: 0.0 * x
        )
        return abs(complex_step(f, 0.0, 0.1)[0])

    d = np.array([1.0, 2.0, 4.0])
    return abs(fitted_order(d, [size(c) for c in d]) + 1.0)


def bump_order():
    """The error of `B_x = CDV` falls as the inverse of the curvature."""

    def miss(kappa):
        f = functools.partial(dense, L=near(3.0), n=lambda x: kappa * x)
        B_x, B_theta = complex_step(f, 0.0, 0.3)
        return abs(B_x + 2.0 * kappa * B_theta) / abs(B_x)

    k = np.array([20.0, 40.0, 80.0])
    return abs(fitted_order(k, [miss(c) for c in k]) + 1.0)


def comparable_order():
    """SV / CDV against L_x / (2 n_x L_theta) at the lobe's centre: second order in the width."""

    def miss(sigma):
        SV = dense(0.3, 0.1, L=lambda x, w: slope_x(bell, x, w), sigma=sigma)
        DV = dense(0.3, 0.1, L=lambda x, w: slope_w(bell, x, w), sigma=sigma)
        r = 2.0 * normal(0.3) - 0.1
        return abs(SV / DV - slope_x(bell, 0.3, r) / slope_w(bell, 0.3, r))

    s = np.array([0.04, 0.02, 0.01])
    return abs(fitted_order(s, [miss(c) for c in s]) - 2.0)


def young():
    """|L_theta (*) rho| <= sup |L| int |rho'|, even for light with edges: how far it is exceeded.

    A search over square waves, the worst lights for the bound: `int |rho'| = albedo` for the
    diffuse lobe and is unbounded for a narrow one.
    """
    t = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20001)
    slope = -0.5 * np.sin(t)
    bound = np.trapezoid(np.abs(slope), t)
    worst = 0.0
    for frequency in np.linspace(0.05, 8.0, 40):
        for phase in np.linspace(0.0, 1.0, 20):
            L = np.sign(np.sin(2.0 * np.pi * (frequency * t + phase)))
            worst = max(worst, abs(np.trapezoid(L * slope, t)))
    return max(worst - bound, 0.0)


def isotropic_error():
    """`L_x = -cos(omega - n_0) / D L_theta` against a traced circle of light, tilted base."""
    n_0, center, radius = 0.3, np.array([0.4, 3.0]), 0.7

    def L(x, w):
        """Radiance of a point on the circle depends on where it is, not on the direction."""
        px, py = np.cos(n_0) * x, np.sin(n_0) * x
        ux, uy = -np.sin(w), np.cos(w)
        qx, qy = px - center[0], py - center[1]
        b = qx * ux + qy * uy
        D = -b - np.sqrt(b * b - (qx * qx + qy * qy - radius**2))
        return np.sin(3.0 * np.arctan((qx + D * ux) / (qy + D * uy))), D

    worst = 0.0
    for w in (-0.25, -0.1, 0.0):
        D = L(0.0, w)[1]
        L_x = L(0.0 + 1j * STEP, w)[0].imag / STEP
        L_w = L(0.0, w + 1j * STEP)[0].imag / STEP
        worst = max(worst, abs(L_x + np.cos(w - n_0) / D * L_w) / abs(L_x))
        ours = far_light_ratio(D, w - n_0, 0.8)
        worst = max(worst, abs(ours - abs(L_x / (1.6 * L_w))))
    return float(worst)


def isotropic_by_autodiff():
    """The same under a line of light, its slopes by autodiff, against `far_light_ratio`."""
    d, kappa = 2.0, 0.5
    w = jnp.array([-0.7, 0.1, 0.6])
    L_x, L_w = jax.vmap(jax.grad(lambda x, w: jnp.sin(x - d * jnp.tan(w)), (0, 1)), (None, 0))(
        0.3, w
    )
    signed = L_x / (2.0 * kappa * L_w)
    return normwise(-far_light_ratio(d / jnp.cos(w), w, kappa), signed)


def term_error(row):
    """The row's identity, on the library's terms against complex steps of the dense sum."""
    flat, distant = row in ("flat", "flat-envmap"), row in ("distant", "flat-envmap")
    L = (lambda x, w: np.exp(-((w - 0.1) ** 2)) + 0.0 * x) if distant else bell
    n = (lambda x: 0.0 * x) if flat else normal
    f = functools.partial(dense, L=L, n=n)
    ours = Light(lambda x, w: jnp.exp(-((w - 0.1) ** 2)) + 0.0 * x, _distant)
    surface = SCENES["flat" if flat else "glossy"]
    terms = surface.reflect(ours if distant else LIGHT).terms(*RAYS.T)[0]
    B_x = np.array([complex_step(f, x, t)[0] for x, t in RAYS])
    zero = {"distant": [terms.SV], "flat": [terms.CV, terms.CDV], "all": []}
    zero["flat-envmap"] = [*zero["distant"], *zero["flat"], B_x]
    left = {"distant": terms.CDV, "flat": terms.SV, "flat-envmap": 0.0 * B_x}
    total = left.get(row, terms.SV + terms.CDV)
    gone = [float(np.max(np.abs(z))) for z in zero[row]]
    return max([normwise(total, B_x) if np.any(B_x) else 0.0, *gone])


def _distant(x, w):
    """Entries of a distant bell."""
    f, zero = jnp.exp(-((w - 0.1) ** 2)), 0.0 * x
    h = w - 0.1
    return f + zero, zero, -2.0 * h * f, zero, zero, (4.0 * h * h - 2.0) * f


def direction_sign():
    """B_theta + DV, from complex steps."""
    terms = SCENES["glossy"].reflect(LIGHT).terms(*RAYS.T)[0]
    truth = np.array([complex_step(dense, x, t)[1] for x, t in RAYS])
    return normwise(-terms.DV, truth)


def occluded_ggx():
    """(1) with all its factors: rough facets, a blocker's edge, the cosine; adaptive quadrature."""
    from scipy.integrate import quad

    from firstorder.fields import half_plane
    from firstorder.laws import Multiply

    blocker = half_plane(-0.2, 0.0, 1.0, "theta")  # V = 1 for omega > -0.2
    rho = Ggx(0.4)
    B = Surface(NORMAL, (rho,)).reflect(Multiply(blocker)(LIGHT))
    value = jax.jit(lambda x, theta: B(x, theta))
    worst = 0.0
    for x, theta in RAYS[:2]:
        n = normal(x)

        def integrand(w, x=x, theta=theta, n=n):
            h, d, o = 0.5 * (w + theta - n), 0.5 * (w - theta + n), theta - n
            D = 0.5 * 0.16 / (0.16 * np.cos(h) ** 2 + np.sin(h) ** 2) ** 1.5
            a = [np.sqrt(np.cos(t) ** 2 + 0.16 * np.sin(t) ** 2) for t in (w, o)]
            facets = D * np.cos(d) / (a[0] * np.cos(o) + a[1] * np.cos(w))
            return bell(x, n + w) * facets * np.cos(w)

        truth = quad(integrand, -0.2 - n, 0.5 * np.pi, epsabs=1e-13, epsrel=1e-12)[0]
        worst = max(worst, abs(float(value(x, theta)) - truth) / truth)
    return worst


# --- rows -------------------------------------------------------------------------------------

two, flatless = na("two routes"), na("no spectrum")
CLOSED = f"{MODULE}.Reflected.entries"


def _measured(equation, check, bound, note, implements=f"{MODULE}.Reflected.terms"):
    return Row(
        equation,
        "approximation",
        implements=implements,
        symbolic=na("measured"),
        autodiff=na("scale"),
        fourier=na("scale"),
        brute_force=Check(check, bound),
        note=note,
    )


def _identity(equation, symbolic, scene, part, *, wave_route=None, note=""):
    return Row(
        equation,
        "identity",
        implements=CLOSED,
        symbolic=symbolic,
        autodiff=na("no derivative") if part == "value" else autodiff(scene, part),
        fourier=wave_route or two,
        brute_force=brute(scene, part, 1e-8 if part == "hessian" else 1e-10),
        note=note,
    )


ROWS = [
    Row(
        "R07.1",
        "definition",
        implements=f"{MODULE}.Reflected",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(occluded_ggx, 1e-10),
        note="Checked with microfacets, a blocker's edge and the cosine together.",
    ),
    Row(
        "R07.14",
        "definition",
        implements=CLOSED,
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=fourier("value", flat=True),
        brute_force=brute("flat", "value"),
        note="The integral is a correlation; it is Fig. 2's convolution for an even lobe only.",
    ),
    Row(
        "R07.fn2",
        "over-claim",
        implements="firstorder.transport.lobes.Argument",
        symbolic=even_lobes,
        autodiff=na("no derivative"),
        fourier=flatless,
        brute_force=Check(
            lambda: abs(off_specular(0.1, 1.0, 0.0) - off_specular(0.1, -1.0, 0.0)), 1e-12
        ),
        corrected="rho(w - theta) = rho(theta - w) for even lobes only; (23) needs no symmetry",
        counterexample=Counterexample(
            {"theta": 0.1},
            printed=lambda theta: off_specular(theta, -1.0),
            true=lambda theta: off_specular(theta, 1.0),
        ),
        note="An off-specular lobe is not even. We use (23), a true convolution, as it stands.",
    ),
    _identity(
        "R07.15",
        definition_of_the_convolution,
        "flat",
        "gradient",
        wave_route=fourier("gradient", flat=True),
    ),
    _identity(
        "R07.16",
        definition_of_the_convolution,
        "flat",
        "gradient",
        wave_route=fourier("gradient", flat=True),
    ),
    Row(
        "R07.18",
        "definition",
        implements="firstorder.transport.reflection.VaryingGaussian",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=brute("varying, flat", "value"),
    ),
    _identity(
        "R07.19",
        varying,
        "varying, flat",
        "gradient",
        note="Second order, not printed: B_xx gains 2 L_x (*) rho_x + L (*) rho_xx.",
    ),
    _identity(
        "R07.20",
        textured,
        "painted, diffuse",
        "gradient",
        note="E is printed without the cosine; the product rule does not care.",
    ),
    _identity("R07.22", four_steps, "glossy", "value", wave_route=fourier("value")),
    _identity("R07.s4.3a", four_steps, "glossy", "value", wave_route=fourier("value")),
    _identity("R07.23", substitution, "glossy", "value", wave_route=fourier("value")),
    Row(
        "R07.s4.3b",
        "definition",
        implements="firstorder.conventions.mirror_direction",
        symbolic=substitution,
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=na("definition"),
    ),
    _identity("R07.24", matrices, "glossy", "gradient", wave_route=fourier("gradient")),
    _identity(
        "R07.25",
        gradient,
        "glossy",
        "gradient",
        wave_route=fourier("gradient"),
        note="For a lobe in theta_r without a separate cosine; see R07.s4.1f, R07.fig4.*.",
    ),
    _identity("R07.s4.3c", textured, "painted", "gradient"),
    _identity(
        "R07.s4.3d",
        varying_on_a_curved_surface,
        "varying",
        "gradient",
        note="With the second order, which the paper does not give.",
    ),
    _identity("R07.29", hessian, "glossy", "hessian", wave_route=fourier("hessian")),
    _identity(
        "R07.68",
        through_the_reflected_direction,
        "glossy",
        "gradient",
        wave_route=fourier("gradient"),
    ),
    _identity(
        "R07.69", of_the_convolved_gradients, "glossy", "hessian", wave_route=fourier("hessian")
    ),
    # §5.1
    Row(
        "R07.s5.1a",
        "over-claim",
        implements="firstorder.transport.rotation.Curvature",
        symbolic=lambda: [matrices()[0]],
        autodiff=na("scale"),
        fourier=flatless,
        brute_force=Check(lambda: abs(cylinder(0.5, 0.2) - 0.5 * cylinder(1.0, 0.2)), 1e-12),
        corrected="n_x -> dn along the direction of differentiation (the shape operator)",
        counterexample=Counterexample(
            {"kappa": 0.5, "theta": 0.2},
            printed=lambda kappa, theta: 0.0 * kappa * theta,  # a cylinder's K is zero
            true=cylinder,
        ),
        note="Gaussian curvature has the unit 1/m^2 and vanishes on a cylinder.",
    ),
    Row(
        "R07.s5.1b",
        "identity",
        symbolic=rotated_axes,
        autodiff=na("no derivative"),
        fourier=flatless,
        brute_force=Check(
            lambda: max(
                abs(np.linalg.norm([[c, s], [-s, c]] @ np.array([0.3, -1.2])) - np.hypot(0.3, 1.2))
                for c, s in ((np.cos(t), np.sin(t)) for t in np.linspace(0.0, 6.0, 50))
            ),
            1e-14,
        ),
    ),
    # §5.2
    Row(
        "R07.s5.2a",
        "definition",
        implements=f"{MODULE}.Terms",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=Check(lambda: term_error("all"), 1e-10),
    ),
    Row(
        "R07.s5.2b",
        "identity",
        implements=f"{MODULE}.Reflected.terms",
        symbolic=special_cases,
        autodiff=autodiff("glossy", "gradient"),
        fourier=fourier("gradient"),
        brute_force=Check(lambda: term_error("all"), 1e-10),
        note="Homogeneous lobes; varying ones, textures and cosines add a material term MV.",
    ),
    Row(
        "R07.s5.2c",
        "misprint",
        implements=f"{MODULE}.Reflected.terms",
        symbolic=gradient,
        autodiff=autodiff("glossy", "gradient"),
        fourier=fourier("gradient"),
        brute_force=Check(direction_sign, 1e-10),
        corrected="B_theta = -DV, read at theta_r",
        counterexample=Counterexample(
            {"x": 0.3, "theta": 0.1},
            printed=lambda x, theta: float(dense(x, theta, L=lambda x_, w: slope_w(bell, x_, w))),
            true=lambda x, theta: float(complex_step(dense, x, theta)[1]),
        ),
    ),
    *[
        Row(
            f"R07.fig4.{row}",
            "identity",
            implements=f"{MODULE}.Reflected.terms",
            symbolic=special_cases,
            autodiff=autodiff("flat" if "flat" in row else "glossy", "gradient"),
            fourier=two,
            brute_force=Check(functools.partial(term_error, row), 1e-10),
            note="At fixed direction, and without an exact cosine.",
        )
        for row in ("distant", "flat", "flat-envmap")
    ],
    _measured(
        "R07.fig4.overcast",
        overcast_order,
        0.05,
        "Order 1 in the sky's contrast, at bounded curvature: CDV = CV DV.",
    ),
    _measured("R07.fig4.near", near_order, 0.1, "SV is of order -1 in the distance of the light."),
    _measured(
        "R07.fig4.bump",
        bump_order,
        0.05,
        "B_x = CDV (1 + O(1 / n_x)) where DV is not zero; it fails where n_x vanishes.",
    ),
    Row(
        "R07.fig4.lambertian",
        "over-claim",
        implements="firstorder.transport.lobes.lambert",
        symbolic=diffuse_argument,
        autodiff=autodiff("diffuse", "hessian"),
        fourier=two,
        brute_force=brute("diffuse", "gradient"),
        corrected="B_x = SV + n_x DV with the lobe in n - omega (CV = n_x, not 2 n_x); B_theta = 0",
        counterexample=Counterexample(
            {"x": 0.3, "theta": 0.1},
            printed=printed_lambertian,
            true=lambda x, theta: float(complex_step(BRUTE["diffuse"], x, theta)[0]),
        ),
        note="A diffuse lobe turns once with the normal. SV is low-pass filtered like DV.",
    ),
    Row(
        "R07.fig4.mirror",
        "over-claim",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=isotropic_source,
        autodiff=Check(isotropic_by_autodiff, 1e-10),
        fourier=flatless,
        brute_force=Check(isotropic_error, 1e-10),
        corrected="|SV| / |CDV| does not depend on the lobe's width: a flat mirror has B_x = SV",
        counterexample=Counterexample(
            {"d": 2.0, "theta": 0.3},
            printed=lambda d, theta: 0.0 * d * theta,  # CDV of a flat surface
            true=flat_mirror,
        ),
    ),
    _measured(
        "R07.s5.2d",
        comparable_order,
        0.1,
        "Of the unfiltered light; that of SV and CDV differs by order 2 in the lobe's width.",
        f"{MODULE}.far_light_ratio",
    ),
    Row(
        "R07.s5.2e",
        "definition",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=na("definition"),
        autodiff=na("definition"),
        fourier=na("definition"),
        brute_force=na("definition"),
    ),
    Row(
        "R07.s5.2f",
        "misprint",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=isotropic_source,
        autodiff=Check(isotropic_by_autodiff, 1e-10),
        fourier=flatless,
        brute_force=Check(isotropic_error, 1e-10),
        corrected="L_x = -cos(w - n_0) / D L_theta, D along the ray; -cos(w)^2 / d L_theta if flat",
        counterexample=Counterexample(
            {"d": 2.0, "w": 0.6},
            printed=lambda d, w: float(slope_w(near(d), 0.3, w) / d),
            true=lambda d, w: float(slope_x(near(d), 0.3, w)),
        ),
        note=(
            "Exact for every emitter that shines equally in all directions. The sign makes SV and "
            "CDV cancel in a valley with n_x = cos(w)^2 / (2 d), which is focused on the source."
        ),
    ),
    Row(
        "R07.s5.2g",
        "over-claim",
        implements=f"{MODULE}.far_light_ratio",
        symbolic=isotropic_source,
        autodiff=Check(isotropic_by_autodiff, 1e-10),
        fourier=flatless,
        brute_force=Check(isotropic_error, 1e-10),
        corrected="cos(w)^2 / d << 2 |n_x|: as printed it is sufficient and, aslant, not necessary",
        counterexample=Counterexample(
            {"d": 2.0, "w": 1.2, "kappa": 0.5},
            printed=lambda d, w, kappa: 1.0 / (2.0 * d * kappa) + 0.0 * w,
            true=lambda d, w, kappa: abs(
                float(slope_x(near(d), 4.8, w) / (2.0 * kappa * slope_w(near(d), 4.8, w)))
            ),
        ),
        note="Both sides as the ratio |SV| / |CDV| of a mirror.",
    ),
    _measured(
        "R07.s5.2h",
        young,
        1e-3,
        "|L_theta (*) rho| <= sup |L| int |rho'| for any light (Young's inequality), searched.",
        "firstorder.transport.lobes.lambert",
    ),
]

# The paper prints no formula for these; tests/transport/test_shading.py runs the proofs.
UNNUMBERED = (exact_cosine, general_brdf)
