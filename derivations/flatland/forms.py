"""Derivatives of irradiance in arc-length and stratified form: J12 (35)-(48), (50) and (51).

Proofs are in the paper's angles, towards +x, with the receiver at (x, 0) and its normal along +y;
the library's angles turn the other way, so that its differences across borders have the other sign.
References are the irradiances of `_scenes`, differenced with 30 digits.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np
import sympy as sp

from derivations.flatland import _scenes as scenes
from derivations.flatland.geometry import subtended
from derivations.flatland.radiometry import light_overhead
from derivations.ledger import Check, Counterexample, Row, na

x, y, a, b, e1, A = sp.symbols("x y a b e1 A", real=True)
h, e2, R = sp.symbols("h e2 R", positive=True)
c0, c1 = sp.symbols("c0 c1", real=True)


def distance(p, height):
    return sp.sqrt((p - x) ** 2 + height**2)


def sine(p, height):
    return (p - x) / distance(p, height)


def cosine(p, height):
    return height / distance(p, height)


# --- arc length -----------------------------------------------------------------------------------


def product_rule():
    """(36): V is a step at the shadow edge s(x), so that the middle term is `-L G ds/dx` there.

    The light runs from the edge, which a blocker's end (e1, e2) throws onto the height h, to A.
    """
    edge = x + (e1 - x) * h / e2
    G = h**2 / distance(y, h) ** 3
    antiderivative = sine(y, h)
    moved = sp.diff(antiderivative, x)  # of int dG/dx dy: the integral of G is the sine
    interior = moved.subs(y, A) - moved.subs(y, edge)
    boundary = -G.subs(y, edge) * sp.diff(edge, x)
    whole = sp.diff(antiderivative.subs(y, A) - antiderivative.subs(y, edge), x)
    return sp.simplify(sp.diff(antiderivative, y) - G), sp.simplify(whole - interior - boundary)


def frozen(order):
    """(37), (48) without shadows: a light with fixed ends, `int d^k G / dx^k dy`, by its sine."""
    G = h**2 / distance(y, h) ** 3
    E = sine(b, h) - sine(a, h)
    inside = sp.diff(sine(y, h), x, order)
    return [
        sp.simplify(sp.diff(inside, y) - sp.diff(G, x, order)),
        sp.simplify(sp.diff(E, x, order) - inside.subs(y, b) + inside.subs(y, a)),
    ]


# --- strata ---------------------------------------------------------------------------------------


@functools.cache
def summed_by_parts():
    """(43) to (44) for five sectors, L being zero outside them; and (41) for an unknown light."""
    L = [0, *sp.symbols("L1:6"), 0]
    s = sp.symbols("s1:7")
    by_sector = sum(L[i] * (s[i] - s[i - 1]) for i in range(1, 6))
    by_border = sum((L[i - 1] - L[i]) * s[i - 1] for i in range(1, 7))
    t = sp.symbols("t", real=True)
    light = sp.sin(3 * t) + t**2
    ends = [-sp.pi / 2, -1, sp.Rational(1, 3), sp.pi / 2]
    parts = sum(sp.integrate(light * sp.cos(t), (t, p, q)) for p, q in itertools.pairwise(ends))
    whole = sp.integrate(light * sp.cos(t), (t, ends[0], ends[-1]))
    sector = sp.integrate(sp.cos(t), (t, a, b)) - (sp.sin(b) - sp.sin(a))
    return sp.expand(by_sector - by_border), sp.simplify(parts - whole), sector


def borders():
    """(46) and (51) for a fixed point: `-cos^2 / r` and `-3 cos^2 sin / r^2`."""
    s, c, r = sine(a, h), cosine(a, h), distance(a, h)
    return [
        sp.simplify(sp.diff(s, x) + c**2 / r),
        sp.simplify(sp.diff(s, x, 2) + 3 * c**2 * s / r**2),
    ]


def sliding():
    """Second motion of a limb: `-3 cos^2 sin / r^2 - R cos^3 / r^3` with the disc towards +x.

    The tangent of length t, the radius R and D, the way to the centre, make a right angle; all is
    rational in t, R and the sine and cosine of the limb's angle, whose rate is proved first.
    """
    t = sp.symbols("t", positive=True)
    s, c = sp.symbols("s c", real=True)
    D = sp.sqrt(t**2 + R**2)
    s_centre, c_centre = (t * s + R * c) / D, (t * c - R * s) / D
    # theta = theta_c - asin(R / D); d theta_c = -cos_c / D, d D = -sin_c per step of x.
    rate = -c_centre / D + R / (D * t) * -s_centre
    t_rate = D * -s_centre / t  # t^2 = D^2 - R^2
    theta_rate = -c / t
    second = 2 * c * s * theta_rate / t + c**2 * t_rate / t**2  # of -c^2 / t
    wanted = -3 * c**2 * s / t**2 - R * c**3 / t**3
    return sp.simplify(rate - theta_rate), sp.simplify(second - wanted)


def uncovered():
    """First and second derivative of a shadowed wall of linear radiance, against (46) and (51).

    A black blocker ends at (e1, e2) and hides the wall y = h to its left; the wall ends at A. The
    sum of (46) over all borders becomes `int cos^2 / r dL` plus the jumps, and is E'. That of (51)
    lacks `-dL/dtheta cos^3 (1/r_f - 1/r_b)^2` at the edge.
    """
    edge = x + (e1 - x) * h / e2

    def L(p):
        return c0 + c1 * p

    E = (
        L(A) * sine(A, h)
        - L(edge) * sine(edge, h)
        - c1 * (distance(A, h) - distance(edge, h))  # by parts: the integral of the sine is r
    )
    s, c, r_f = sine(e1, e2), cosine(e1, e2), distance(e1, e2)
    r_b = r_f * h / e2
    first = (
        c1 * (sine(A, h) - s)  # int c1 h^2 / r^3
        + L(edge) * c**2 / r_f
        - L(A) * cosine(A, h) ** 2 / distance(A, h)
    )
    smooth = -(h**2) * c1 * (1 / distance(A, h) ** 3 - 1 / r_b**3)  # int c1 3 h^2 (y - x) / r^5
    jumps = (
        L(edge) * 3 * c**2 * s / r_f**2
        - L(A) * 3 * cosine(A, h) ** 2 * sine(A, h) / distance(A, h) ** 2
    )
    lacking = -(c1 * r_b / c) * c**3 * (1 / r_f - 1 / r_b) ** 2  # dL/dtheta = c1 r_b / cos
    values = {h: sp.Rational(7, 5), e2: sp.Rational(4, 5)}  # heights; x, e1, A and L stay free
    below = {e1: x + sp.Symbol("u", real=True), A: x + sp.Symbol("w", real=True)}

    def rest(expression):
        return sp.simplify(expression.subs(values).subs(below))

    return rest(sp.diff(E, x) - first), rest(sp.diff(E, x, 2) - smooth - jumps - lacking)


def turned():
    """Rotation: `E_n = int L sin a`, `E_nn = -E + L(pi/2) + L(-pi/2)`, and the strata give both.

    Counter-clockwise; the light L(theta) stands still, the hemicircle turns by n.
    """
    n, t = sp.symbols("n t", real=True)
    light = sp.sin(2 * t) + t**2 + 3
    E = sp.integrate(sp.expand(light * sp.cos(t - n)), (t, n - sp.pi / 2, n + sp.pi / 2))
    ends = light.subs(t, n + sp.pi / 2) + light.subs(t, n - sp.pi / 2)
    inner = sp.integrate(sp.expand(light * sp.sin(t - n)), (t, n - sp.pi / 2, n + sp.pi / 2))
    return sp.simplify(sp.diff(E, n) - inner), sp.simplify(sp.diff(E, n, 2) + E - ends)


# --- numbers --------------------------------------------------------------------------------------

HERE = {"A": ((0.35, 0.0), 0.2), "B": ((0.35, 0.0), 0.2), "disc": ((0.35, 0.02), 0.2)}


@functools.cache
def truth(name):
    return scenes.motion(name, *HERE[name])


@functools.cache
def compiled(name, form, n=0):
    """One of the library's forms in one scene."""
    import equinox as eqx

    from firstorder.flatland import Receiver, irradiance, translation
    from firstorder.flatland.forms import arc_length_exact, stratified
    from firstorder.flatland.samples import look, strata

    scene, radiance = scenes.built(name)
    at = Receiver(*HERE[name])
    forms = {
        "exact": lambda key: arc_length_exact(scene, at, radiance),
        "stratified": lambda key: stratified(look(scene, at, strata(n), radiance)),
        "autodiff": lambda key: translation(lambda r: irradiance(scene, r, radiance))(at),
    }
    import jax

    return eqx.filter_jit(forms[form])(jax.random.key(1))


