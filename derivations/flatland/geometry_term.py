"""The geometry term of flatland, its gradient and its Hessian: J12 (26), (38) and (49).

Every proof starts from the angle that a moving point subtends. The paper measures angles towards
+x and writes y for the vector from x to y; neither shows in (26), (38) and (49), which are vectors.
"""

from __future__ import annotations

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.ledger import Check, Row, na

X = sp.Matrix(sp.symbols("x1 x2", real=True))
Y = sp.Matrix(sp.symbols("y1 y2", real=True))
NX = sp.Matrix(sp.symbols("a1 a2", real=True))
NY = sp.Matrix(sp.symbols("b1 b2", real=True))

P = Y - X
R = sp.sqrt(P.dot(P))
COS_X, COS_Y = NX.dot(P) / R, -NY.dot(P) / R
I2 = sp.eye(2)


def grad(f):
    """Gradient by x, of the unexpanded definition."""
    return sp.Matrix([sp.diff(f, c) for c in X])


def jacobian(v):
    """Rows are components, columns are coordinates of x."""
    return sp.Matrix(v).jacobian(list(X))


# --- from the angle to the geometry term --------------------------------------------------------


def subtended():
    """(26): the polar angle of a point that runs along a curve, as a function of arc length.

    Both a straight curve and one of curvature c are followed: only the tangent matters at l = 0.
    """
    length, c, slope = sp.symbols("l c phi", real=True)
    tangent = sp.Matrix([sp.cos(slope), sp.sin(slope)])
    normal = sp.Matrix([-tangent[1], tangent[0]])  # left of the direction of travel
    out = []
    for bend in (0, c):
        at = Y + length * tangent + bend * length**2 / 2 * normal
        rate = sp.diff(sp.atan2(at[1], at[0]), length).subs(length, 0)
        r = sp.sqrt(Y.dot(Y))
        out.append(sp.simplify(rate - (-normal.dot(Y) / r) / r))
    return out


def term():
    """The definition, `cos_x dtheta/dl`, is `-(n_x . p)(n_y . p) / r^3`, and it is symmetric.

    When the two points change places, (n_x, n_y, p) become (n_y, n_x, -p).
    """
    G = COS_X * COS_Y / R
    swap = dict(zip([*X, *Y, *NX, *NY], [*Y, *X, *NY, *NX], strict=True))
    return [
        *subtended(),
        sp.simplify(G + NX.dot(P) * NY.dot(P) / R**3),
        sp.simplify(G - G.subs(swap, simultaneous=True)),
    ]


def gradient():
    """(38) from the definition."""
    printed = 3 * COS_X * COS_Y / R**3 * P - COS_Y / R**2 * NX + COS_X / R**2 * NY
    return sp.simplify(grad(COS_X * COS_Y / R) - printed)


def hessian():
    """(49) from the definition, differentiated twice."""
    printed = (
        15 * COS_X * COS_Y / R**5 * P * P.T
        - 3 * COS_X * COS_Y / R**3 * I2
        - (NX * NY.T + NY * NX.T) / R**3
        - 3 * COS_Y / R**4 * (NX * P.T + P * NX.T)
        + 3 * COS_X / R**4 * (NY * P.T + P * NY.T)
    )
    return sp.simplify(jacobian(grad(COS_X * COS_Y / R)) - printed)


def curved_neighbours():
    """Two points of a circle of curvature k: `G = k^2 r / 4`, which vanishes with r."""
    t, k = sp.symbols("t k", positive=True)
    at = sp.Matrix([sp.sin(t), 1 - sp.cos(t)]) / k
    inward = sp.Matrix([-sp.sin(t), sp.cos(t)])
    r2 = sp.simplify(at.dot(at))
    cosines = -sp.Matrix([0, 1]).dot(at) * inward.dot(at)
    return sp.simplify(cosines / r2 - k**2 * r2 / 4)


# --- numbers ------------------------------------------------------------------------------------

# Facing pairs, in no special position: x, angle of n_x, y, angle of n_y (conventions: Flatland).
PAIRS = (
    ((0.3, -0.2), 0.4, (-0.5, 1.1), 3.3),
    ((0.0, 0.0), 0.0, (0.9, 0.7), 2.2),
    ((-1.2, 0.4), -1.0, (0.6, 1.5), 2.0),
)


def up(angle):
    """A normal."""
    return np.array([-np.sin(angle), np.cos(angle)])


