"""Integral over one coordinate: interior and boundary terms, slices, conditioned covariances.

R07 §3.1 and Fig. 2. The boundary terms are what R07 §6 calls visibility gradients.
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from derivations.laws.jets import gradient, hessian, taylor
from derivations.laws.multiply import haar
from derivations.squares import difference_error, parseval_error, square_error, transform_error
from firstorder.ledger import Check, Counterexample, Row, na

x, y, t, h = sp.symbols("x y theta h", real=True)
lower, upper = sp.symbols("lower upper", real=True)


def derivative_under_the_integral():
    """The coefficient of h in int f(x + h, theta) dtheta, f a generic Taylor series in h."""
    f0, f1, f2 = (sp.Function(f"f_{k}")(t) for k in range(3))
    shifted = f0 + h * f1 + h**2 / 2 * f2
    inside = sum(
        h**k * sp.Integral(sp.expand(shifted).coeff(h, k), (t, lower, upper)) for k in range(3)
    )
    return sp.diff(inside, h).subs(h, 0) - sp.Integral(f1, (t, lower, upper))


def slice_of_the_spectrum():
    """The exponent of the Fourier integral of `int f dtheta` is that of f's at Omega_theta = 0."""
    Ox, Ot = sp.symbols("Omega_x Omega_theta", real=True)
    of_integral = -2 * sp.pi * sp.I * Ox * x
    of_field = -2 * sp.pi * sp.I * (Ox * x + Ot * t)
    return of_integral - of_field.subs(Ot, 0)


def boundary_terms():
    """Integral between two generic curves of a generic light, differentiated twice at the origin.

    Both ends, the light and two other coordinates are generic Taylor polynomials about the point
    where each end starts, so this is every edge and every end there is.
    """
    u = (x, y)
    s = sp.symbols("s", real=True)
    results = []
    for sign in (1, -1):  # an upper end at b, a lower end at b
        b = taylor("b", u)
        b0 = b.subs({x: 0, y: 0})
        f = taylor("f", (x, y, s)).subs(s, t - b0)  # the light's jet at the end
        antiderivative = sp.integrate(sp.expand(f), t)
        whole = sign * (antiderivative.subs(t, b) - antiderivative.subs(t, 0))
        # interior terms up to the end where it stands
        interior = sign * (antiderivative.subs(t, b0) - antiderivative.subs(t, 0))
        at = {x: 0, y: 0, t: b0}
        J = sign * f.subs(at, simultaneous=True)
        Ji = sign * gradient(f, u, at)
        Jt = sign * sp.diff(f, t).subs(at, simultaneous=True)
        bi, bij = gradient(b, u), hessian(b, u)
        results.append(gradient(sp.expand(whole), u) - gradient(sp.expand(interior), u) - J * bi)
        rule = J * bij + Ji * bi.T + bi * Ji.T + Jt * bi * bi.T
        results.append(hessian(sp.expand(whole), u) - hessian(sp.expand(interior), u) - rule)
    return [sp.expand(e) for m in results for e in m]


def crossing_of_an_edge():
    """The curve of an edge from its level, by differentiating level(u, b(u)) = 0 twice."""
    u = (x, y)
    lev = taylor("l", (x, y, t))
    lev = lev - lev.subs({x: 0, y: 0, t: 0})  # the origin is on the edge
    zero = {x: 0, y: 0, t: 0}
    la = sp.diff(lev, t).subs(zero)
    first = -gradient(lev, u, zero) / la
    H = sp.hessian(lev, (x, y, t)).subs(zero)
    mixed = H[:2, 2] * first.T
    second = -(H[:2, :2] + mixed + mixed.T + H[2, 2] * first * first.T) / la
    b = sum(first[i] * u[i] for i in range(2)) + sum(
        second[i, j] * u[i] * u[j] / 2 for i in range(2) for j in range(2)
    )
    on_edge = sp.expand(lev.subs(t, b))
    return list(gradient(on_edge, u)) + list(hessian(on_edge, u))