def frozen_error(order) -> float:
    """The arc-length integral in scene A, by all three freedoms."""
    from firstorder.checks.tolerance import normwise

    ours = compiled("A", "exact")
    return normwise((ours.value, ours.gradient, ours.hessian)[order], truth("A")[order])


def frozen_autodiff(order) -> float:
    ours, right = compiled("A", "exact").translation(), compiled("A", "autodiff")
    return float(abs((ours.first - right.first, ours.second - right.second)[order - 1]))


def with_boundary() -> float:
    """(36) in scene B: the arc-length gradient and the two edges, against the truth."""
    (px, _), n = HERE["B"]
    _, gradient, _ = truth("B")
    step = np.array([np.cos(n), np.sin(n)])
    edges = 0.0
    for end, side in zip(scenes.BLOCKER, (-1.0, 1.0), strict=True):
        # The shadow of the end is at s = 2 end - px when the receiver is on the floor.
        s = 2.0 * end - px
        if not scenes.LIGHT[0] < s < scenes.LIGHT[1]:
            continue
        # s(px, py) = px + (end - px)(1 - py) / (0.5 - py): its slopes at py = 0.
        slope = np.array([-1.0, (end - px) * (1 / 0.25 - 1 / 0.5)])
        p = np.array([s - px, 1.0])
        G = (np.array([-np.sin(n), np.cos(n)]) @ p) * p[1] / np.linalg.norm(p) ** 3
        edges += -side * G * (slope @ step)  # lit from s on, on the far side of the blocker
    return float(abs(compiled("B", "exact").gradient[0] + edges - gradient[0]))