def subtended_numerically(pair, shift=(0.0, 0.0)):
    """G as a difference quotient of polar angles, 40 digits: only `atan2` and a dot product."""
    x, a, y, b = pair
    with mp.workdps(40):
        px, py = (mp.mpf(y[i]) - mp.mpf(x[i]) - shift[i] for i in (0, 1))
        along = (mp.cos(b), mp.sin(b))  # the tangent whose left is the normal

        def polar(step):
            return mp.atan2(py + step * along[1], px + step * along[0])

        h = mp.mpf(10) ** -14
        rate = (polar(h) - polar(-h)) / (2 * h)
        return (-mp.sin(a) * px + mp.cos(a) * py) / mp.sqrt(px**2 + py**2) * rate


def differences(pair, order):
    """Derivatives of that by x: central differences with 40 digits."""
    with mp.workdps(40):
        h = mp.mpf(10) ** -6
        f = {
            (i, j): subtended_numerically(pair, (i * h, j * h))
            for i in (-1, 0, 1)
            for j in (-1, 0, 1)
        }
        if order == 1:
            d = [f[1, 0] - f[-1, 0], f[0, 1] - f[0, -1]]
            return np.array([float(v / (2 * h)) for v in d])
        cross = (f[1, 1] - f[1, -1] - f[-1, 1] + f[-1, -1]) / 4
        dd = [[f[1, 0] - 2 * f[0, 0] + f[-1, 0], cross], [cross, f[0, 1] - 2 * f[0, 0] + f[0, -1]]]
        return np.array([[float(v / h**2) for v in row] for row in dd])


def brute_force(order) -> float:
    """The library against the differences, all pairs."""
    from firstorder.checks.tolerance import normwise
    from firstorder.flatland._geometry_term import geometry_jet

    worst = 0.0
    for pair in PAIRS:
        x, a, y, b = pair
        ours = geometry_jet(np.array(x), up(a), np.array(y), up(b))[order]
        truth = float(subtended_numerically(pair)) if order == 0 else differences(pair, order)
        worst = max(worst, normwise(np.asarray(ours), np.asarray(truth)))
    return worst


def autodiff(order) -> float:
    """The library's closed forms against derivatives of its value."""
    import jax

    from firstorder.checks.tolerance import normwise
    from firstorder.flatland._geometry_term import geometry_jet, geometry_term

    x, a, y, b = (np.array(c) for c in zip(*PAIRS, strict=True))
    n, m = (np.stack([-np.sin(c), np.cos(c)], -1) for c in (a, b))
    derivative = jax.grad(geometry_term) if order == 1 else jax.hessian(geometry_term)
    truth = jax.jit(jax.vmap(derivative))(x, n, y, m)
    return normwise(geometry_jet(x, n, y, m)[order], truth)


def angle_by_length() -> float:
    """(26) by autodiff: `dtheta/dl` as the derivative of the polar angle."""
    import jax
    import jax.numpy as jnp

    from firstorder.flatland._geometry_term import geometry_term

    worst = 0.0
    for x, a, y, b in PAIRS:
        p = np.subtract(y, x)
        along = np.array([np.cos(b), np.sin(b)])
        rate = jax.grad(
            lambda s, p=p, along=along: jnp.arctan2(p[1] + s * along[1], p[0] + s * along[0])
        )(0.0)
        truth = up(a) @ p / np.hypot(*p) * rate
        ours = geometry_term(np.array(x), up(a), np.array(y), up(b))
        worst = max(worst, float(abs(ours - truth) / truth))
    return worst


GRADIENT = {"implements": "firstorder.flatland._geometry_term.geometry_gradient"}
HESSIAN = {"implements": "firstorder.flatland._geometry_term.geometry_hessian"}

ROWS = [
    Row(
        "J12.26",
        "identity",
        implements="firstorder.flatland._geometry_term.geometry_term",
        symbolic=lambda: [*term(), curved_neighbours()],
        autodiff=Check(angle_by_length, 1e-13),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_force(0), 1e-13),
        note="The two cosines are of one sign only between facing sides; zero otherwise, and at 0.",
    ),
    Row(
        "J12.38",
        "identity",
        **GRADIENT,
        symbolic=gradient,
        autodiff=Check(lambda: autodiff(1), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_force(1), 1e-9),
        note="A translation: both normals are held fixed.",
    ),
    Row(
        "J12.49",
        "identity",
        **HESSIAN,
        symbolic=hessian,
        autodiff=Check(lambda: autodiff(2), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_force(2), 1e-9),
    ),
]