def constant_along_the_axis():
    """Integral over a length T of sum_j F_j psi_j: all coefficients but the constant one drop out.

    For Haar, and for the wavelet filter of Daubechies' D4: a periodised wavelet has zero mean
    because its filter has, so "Haar only" is too narrow.
    """
    T = sp.symbols("T", positive=True)
    n = 8
    W = haar(n)
    cell = T / n
    F = sp.Matrix(sp.symbols("F:8", real=True))
    samples = W.T * F / sp.sqrt(cell)  # orthonormal in L2 of the interval
    integral = cell * sum(samples)
    r = sp.sqrt(3)
    low = [(1 + r), (3 + r), (3 - r), (1 - r)]
    wavelet = [low[3], -low[2], low[1], -low[0]]
    return sp.simplify(integral - sp.sqrt(T) * F[0]), sp.expand(sum(wavelet))


def schur_complement():
    """Second moment of exp(-Omega^T A Omega) on the line Omega_theta = 0, A = Sigma^-1 / 2.

    On that line the power falls off with A_xx, so its second moment is 1 / (2 A_xx).
    """
    a, b, c = sp.symbols("Sigma_xx Sigma_xt Sigma_tt", positive=True)
    S = sp.Matrix([[a, b], [b, c]])
    conditioned = 1 / S.inv()[0, 0]
    return sp.simplify(conditioned - (a - b * b / c))


def slice_theorem():
    """`move` and `integrate` chained: exponents of int int f(M (x, t)) exp(-2 pi i O x) dt dx."""
    m = sp.symbols("m11 m12 m21 m22", real=True)
    M = sp.Matrix([[m[0], m[1]], [m[2], m[3]]])
    Om, p, q = sp.symbols("Omega p q", real=True)
    before = M.inv() * sp.Matrix([p, q])  # (x, t) from (p, q) = M (x, t)
    direct = -2 * sp.pi * sp.I * Om * before[0]
    slanted = -2 * sp.pi * sp.I * ((M.inv().T * sp.Matrix([Om, 0])).T * sp.Matrix([p, q]))[0]
    area = before.jacobian([p, q]).det() - 1 / M.det()
    return sp.simplify(direct - slanted), sp.simplify(area)


SHEAR = np.array([[0.9, -0.5], [0.2, 1.1]])


def _slice_law():
    from firstorder.checks.cases import light
    from firstorder.laws import Integrate, Move

    return Integrate("theta", -7.0, 7.0, 128), Move(SHEAR), light()


def slice_by_transform() -> float:
    """The theorem's right side against a discrete transform of the integrated, moved light."""
    import jax.numpy as jnp

    from firstorder.checks.tolerance import normwise
    from firstorder.fields import Grid, discrete_transform

    integrate, move, f = _slice_law()
    grid, Omega = Grid.spanning((97,), (6.0,)), np.array([-0.45, -0.1, 0.0, 0.33])
    samples = grid.sample(integrate(move(f)))
    line = np.linalg.inv(SHEAR).T @ np.stack([Omega, 0.0 * Omega])
    slanted = f.spectrum()(*line) / abs(np.linalg.det(SHEAR))
    chained = integrate(move(f.spectrum()))(jnp.asarray(Omega))
    found = discrete_transform(samples, grid, Omega)
    return max(normwise(slanted, found), normwise(chained, found))


def slice_by_sums() -> float:
    """The same against sums over both coordinates in NumPy, and no law at all."""
    from firstorder.checks.cases import bell
    from firstorder.checks.tolerance import normwise

    f = _slice_law()[2]
    axis = np.linspace(-6.0, 6.0, 61)
    rays = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1) @ SHEAR.T
    values = np.array([[bell(*u) for u in row] for row in rays]) * (axis[1] - axis[0]) ** 2
    Omega = np.array([-0.45, 0.0, 0.33])
    found = np.exp(-2j * np.pi * np.outer(Omega, axis)) @ values.sum(axis=1)
    line = np.linalg.inv(SHEAR).T @ np.stack([Omega, 0.0 * Omega])
    return normwise(f.spectrum()(*line) / abs(np.linalg.det(SHEAR)), found)