def angular() -> float:
    """(40): the library's E in scene B against 30 digits."""
    return float(abs(compiled("B", "exact").value - truth("B")[0]))


def sector_sums() -> float:
    """(43) and (44) with numbers, and the library's sum of borders, for uneven strata."""
    from firstorder.flatland.forms import Borders, moved

    rng = np.random.default_rng(4)
    ends = np.sort(np.r_[-np.pi / 2, rng.uniform(-1.5, 1.5, 30), np.pi / 2])
    L = rng.uniform(0.0, 2.0, 31)
    direct = sum(v * (np.sin(q) - np.sin(p)) for v, p, q in zip(L, ends, ends[1:], strict=False))
    jump = np.r_[0.0, L] - np.r_[L, 0.0]
    zero = np.zeros_like(ends)
    ours = moved(Borders(ends, zero, jump, zero)).value
    return max(abs(np.sum(jump * np.sin(ends)) - direct), float(abs(ours - direct)))


def constant_per_sector() -> float:
    """(42): departure of the fitted order of the midpoint sum from -2, for a smooth light."""
    from firstorder.checks.tolerance import fitted_order

    def light(t):
        return np.exp(np.sin(2 * t))

    t, w = np.polynomial.legendre.leggauss(60)
    right = np.sum(np.pi / 2 * w * light(np.pi / 2 * t) * np.cos(np.pi / 2 * t))
    sizes, errors = np.array([50, 100, 200, 400]), []
    for n in sizes:
        ends = np.linspace(-np.pi / 2, np.pi / 2, n + 1)
        L = light(0.5 * (ends[1:] + ends[:-1]))
        errors.append(abs(np.sum(L * np.diff(np.sin(ends))) - right))
    return abs(fitted_order(sizes, errors) + 2.0)


