"""Proofs for shading behind blockers: Leibniz's rule, and steps against test functions."""

from __future__ import annotations

import sympy as sp

x, theta, omega, a, b = sp.symbols("x theta omega a b", real=True)
alpha = sp.Function("alpha")(x)


def _at_edge(expression):
    """A derivative of T or L, taken first and then read at the edge."""
    return expression.subs(omega, alpha).doit()


def leibniz(order: str):
    """Derivatives of B = int_a^alpha T domega, a visible piece whose end moves: sign +1.

    A piece that begins at an edge is minus this with the same ends, sign -1, and any visibility
    is a sum of such pieces. T is a product of three functions, of which every T is a limit of
    sums; sympy then writes each derivative in one way only.
    """
    T = sp.Mul(*(sp.Function(f"T{c}")(c) for c in (x, theta, omega)))
    B = sp.Integral(T, (omega, a, alpha))
    ax, axx = alpha.diff(x), alpha.diff(x, 2)

    def inside(*by):
        return sp.Integral(T.diff(*by), (omega, a, alpha))

    wanted = {
        "x": inside(x) + _at_edge(T) * ax,
        "theta": inside(theta),
        "xx": inside(x, 2)
        + 2 * _at_edge(T.diff(x)) * ax
        + _at_edge(T.diff(omega)) * ax**2
        + _at_edge(T) * axx,
        "xtheta": inside(x, theta) + _at_edge(T.diff(theta)) * ax,
        "thetatheta": inside(theta, 2),
    }
    by = {"x": (x,), "theta": (theta,), "xx": (x, x), "xtheta": (x, theta)}
    found = B.diff(*by.get(order, (theta, theta)))
    return sp.simplify((found - wanted[order]).doit())


def product_rule():
    """(31) as a distribution in x: with any test function f, int f L V = int_a^alpha f L."""
    L, f = sp.Function("L")(x, omega), sp.Function("f")(omega)
    weighed = sp.Integral(f * L, (omega, a, alpha)).diff(x)
    smooth = sp.Integral(f * L.diff(x), (omega, a, alpha))
    step = _at_edge(f) * _at_edge(L) * alpha.diff(x)  # int f L delta(alpha - omega) alpha_x
    # In omega: - int f_omega L V = int f L_omega V - f L at the edge, and f vanishes at the end a.
    g = sp.Function("g")(omega)
    parts = (g * f).diff(omega) - g.diff(omega) * f - g * f.diff(omega)
    return sp.simplify((weighed - smooth - step).doit()), sp.simplify(parts)


def step_derivatives():
    """(34): against any test function, d/dx int f H(alpha - omega) = f(alpha) alpha_x.

    And - int f_omega H(alpha - omega) = -f(alpha) + f(a), f zero at the far end a.
    """
    f = sp.Function("f")
    weighed = sp.Integral(f(omega), (omega, a, alpha))
    dx = weighed.diff(x) - f(alpha) * alpha.diff(x)
    slope = -sp.integrate(f(omega).diff(omega), (omega, a, alpha)) + f(alpha) - f(a)
    return sp.simplify(dx), sp.simplify(slope.doit())


def by_parts():
    """B_theta = int L rho' for T = L(omega) rho(theta - omega): what (35) needs beside it."""
    L, rho, t = sp.Function("L"), sp.Function("rho"), sp.Symbol("t")
    T = L(omega) * rho(theta - omega)
    # d/domega of T = L_omega rho - L rho', so that rho' L = L_omega rho - dT/domega.
    slope = rho(t).diff(t).subs(t, theta - omega)
    moved = L(omega) * slope - (L(omega).diff(omega) * rho(theta - omega) - T.diff(omega))
    return sp.simplify(moved.doit()), sp.simplify((T.diff(theta) - L(omega) * slope).doit())


def bounded_turn():
    """The bound of footnote 3's correction: |B_x^V| <= sum |T| cos / D, finite while D > 0.

    cos(alpha) / D = y / (y^2 + (x - p)^2) is at most 1 / y over all receivers, y the height.
    """
    y, t = sp.symbols("y t", positive=True)
    rate = y / (y**2 + t**2)
    return [sp.simplify(1 / y - rate - t**2 / (y * (y**2 + t**2)))]


def edges_alone():
    """§6.2: what moving does to light before a slab that leans by beta, and a mean of 1 / D.

    The slab ends at the height y over the place p and hides all directions beyond. By the edge's
    own geometry B_x is T cos(alpha) / D there, of which |T| / D is a bound: the lean is in
    neither. It is in the mean of 1 / D over directions, measured along each to where it meets.
    """
    p, lean, turn = sp.symbols("p beta turn", real=True)
    y, along = sp.symbols("y along", positive=True)
    T = sp.Function("T")(x, omega)
    seen, D = sp.atan((x - p) / y), sp.sqrt(y**2 + (x - p) ** 2)
    moved = sp.Integral(T, (omega, a, seen)).diff(x) - sp.Integral(T.diff(x), (omega, a, seen))
    jump = T.subs(omega, seen) * sp.cos(seen) / D
    slack = 1 / D**2 - (sp.cos(seen) / D) ** 2 - ((x - p) / D**2) ** 2
    # Below the end: a point of the slab is met where (along direction - end) is across its normal.
    miss = sp.Matrix([-sp.sin(turn) * along, sp.cos(turn) * along - y])
    (met,) = sp.solve(miss.dot(sp.Matrix([sp.sin(lean), sp.cos(lean)])), along)
    mean = sp.integrate(sp.expand_trig(1 / met).expand(), (turn, 0, b))
    by_hand = (sp.sin(b) - (1 - sp.cos(b)) * sp.tan(lean)) / y
    return [sp.simplify(e) for e in (moved - jump, slack, mean - by_hand)]