@functools.cache
def _haar_of_a_bell(T: float) -> tuple[float, float]:
    """Constant coefficient of exp(-theta^2) on an interval of length T, and its integral."""
    from scipy.integrate import quad

    cells = np.linspace(-T / 2, T / 2, 33)
    parts = np.array([quad(lambda s: np.exp(-s * s), *ends)[0] for ends in zip(cells, cells[1:])])  # noqa: B905, RUF007
    chi = np.full(32, 1.0 / np.sqrt(T))  # the constant basis function, of norm 1
    return float(chi @ parts), quad(lambda s: np.exp(-s * s), -T / 2, T / 2)[0]


ROWS = [
    Row(
        "R07.3",
        "identity",
        implements="firstorder.laws.integrate.Integrate.jet",
        symbolic=derivative_under_the_integral,
        autodiff=Check(lambda: square_error("integrate", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("integrate", "gradient"), 1e-8),
        note="For ends that stand still and light without moving edges; otherwise "
        "C.integrate.boundary.",
    ),
    Row(
        "R07.fig2.integrate.primal",
        "definition",
        implements="firstorder.laws.integrate.Integrate.value",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: square_error("integrate", "value"), 1e-10),
    ),
    Row(
        "R07.fig2.integrate.gradient",
        "identity",
        implements="firstorder.laws.integrate.Integrate.jet",
        symbolic=derivative_under_the_integral,
        autodiff=Check(lambda: square_error("integrate", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("integrate", "gradient"), 1e-8),
        note="For ends that stand still and light without moving edges; otherwise "
        "C.integrate.boundary.",
    ),
    Row(
        "R07.fig2.integrate.fourier",
        "identity",
        implements="firstorder.laws.integrate.Integrate.spectrum",
        symbolic=slice_of_the_spectrum,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("integrate", "spectrum"), 1e-9),
        brute_force=Check(lambda: transform_error("integrate, an edge"), 1e-9),
        note="Also for light with an edge that moves: the second route.",
    ),
    Row(
        "R07.fig2.integrate.wavelet",
        "over-claim",
        implements="firstorder.laws.integrate.Integrate.wavelet",
        symbolic=constant_along_the_axis,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: square_error("integrate", "wavelet"), 1e-10),
        corrected="H_i = sqrt(T) F_i0 on an axis of length T, for every orthonormal tensor basis "
        "whose first function is constant along it: Haar, or any periodised wavelet",
        counterexample=Counterexample(
            {"T": 9.0},
            printed=lambda T: _haar_of_a_bell(T)[0],
            true=lambda T: _haar_of_a_bell(T)[1],
        ),
        note="Too narrow (not Haar only), and right as printed only for T = 1. It needs the tensor "
        "(standard) decomposition.",
    ),
    Row(
        "C.integrate.boundary",
        "identity",
        implements="firstorder.laws.integrate.Integrate.jet",
        symbolic=lambda: (boundary_terms(), crossing_of_an_edge()),
        autodiff=Check(
            lambda: max(
                square_error(case, portrait)
                for case in ("integrate, an edge", "integrate, moving ends")
                for portrait in ("gradient", "hessian")
            ),
            1e-10,
        ),
        fourier=Check(lambda: square_error("integrate, an edge", "spectrum"), 1e-9),
        brute_force=Check(
            lambda: max(
                difference_error(case, portrait)
                for case in ("integrate, an edge", "integrate, moving ends")
                for portrait in ("gradient", "hessian")
            ),
            1e-8,
        ),
        note="An edge is the zero set of a level; its curve has the derivatives of Edge.crossing.",
    ),
    Row(
        "C.integrate.covariance",
        "identity",
        implements="firstorder.laws.integrate.Integrate.covariance",
        symbolic=schur_complement,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("integrate", "covariance"), 1e-9),
        brute_force=Check(lambda: parseval_error("integrate", 81), 1e-9),
        note="For Gaussians.",
    ),
    Row(
        "C.slice",
        "identity",
        implements="firstorder.laws.integrate.Integrate.spectrum",
        symbolic=slice_theorem,
        autodiff=na("spectral"),
        fourier=Check(slice_by_transform, 1e-9),
        brute_force=Check(slice_by_sums, 1e-9),
        note="Ng 2005 for photographs; here a chain of two laws.",
    ),
]