def points_moved(order) -> float:
    """`moved` against autodiff of the sines of fixed points, by all three freedoms."""
    import jax
    import jax.numpy as jnp

    from firstorder.checks.tolerance import normwise
    from firstorder.flatland.forms import Borders, moved

    rng = np.random.default_rng(7)
    angle, r, jump = rng.uniform(-1.4, 1.4, 9), rng.uniform(0.3, 3.0, 9), rng.normal(size=9)
    points = r[:, None] * np.stack([-np.sin(angle), np.cos(angle)], -1)

    def total(q):
        p = points - q[:2]
        side = p[:, 0] * jnp.cos(q[2]) + p[:, 1] * jnp.sin(q[2])
        return jnp.sum(-jump * side / jnp.sqrt(jnp.sum(p * p, -1)))

    ours = moved(Borders(angle, 1.0 / r, jump, 0.0 * r))
    if order == 1:
        return normwise(ours.gradient, jax.jit(jax.grad(total))(jnp.zeros(3)))
    return normwise(ours.hessian, jax.jit(jax.hessian(total))(jnp.zeros(3)))


def limbs_moved() -> float:
    """`moved` with its bend against autodiff of the sines of both tangents to a disc."""
    import jax
    import jax.numpy as jnp

    from firstorder.checks.tolerance import normwise
    from firstorder.flatland.forms import Borders, moved

    centre, radius, sides = jnp.array([-0.3, 0.9]), 0.35, jnp.array([1.0, -1.0])

    def limb(q):
        p = centre - q[:2]
        D = jnp.sqrt(p @ p)
        return jnp.arctan2(-p[0], p[1]) + sides * jnp.arcsin(radius / D) - q[2]

    jump, zero = jnp.array([0.7, -0.4]), jnp.zeros(3)
    r = np.sqrt(float(centre @ centre) - radius**2)
    inverse = jnp.full(2, 1.0 / r)
    ours = moved(Borders(limb(zero), inverse, jump, sides * radius / r**3))
    return normwise(
        ours.hessian, jax.jit(jax.hessian(lambda q: jnp.sum(jump * jnp.sin(limb(q)))))(zero)
    )


def gradient_error(name) -> float:
    """(47) with 16384 strata."""
    from firstorder.checks.tolerance import normwise

    return normwise(compiled(name, "stratified", 16384).gradient, truth(name)[1])


def disc_borders(n=20000):
    """The disc before the wall as borders, from plane geometry: strata of the wall, and two limbs.

    Returns them with the slope of the radiance behind each limb by the local angle.
    """
    (px, py), turn = HERE["disc"]
    d = np.subtract(scenes.CENTRE, (px, py))
    D, middle = np.hypot(*d), np.arctan2(-d[0], d[1]) - turn
    half, t = np.arcsin(scenes.RADIUS / D), np.sqrt(D**2 - scenes.RADIUS**2)
    limbs = middle + half * np.array([-1.0, 1.0])
    ends = [np.arctan2(-(p - px), 1.0 - py) - turn for p in scenes.WALL]

    def light(a):
        return scenes.LEVEL + scenes.RISE * (px - (1.0 - py) * np.tan(a + turn))

    def reach(a):
        return (1.0 - py) / np.cos(a + turn)

    pieces = [(ends[1], limbs[0]), (limbs[1], ends[0])]
    angle, inverse, jump, bend = [], [], [], []
    for low, high in pieces:
        inner = low + (high - low) * np.arange(1, n) / n
        samples = np.r_[light(low), light(low + (high - low) * (np.arange(n) + 0.5) / n)]
        samples = np.r_[samples, light(high)]
        angle += [inner, [low, high]]
        inverse += [1.0 / reach(inner), [1.0 / reach(low), 1.0 / reach(high)]]
        jump += [samples[1:-2] - samples[2:-1], [-samples[1], samples[-2]]]
        bend += [np.zeros(n - 1), np.zeros(2)]
    angle, inverse, jump, bend = map(np.concatenate, (angle, inverse, jump, bend))
    for limb, side in zip(limbs, (-1.0, 1.0), strict=True):
        k = np.flatnonzero(angle == limb)
        inverse[k], bend[k] = 1.0 / t, side * scenes.RADIUS / t**3
    slope = -scenes.RISE * (1.0 - py) / np.cos(limbs + turn) ** 2
    drag = np.array([1.0, -1.0]) * slope * np.cos(limbs) * (1.0 / t - 1.0 / reach(limbs)) ** 2
    return (angle, inverse, jump, bend), limbs, drag


