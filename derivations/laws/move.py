"""Linear change of coordinates, from the definitions of derivative and Fourier transform.

R07 §3.1 and App. A. The symbolic proofs start from a generic smooth f and from the Fourier integral
of a generic (correlated, off-centre) Gaussian, and never from the printed result.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.laws.jets import gradient, hessian, taylor
from derivations.squares import (
    difference_error,
    parseval_error,
    refusal,
    square_error,
    transform_error,
)
from firstorder.ledger import Check, Counterexample, Row, na

m11, m12, m21, m22, c1, c2, x, t = sp.symbols("m11 m12 m21 m22 c1 c2 x theta", real=True)
M = sp.Matrix([[m11, m12], [m21, m22]])
c = sp.Matrix([c1, c2])
u = sp.Matrix([x, t])
f = sp.Function("f")
p, q = sp.symbols("p q", real=True)


def gradient_of_the_composition():
    """D f(M u + c) / du by the limit that sympy calls diff, minus M^T grad f."""
    v = M * u + c
    h = f(v[0], v[1])
    left = sp.Matrix([h.diff(x), h.diff(t)]).doit()
    partial = sp.Matrix([f(p, q).diff(p), f(p, q).diff(q)])
    right = M.T * partial.subs({p: v[0], q: v[1]}, simultaneous=True)
    # sympy keeps the derivatives of f as Subs objects: compare on a generic analytic f instead too
    g = sp.exp(p * q) + p**3 * sp.sin(q)
    k = g.subs({p: v[0], q: v[1]}, simultaneous=True)
    grad = sp.Matrix([g.diff(p), g.diff(q)]).subs({p: v[0], q: v[1]}, simultaneous=True)
    analytic = sp.Matrix([k.diff(x), k.diff(t)]) - M.T * grad
    return list((left - right).applyfunc(lambda e: sp.simplify(e.doit()))), list(analytic)


def spectrum_of_the_composition():
    """The Fourier integral of f(M u + c) by the substitution v = M u + c, against R07 (54).

    The substitution turns `Omega . u` into `Omega . M^-1 (v - c)` and du into dv / |det M|; what is
    left is F at M^-T Omega times a phase, for every f.
    """
    o1, o2, v1, v2 = sp.symbols("Omega_1 Omega_2 v1 v2", real=True)
    Omega, v = sp.Matrix([o1, o2]), sp.Matrix([v1, v2])
    exponent = -2 * sp.pi * sp.I * (Omega.T * (M.inv() * (v - c)))[0]
    phase = 2 * sp.pi * sp.I * (Omega.T * M.inv() * c)[0]
    kernel = -2 * sp.pi * sp.I * ((M.inv().T * Omega).T * v)[0]
    jacobian = sp.Matrix(M.inv() * (v - c)).jacobian(v).det() * M.det() - 1
    return sp.simplify(exponent - phase - kernel), sp.simplify(jacobian)


def hessian_of_the_composition():
    """The quadratic part of f(M u + c), f a generic Taylor polynomial about c."""
    g = taylor("f", (p, q))
    moved = M * u
    h = g.subs({p: moved[0], q: moved[1]}, simultaneous=True)
    return hessian(sp.expand(h), (x, t)) - M.T * hessian(g, (p, q)) * M


def chain_of_partial_derivatives():
    """`dh/du_i = sum_k f_k M_ki` from h(u) = f(v), v = M u, on the same generic light."""
    g = taylor("f", (p, q))
    moved = M * u
    h = g.subs({p: moved[0], q: moved[1]}, simultaneous=True)
    f_k = gradient(g, (p, q))
    left = gradient(sp.expand(h), (x, t))
    return [left[i] - sum(f_k[k] * M[k, i] for k in range(2)) for i in range(2)]


def covariance_of_the_composition():
    """Where energy goes: H's argument is pulled back by M^-T, so the energy at W moves to M^T W.

    In `int O O^T |H(O)|^2 dO`, substitute O = M^T W; the constant |det M| drops out of the ratio.
    """
    w1, w2 = sp.symbols("W_1 W_2", real=True)
    W = sp.Matrix([w1, w2])
    O_of_W = M.T * W
    argument = M.inv().T * O_of_W - W
    moments = O_of_W * O_of_W.T - M.T * (W * W.T) * M
    return [sp.simplify(e) for e in argument], [sp.expand(e) for e in moments]


def ray_differentials_of_travel():
    """Geometry of the incoming ray that meets the line y = d, once labelled there.

    It comes from direction (-v, 1) (times a length): the point (x, 0) looks along it, so on the
    line at height d it passes x - v d. The Jacobian of the ray there by the ray here is the move's
    matrix.
    """
    v, d, s = sp.symbols("v d s", real=True)
    point = sp.Matrix([x, 0]) + s * sp.Matrix([-v, 1])
    met = point.subs(s, sp.solve(point[1] - d, s)[0])
    J = sp.Matrix([met[0], v]).jacobian([x, v])
    shear = sp.Matrix([[1, -d], [0, 1]])
    # composition: the differentials of two steps multiply, first step innermost
    d2 = sp.symbols("d_2", real=True)
    twice = shear.subs(d, d2) * shear - shear.subs(d, d + d2)
    return list(J - shear), list(twice)


def _differentials() -> float:
    """Autodiff of the traced ray against the matrices of travel, curvature and their chain."""
    import jax
    import jax.numpy as jnp

    from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, direction
    from firstorder.transport import Curvature, Travel

    def before_travel(ray):
        """Meet the line y = 0.8 in the plane, and label the ray there."""
        start, along = jnp.stack([ray[0], 0.0]), direction(jnp.arctan(ray[1]))
        hit = start + along * (0.8 / along[1])
        return jnp.stack([hit[0], -along[0] / along[1]])

    def before_rotation(ray):
        """The global angle of a ray labelled in the frame of a normal at angle 0.3 x."""
        along = direction(ray[1] + 0.3 * ray[0])
        return jnp.stack([ray[0], jnp.arctan2(-along[0], along[1])])

    ray = jnp.array([0.3, 0.4])
    travel = jax.jacfwd(before_travel)(ray) - Travel(0.8).law(FLATLAND_SLOPE).M
    turn = jax.jacfwd(before_rotation)(ray) - Curvature(0.3).law(FLATLAND).M
    return float(jnp.max(jnp.abs(jnp.stack([travel, turn]))))


def _traced_differences() -> float:
    """The same by differences of rays traced in plain NumPy."""
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.transport import Travel

    def before(ray):
        a = np.arctan(ray[1])
        along = np.array([-np.sin(a), np.cos(a)])
        hit = np.array([ray[0], 0.0]) + along * (0.8 / along[1])
        return np.array([hit[0], np.tan(np.arctan2(-along[0], along[1]))])

    ray, h = np.array([0.3, 0.4]), 1e-3
    columns = [(before(ray + h * e) - before(ray - h * e)) / (2 * h) for e in np.eye(2)]
    return float(np.max(np.abs(np.stack(columns, 1) - Travel(0.8).law(FLATLAND_SLOPE).M)))


def _adaptive_integral() -> float:
    """R07 (54) against adaptive quadrature of the Fourier integral, a route of its own."""
    from scipy.integrate import dblquad

    from firstorder.checks.cases.laws.move import brute
    from firstorder.checks.registry import all_cases

    Omega = np.array([0.31, -0.27])

    def part(function):
        return dblquad(
            lambda t, x: brute((x, t)) * function(2.0 * np.pi * (Omega[0] * x + Omega[1] * t)),
            -6.0, 6.0, -6.0, 6.0, epsabs=1e-11, epsrel=1e-11,
        )[0]  # fmt: skip

    case = all_cases()["move"]
    ours = complex(case.step(case.field.spectrum())(*Omega))
    return abs(ours - (part(np.cos) - 1j * part(np.sin)))


def haar_under_flips_and_exchange() -> float:
    """Where a move has a simple wavelet formula: flips of an axis and exchange of the axes.

    A flip permutes Haar coefficients and changes signs (`W P W^T` has one entry of +-1 per row), an
    exchange transposes them.
    """
    from firstorder.checks.cases import light
    from firstorder.checks.tolerance import normwise
    from firstorder.fields import Grid, Wavelet
    from firstorder.fields._haar import haar_matrix
    from firstorder.laws import Move

    grid = Grid.spanning((16, 16), (2.0, 2.0))
    f, H = light(), haar_matrix(16)
    F = np.asarray(Wavelet.of(f, grid).coefficients)
    flip = H @ np.eye(16)[::-1] @ H.T
    permuted = np.sort(np.abs(flip), axis=1)[:, :-1].max()  # nothing but one entry per row
    flipped = Wavelet.of(Move(np.diag([1.0, -1.0]))(f), grid).coefficients
    exchanged = Wavelet.of(Move(np.eye(2)[::-1])(f), grid).coefficients
    return max(float(permuted), normwise(F @ flip.T, flipped), normwise(F.T, exchanged))


def _bell_of(u0, u1):
    from firstorder.checks.cases import bell

    return bell(0.9 * u0 - 0.6 * u1, 0.3 * u0 + 1.1 * u1)


def _sampled_transform() -> float:
    """`discrete_transform`, against sums of the definition in NumPy."""
    from firstorder.checks.tolerance import normwise
    from firstorder.fields import Grid, discrete_transform

    grid = Grid((7, 6), (0.3, 0.2), (0.1, -0.4))
    rng = np.random.default_rng(0)
    samples, Om = rng.normal(size=(7, 6)), (np.array([0.3, -0.8]), np.array([0.0, 0.5, 1.1]))
    a, b = (c + (np.arange(n) - (n - 1) / 2) * h for n, h, c in
            zip(grid.size, grid.step, grid.center, strict=True))  # fmt: skip
    found = [
        [np.sum(samples * np.exp(-2j * np.pi * (o * a[:, None] + w * b))) * 0.06 for w in Om[1]]
        for o in Om[0]
    ]
    return normwise(discrete_transform(samples, grid, *Om), np.array(found))


GRADIENT = {
    "implements": "firstorder.laws.move.Move.jet",
    "symbolic": gradient_of_the_composition,
    "autodiff": Check(lambda: square_error("move", "gradient"), 1e-10),
    "fourier": na("no spectrum"),
    "brute_force": Check(lambda: difference_error("move", "gradient"), 1e-8),
}
SPECTRUM = {
    "implements": "firstorder.laws.move.Move.spectrum",
    "symbolic": spectrum_of_the_composition,
    "autodiff": na("spectral"),
    "fourier": Check(lambda: square_error("move", "spectrum"), 1e-9),
}
PRIMAL = {
    "implements": "firstorder.laws.move.Move.value",
    "symbolic": na("definition"),
    "autodiff": na("no derivative"),
    "fourier": na("no spectrum"),
    "brute_force": Check(lambda: square_error("move", "value"), 1e-10),
}

ROWS = [
    Row("R07.5", "definition", **PRIMAL),
    Row(
        "R07.6",
        "identity",
        **SPECTRUM,
        brute_force=Check(lambda: transform_error("move", 6.0, 61), 1e-9),
        note="M must be invertible, which gradients do not need.",
    ),
    Row("R07.7", "identity", **GRADIENT),
    Row("R07.fig2.move.primal", "definition", **PRIMAL),
    Row("R07.fig2.move.gradient", "identity", **GRADIENT),
    Row(
        "R07.fig2.move.fourier",
        "identity",
        **SPECTRUM,
        brute_force=Check(lambda: transform_error("move", 6.0, 61), 1e-9),
    ),
    Row(
        "R07.fig2.move.wavelet",
        "definition",
        implements="firstorder.laws.move.Move",
        symbolic=na("refusal"),
        autodiff=na("refusal"),
        fourier=na("refusal"),
        brute_force=Check(
            lambda: max(refusal("move", "wavelet"), haar_under_flips_and_exchange()), 1e-12
        ),
        note="Refused in general, and tested. Two special cases have a formula, measured here: a "
        "flip of an axis permutes Haar coefficients with signs, an exchange of axes transposes "
        "them.",
    ),
    Row(
        "R07.52",
        "definition",
        implements="firstorder.fields.spectrum.discrete_transform",
        symbolic=na("definition"),
        autodiff=na("spectral"),
        fourier=na("definition"),
        brute_force=Check(_sampled_transform, 1e-13),
        note="Cycles per unit, no prefactor (conventions, Fourier).",
    ),
    Row(
        "R07.53",
        "identity",
        **SPECTRUM,
        brute_force=Check(lambda: transform_error("move", 6.0, 61), 1e-9),
    ),
    Row("R07.54", "identity", **SPECTRUM, brute_force=Check(_adaptive_integral, 1e-9)),
    Row(
        "R07.55",
        "misprint",
        implements="firstorder.laws.move.Move.push",
        symbolic=chain_of_partial_derivatives,
        autodiff=Check(lambda: square_error("move", "gradient"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("move", "gradient"), 1e-8),
        corrected="h(u) = f(v), v_i = sum_j M_ij u_j => dh/du_i = sum_k df/dv_k M_ki",
        counterexample=Counterexample(
            {"u0": 0.3, "u1": -0.2},
            printed=lambda u0, u1: 0.9 * u0 - 0.6 * u1,
            true=_bell_of,
        ),
        note="The print equates f(v_i) with the coordinate sum_j M_ij u_j; the inputs are a ray at "
        "which a bell seen through M is no such sum. u and v have changed roles since (52). The "
        "conclusion is right.",
    ),
    Row(
        "C.move.hessian",
        "identity",
        implements="firstorder.laws.move.Move.push",
        symbolic=hessian_of_the_composition,
        autodiff=Check(lambda: square_error("move", "hessian"), 1e-10),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: difference_error("move", "hessian"), 1e-8),
    ),
    Row(
        "C.move.covariance",
        "identity",
        implements="firstorder.laws.move.Move.covariance",
        symbolic=covariance_of_the_composition,
        autodiff=na("spectral"),
        fourier=Check(lambda: square_error("move", "covariance"), 1e-9),
        brute_force=Check(lambda: parseval_error("move", 61), 1e-9),
        note="A point of energy moves by M^T; the argument of a spectrum is pulled back by M^-T.",
    ),
    Row(
        "C.differentials",
        "identity",
        implements="firstorder.transport.events.travel.Travel",
        symbolic=ray_differentials_of_travel,
        autodiff=Check(_differentials, 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(_traced_differences, 1e-10),
        note="Igehy 1999. The matrices of a chain multiply in the order in which a ray is traced "
        "back, which is the reverse of the light's.",
    ),
]