def mended_sum() -> float:
    """(51) with both terms that it lacks, against the truth."""
    from firstorder.checks.tolerance import normwise
    from firstorder.flatland.forms import Borders, moved

    borders, limbs, drag = disc_borders()
    e = np.stack([np.cos(limbs), np.sin(limbs)], -1)
    hessian = np.array(moved(Borders(*borders)).hessian)
    hessian[:2, :2] += np.einsum("k,ki,kj->ij", drag, e, e)
    return normwise(hessian, truth("disc")[2])


def printed_gradient(x):
    """(37) read literally, `dOmega`: the integral of `L V dG/dx` over the angle, in scene A."""
    theta = np.linspace(np.arctan(-0.5 - x), np.arctan(0.5 - x), 20001)
    r = 1.0 / np.cos(theta)
    p = np.stack([np.sin(theta), np.cos(theta)], -1) * r[:, None]
    c = np.cos(theta)
    gradient = (3 * c * c / r**3)[:, None] * p - (c / r**2)[:, None] * np.array([0.0, 1.0])
    gradient = gradient - (c / r**2)[:, None] * np.array([0.0, 1.0])
    return float(np.trapezoid(gradient[:, 0], theta))


def printed_hessian(x):
    """(50) as printed, in scene A: two borders, each with `H sin` by central differences."""

    def second(p, step=1e-4):
        s = [(p - q) / np.hypot(p - q, 1.0) for q in (x - step, x, x + step)]
        return (s[0] - 2 * s[1] + s[2]) / step**2

    low, high = scenes.LIGHT
    return float((1.0 - 0.0) * second(low) + (0.0 - 1.0) * second(high))


def true_first(x):
    return float(scenes.motion("A", (x, 0.0), 0.0)[1][0])


def true_second(x):
    return float(scenes.motion("A", (x, 0.0), 0.0)[2][0, 0])


def printed_limit(x):
    """The limit of (51) before the disc: all borders as fixed points, background held constant.

    The receiver is that of `HERE`, tilted, and x its place along the floor.
    """
    from firstorder.flatland.forms import Borders, moved

    assert x == HERE["disc"][0][0]
    (angle, inverse, jump, bend), *_ = disc_borders()
    return float(moved(Borders(angle, inverse, jump, 0.0 * bend)).hessian[0, 0])


ARC = {"implements": "firstorder.flatland.forms.arc_length", "fourier": na("no spectrum")}
STRATA = {"implements": "firstorder.flatland.forms.stratified", "fourier": na("no spectrum")}
MOVED = {"implements": "firstorder.flatland.forms.moved", "fourier": na("no spectrum")}

ROWS = [
    Row(
        "J12.35",
        "definition",
        **ARC,
        symbolic=subtended,
        autodiff=na("definition"),
        brute_force=Check(angular, 1e-12),
        note="With dl(y) as its measure the domain Omega does no harm: V leaves out the rest of L.",
    ),
    Row(
        "J12.36",
        "identity",
        **ARC,
        symbolic=product_rule,
        autodiff=na("one route"),
        brute_force=Check(with_boundary, 1e-10),
        note="grad V is a distribution on the shadow edges: a sum over edges, not an integral.",
    ),
    Row(
        "J12.37",
        "misprint",
        **ARC,
        symbolic=lambda: frozen(1),
        autodiff=Check(lambda: frozen_autodiff(1), 1e-12),
        brute_force=Check(lambda: frozen_error(1), 1e-10),
        corrected="grad E ~ int_L L V grad_x G dl(y): measure dl(y); equal only without shadows",
        counterexample=Counterexample({"x": 0.35}, printed=printed_gradient, true=true_first),
        note="Judged in scene A. In a penumbra the form is wrong by its edges (36).",
    ),
    Row(
        "J12.40",
        "identity",
        implements="firstorder.flatland.irradiance.irradiance",
        symbolic=light_overhead,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(angular, 1e-12),
    ),
    *(
        Row(
            f"J12.{k}",
            "identity",
            **STRATA,
            symbolic=lambda part=part: summed_by_parts()[part],
            autodiff=na("no derivative"),
            brute_force=Check(sector_sums, 1e-13),
        )
        for k, part in ((41, 1), (43, 2), (44, 0))
    ),
    Row(
        "J12.42",
        "approximation",
        **STRATA,
        symbolic=na("measured"),
        autodiff=na("no derivative"),
        brute_force=Check(constant_per_sector, 0.05),
        note="Order 2 in the width for midpoints and a smooth light, 3/2 for jittered, 1 at jumps.",
    ),
    Row(
        "J12.45",
        "approximation",
        **MOVED,
        symbolic=lambda: [uncovered()[0], *turned()],
        autodiff=Check(lambda: points_moved(1), 1e-12),
        brute_force=Check(lambda: gradient_error("B"), 2e-3),
        note="When turning, borders at the horizon stay: left out, or E_nn is wrong by L there.",
    ),
    Row(
        "J12.46",
        "identity",
        **MOVED,
        symbolic=lambda: borders()[0],
        autodiff=Check(lambda: points_moved(1), 1e-12),
        brute_force=Check(lambda: gradient_error("B"), 2e-3),
    ),
    Row(
        "J12.47",
        "approximation",
        **STRATA,
        symbolic=lambda: uncovered()[0],
        autodiff=na("measured"),
        brute_force=Check(lambda: max(map(gradient_error, ("B", "disc"))), 2e-2),
        note="Tends to the truth: order 1 in the width, 1/2 before curved limbs. No bias is left.",
    ),
    Row(
        "J12.48",
        "approximation",
        **ARC,
        symbolic=lambda: frozen(2),
        autodiff=Check(lambda: frozen_autodiff(2), 1e-12),
        brute_force=Check(lambda: frozen_error(2), 1e-8),
        note="Exact without shadow edges (judged in scene A); wrong by them in a penumbra.",
    ),
    Row(
        "J12.50",
        "misprint",
        **MOVED,
        symbolic=lambda: borders()[1],
        autodiff=Check(lambda: points_moved(2), 1e-12),
        brute_force=Check(mended_sum, 1e-5),
        corrected="sum of (L_{i-1} - L_i) H(sin theta_i-), as in (45)",
        counterexample=Counterexample({"x": 0.35}, printed=printed_hessian, true=true_second),
    ),
    Row(
        "J12.51",
        "over-claim",
        implements="firstorder.flatland.mending.mended",
        fourier=na("no spectrum"),
        symbolic=lambda: [*sliding(), uncovered()[1]],
        autodiff=Check(limbs_moved, 1e-12),
        brute_force=Check(mended_sum, 1e-5),
        corrected="plus, at each edge, (L_f - L_b) R cos^3 / r_f^3 before a curved blocker of "
        "radius R and -+ dL_b/dtheta cos^3 (1/r_f - 1/r_b)^2 before a background that varies "
        "(minus if it lies towards greater theta)",
        counterexample=Counterexample(
            {"x": 0.35}, printed=printed_limit, true=lambda x: float(truth("disc")[2][0, 0])
        ),
        note="Said to account for occlusions; its limit takes each shadow edge for a fixed point.",
    ),
]
