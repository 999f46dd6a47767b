"""Edge angles in vertical slices: R07 (38)-(49), (72) and footnote 4, and second derivatives.

The start is geometry. A receiver at q sees along `w(alpha)` in the slice at azimuth phi. A smooth
blocker is the set F <= 0 of any function F: the edge is where the least F along the ray is zero. An
edge in space is a curve: the edge angle is that of the point where it meets the slice.
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.ledger import Check, Row, na

a, phi, D, r = sp.symbols("alpha phi D r", real=True)
x, y, theta = sp.symbols("x y theta", real=True)

# Components along c, v, w, in which everything below is rational; u = cos(alpha) c + sin(alpha) w.
C, V, W = (sp.Matrix([int(i == j) for j in range(3)]) for i in range(3))
U = sp.cos(a) * C + sp.sin(a) * W
M = sp.Matrix(sp.symbols("m1:4", real=True))  # a step of the receiver, in any direction
K = sp.Matrix(sp.symbols("k1:4", real=True))  # tangent of an edge in space
n1, n2 = sp.symbols("n1 n2", real=True)
N = n1 * C + n2 * V  # all normals of rays that touch
H = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"h{min(i, j)}{max(i, j)}", real=True))


# --- the slice and the distribution --------------------------------------------------------------


def step_derivative():
    """(39) against any test function: d/dx int_0^alpha f dtheta = f(alpha) alpha_x."""
    f, edge = sp.Function("f"), sp.Function("alpha")(x)
    weighed = sp.Integral(f(theta), (theta, 0, edge)).diff(x)
    return sp.simplify(weighed - f(edge) * edge.diff(x))


def chain():
    """(40) and (41): any alpha of u = x cos + y sin and v = -x sin + y cos, by x and by y."""
    g = sp.Function("g")
    u, v = sp.symbols("u v", real=True)
    place = {u: x * sp.cos(phi) + y * sp.sin(phi), v: -x * sp.sin(phi) + y * sp.cos(phi)}
    alpha = g(u, v).subs(place)
    along, across = (g(u, v).diff(c).subs(place) for c in (u, v))
    wanted = {
        x: along * sp.cos(phi) - across * sp.sin(phi),
        y: along * sp.sin(phi) + across * sp.cos(phi),
    }
    return [sp.simplify((alpha.diff(c) - w).doit()) for c, w in wanted.items()]


def motion():
    """(42): p = q + D w(alpha) differentiated along any path of the receiver in its plane."""
    alpha, dist = sp.Function("alpha")(r), sp.Function("D")(r)
    w = sp.Matrix([sp.sin(alpha), 0, sp.cos(alpha)])  # in u, v, z
    c = sp.Matrix([sp.cos(alpha), 0, -sp.sin(alpha)])
    m = sp.Matrix([*sp.symbols("m1:3", real=True), 0])
    p = r * m + dist * w
    return [sp.simplify(e) for e in p.diff(r) - (dist * alpha.diff(r) * c + dist.diff(r) * w + m)]


@functools.cache
def least():
    """Both derivatives of alpha from "the least F along the ray is zero", F up to second order.

    Without the tangent plane of (43): F near p is n . d + d . H d / 2, any n with w . n = 0 and
    any symmetric H; the least value is found, and the angle solved from it, by series.
    """
    e, da1, da2, s1 = sp.symbols("e da1 da2 s1", real=True)
    turn = e * da1 + e**2 * da2 / 2
    # The least value lies at s = e s1 + O(e^2) beyond D; an error of s counts in e^4 alone.
    d = e * M + (D + e * s1) * (W * (1 - turn**2 / 2) + C * turn) - D * W
    F = sp.expand(N.dot(d) + (d.T * H * d)[0] / 2)
    one, two = F.coeff(e, 1), F.coeff(e, 2)
    first = sp.solve(one, da1)[0]
    s1_least = sp.solve(two.diff(s1), s1)[0]
    second = sp.solve(two.subs(s1, s1_least), da2)[0].subs(da1, first)
    return first, second


def tangent_plane():
    """(44), the rate in every direction, and (45), (46) for m = u and v."""
    first, _ = least()
    steep = N.dot(C)
    general = first + M.dot(N) / (D * steep)
    along, across = (first.subs(dict(zip(M, m, strict=True))) for m in (U, V))
    return [
        sp.cancel(sp.expand(e))
        for e in (general, along + sp.cos(a) / D, across + V.dot(N) / (D * steep))
    ]


def stays_in_the_plane():
    """(43): for a point p(r) on any surface F = 0, and any path, grad F . p' = 0.

    With (42) and w . n = 0 the motion along the ray drops out.
    """
    X = sp.symbols("X1:4", real=True)
    p = [sp.Function(f"p{i}")(r) for i in range(3)]
    F = sp.Function("F")
    total = F(*p).diff(r)
    grad = [F(*X).diff(c).subs(dict(zip(X, p, strict=True))) for c in X]
    both = total - sum(g * q.diff(r) for g, q in zip(grad, p, strict=True))
    da, dD = sp.symbols("da dD")
    left = N.dot(D * da * C + dD * W + M) - (D * da * C.dot(N) + M.dot(N))
    return sp.simplify(both.doit()), sp.simplify(left)


def second_of_a_limb():
    """`limb_bend`: the second derivative in every direction."""
    first, second = least()
    q = M + D * first * C
    s = (W.T * H * q)[0] + N.dot(C) * first
    ours = -((q.T * H * q)[0] - s**2 / (W.T * H * W)[0]) / (D * N.dot(C))
    return sp.cancel(second - ours)


def crossing(order: int):
    """A derivative of the angle at which a curve p + k t + K t^2 / 2 meets the slice."""
    e, t1, t2 = sp.symbols("e t1 t2", real=True)
    bent = sp.Matrix(sp.symbols("K1:4", real=True))
    t = e * t1 + e**2 * t2 / 2
    point = D * W + K * t + bent * t**2 / 2 - e * M
    cut = sp.expand(V.dot(point))
    t1s = sp.solve(cut.coeff(e, 1), t1)[0]
    t2s = sp.solve(cut.coeff(e, 2).subs(t1, t1s), t2)[0]
    point = point.subs(t2, t2s).subs(t1, t1s)
    part = sp.atan(C.dot(point) / W.dot(point))  # the angle of `point` from w
    return part.diff(e, order).subs(e, 0), bent


def straight_edge():
    """(72) and alpha_u: the angle of the point where a line meets the slice."""
    first = crossing(1)[0].subs({f"K{i}": 0 for i in (1, 2, 3)})
    along, across = (first.subs(dict(zip(M, m, strict=True))) for m in (U, V))
    return [sp.simplify(e) for e in (along + sp.cos(a) / D, across - K.dot(C) / (D * K.dot(V)))]


def reduces():
    """Proof that k . c = -n . v and k . v = n . c for n = k x w, whatever k: (72) is then (46)."""
    n = K.cross(W)
    return sp.simplify(K.dot(C) + n.dot(V)), sp.simplify(K.dot(V) - n.dot(C))


def second_of_a_rim():
    """`rim_bend` in every direction."""
    found, bent = crossing(2)
    t = V.dot(M) / K.dot(V)
    way = K * t - M
    ours = C.dot(bent - K * V.dot(bent) / K.dot(V)) * t**2 / D
    ours -= 2 * W.dot(way) * C.dot(way) / D**2
    return sp.cancel(found - ours)


def grazing():
    """Footnote 4: where a slice only grazes a ball, alpha_v goes as (phi0 - phi)^(-1/2).

    A ball of half-angle b at polar angle g has its edges at theta0 +- asin(sqrt(h)), with
    `h = 1 - cos(b)^2 / (1 - sin(g)^2 S^2)`, S the sine of the azimuth from its middle, and theta0
    smooth. h has a simple zero where the slice grazes, and edge' sqrt(h) goes to h' / 2 there: not
    zero. (alpha_phi is alpha_v times the way per turn, which is smooth.)
    """
    g, b, S = sp.symbols("g b S", positive=True)
    h = 1 - sp.cos(b) ** 2 / (1 - sp.sin(g) ** 2 * S**2)
    end = sp.sin(b) / sp.sin(g)
    rate = sp.asin(sp.sqrt(h)).diff(S)
    slope = -2 * sp.sin(g) * sp.sin(b) / sp.cos(b) ** 2
    return [
        sp.simplify(h.subs(S, end)),
        sp.simplify(h.diff(S).subs(S, end) - slope),
        sp.simplify(rate**2 * h * (1 - h) - (h.diff(S) / 2) ** 2),
    ]


# --- numbers -------------------------------------------------------------------------------------

# Ellipsoids: centre, axes as columns; and which edge of the slice (+1: the blocker lies above).
LIMBS = [
    ((1.0, 0.4, 1.5), ((0.6, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, 0.6)), 0.25, 1.0),
    ((1.0, 0.4, 1.5), ((0.6, 0.0, 0.0), (0.0, 0.6, 0.0), (0.0, 0.0, 0.6)), 0.5, -1.0),
    ((-0.9, 0.8, 0.7), ((0.7, 0.1, 0.0), (-0.2, 0.4, 0.1), (0.1, 0.2, 0.5)), 2.3, 1.0),
    ((-0.9, 0.8, 0.7), ((0.7, 0.1, 0.0), (-0.2, 0.4, 0.1), (0.1, 0.2, 0.5)), 2.6, -1.0),
]
# Straight edges: a point, a tangent, the azimuth of the slice.
RIMS = [
    ((1.0, 0.5, 0.8), (0.3, 0.8, 0.2), 0.6),
    ((-0.7, 0.2, 1.4), (0.1, 0.5, -0.9), 2.8),
    ((0.4, -0.9, 0.3), (1.0, 0.2, 0.4), -1.1),
]
STEP = mp.mpf(10) ** -12


def ray_meets(center, axes, place, phi, angle) -> bool:
    """Whether a ray meets an ellipsoid: no formula for edges, only the quadratic along the ray."""
    gap = [c - p for c, p in zip(center, place, strict=True)]
    return _meets(_unit_ball(axes, gap), _frame(axes, phi), mp.sin(angle), mp.cos(angle))


def _unit_ball(axes, vector):
    """A vector in the coordinates in which the ellipsoid is the unit ball."""
    inverse = np.linalg.inv(np.array(axes)).tolist()  # rounded, and so are all that use it
    return [sum(row[k] * vector[k] for k in range(3)) for row in inverse]


def _frame(axes, phi):
    return _unit_ball(axes, [mp.cos(phi), mp.sin(phi), 0]), _unit_ball(axes, [0, 0, 1])


def _meets(q, frame, s, c) -> bool:
    e = [s * u + c * z for u, z in zip(*frame, strict=True)]
    ee, qe, qq = (sum(f * h for f, h in zip(*p, strict=True)) for p in ((e, e), (q, e), (q, q)))
    return qe > 0 and qe * qe >= ee * (qq - 1)


def bisected(case, move=(0, 0)):
    """The edge angle of an ellipsoid from a moved receiver, by bisection, 40 digits."""
    center, axes, phi, side = case
    q = _unit_ball(axes, [center[0] - mp.mpf(move[0]), center[1] - mp.mpf(move[1]), center[2]])
    frame = _frame(axes, phi)
    rough = [float(c) for c in q], [[float(c) for c in a] for a in frame]
    angles = np.linspace(-1.2, 1.5, 500)
    met = [t for t in angles if _meets(*rough, np.sin(t), np.cos(t))]
    inside = mp.mpf(float(min(met) if side > 0 else max(met)))
    outside = inside - side / mp.mpf(100)
    for _ in range(125):
        half = (inside + outside) / 2
        if _meets(q, frame, mp.sin(half), mp.cos(half)):
            inside = half
        else:
            outside = half
    return inside


def crossed(case, move=(0, 0)):
    """The angle at which a line meets the slice: rays on either side of it tell, 40 digits."""
    point, tangent, phi = case
    place = (mp.mpf(move[0]), mp.mpf(move[1]), 0)
    e = [mp.mpf(c) - o for c, o in zip(point, place, strict=True)]
    k = [mp.mpf(c) for c in tangent]
    normal = [e[i - 2] * k[i - 1] - e[i - 1] * k[i - 2] for i in range(3)]

    def beside(angle):
        w = [mp.sin(angle) * mp.cos(phi), mp.sin(angle) * mp.sin(phi), mp.cos(angle)]
        return sum(f * h for f, h in zip(normal, w, strict=True)) > 0

    middle = mp.atan2(e[0] * mp.cos(phi) + e[1] * mp.sin(phi), e[2])
    low, high = middle - mp.mpf("0.2"), middle + mp.mpf("0.2")
    first = beside(low)
    assert first != beside(high)
    for _ in range(135):
        half = (low + high) / 2
        low, high = (half, high) if beside(half) == first else (low, half)
    return low


@functools.cache
def differences(kind: str, i: int):
    """alpha, its gradient and Hessian in x, y by differences of bisected angles."""
    with mp.workdps(40):
        find, case = (bisected, LIMBS[i]) if kind == "limb" else (crossed, RIMS[i])
        h = STEP
        steps = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1))
        f = {m: find(case, (m[0] * h, m[1] * h)) for m in steps}
        g = [(f[1, 0] - f[-1, 0]) / (2 * h), (f[0, 1] - f[0, -1]) / (2 * h)]
        xx = (f[1, 0] - 2 * f[0, 0] + f[-1, 0]) / h**2
        yy = (f[0, 1] - 2 * f[0, 0] + f[0, -1]) / h**2
        xy = (f[1, 1] - f[1, -1] - f[-1, 1] + f[-1, -1]) / (4 * h**2)
        numbers = [float(c) for c in (f[0, 0], *g, xx, xy, yy)]
    return numbers[0], np.array(numbers[1:3]), np.array(numbers[3:])[[0, 1, 1, 2]].reshape(2, 2)


def limb_angle(move, center, axes, phi, side):
    """The edge angle of an ellipsoid as a root of a quadratic, in JAX."""
    import jax.numpy as jnp

    inverse = jnp.linalg.inv(jnp.asarray(axes))
    q = inverse @ (jnp.asarray(center) - jnp.stack([move[0], move[1], 0.0 * move[0]]))
    G = jnp.outer(q, q) - (q @ q - 1.0) * jnp.eye(3)
    e = inverse @ jnp.stack([jnp.cos(phi), jnp.sin(phi), 0.0]), inverse[:, 2]
    g = [[a @ G @ b for a in e] for b in e]
    root = jnp.sqrt(g[0][1] ** 2 - g[0][0] * g[1][1])
    # The two tangents are the lines -g01 +- root over g00; the ellipsoid lies between them.
    angles = jnp.stack([jnp.arctan2(t, g[0][0]) for t in (-g[0][1] - root, -g[0][1] + root)])
    middle = jnp.arctan2(jnp.asarray(center) @ _along(phi), center[2])
    angles = angles - jnp.pi * jnp.round((angles - middle) / jnp.pi)
    return jnp.where(side > 0, jnp.min(angles), jnp.max(angles))


def _along(phi):
    import jax.numpy as jnp

    return jnp.stack([jnp.cos(phi), jnp.sin(phi), 0.0])


def rim_angle(move, point, tangent, phi):
    """The same for a line, from the plane through it."""
    import jax.numpy as jnp

    e = jnp.asarray(point) - jnp.stack([move[0], move[1], 0.0 * move[0]])
    normal = jnp.cross(e, jnp.asarray(tangent))
    angle = jnp.arctan2(-normal[2], normal @ _along(phi))
    middle = jnp.arctan2(e @ _along(phi), e[2])
    return angle - jnp.pi * jnp.round((angle - middle) / jnp.pi)


def ours(kind: str, i: int):
    """The library's closed forms at the touched point, found from the bisected angle alone."""
    return _all_ours(kind)[i]


@functools.cache
def _all_ours(kind: str):
    import jax
    import jax.numpy as jnp

    from firstorder.visibility import limb_bend, limb_elevation, rim_bend, rim_elevation

    if kind == "rim":
        rows = [_touched_rim(i) for i in range(len(RIMS))]
        args = [jnp.asarray(np.stack(a)) for a in zip(*rows, strict=True)]
        found = jax.jit(lambda p, k, phi: (rim_elevation(p, k, phi), rim_bend(p, k, 0.0 * k, phi)))(
            *args
        )
    else:
        rows = [_touched_limb(i) for i in range(len(LIMBS))]
        args = [jnp.asarray(np.stack(a)) for a in zip(*rows, strict=True)]
        found = jax.jit(lambda p, n, H, phi: (limb_elevation(p, n, phi), limb_bend(p, n, H, phi)))(
            *args
        )
    found = jax.tree.map(np.asarray, found)
    return [jax.tree.map(lambda a, i=i: a[i], found) for i in range(len(rows))]


def _ray(kind: str, i: int):
    alpha, phi = differences(kind, i)[0], (LIMBS[i] if kind == "limb" else RIMS[i])[2]
    return phi, np.array([np.sin(alpha) * np.cos(phi), np.sin(alpha) * np.sin(phi), np.cos(alpha)])


def _touched_rim(i: int):
    phi, w = _ray("rim", i)
    point, k = np.array(RIMS[i][0]), np.array(RIMS[i][1])
    p = w * np.linalg.norm(np.cross(point, k)) / np.linalg.norm(np.cross(w, k))
    return p, k / np.linalg.norm(k), np.array(phi)


def _touched_limb(i: int):
    phi, w = _ray("limb", i)
    center, inverse = np.array(LIMBS[i][0]), np.linalg.inv(np.array(LIMBS[i][1]))
    e, q = inverse @ w, inverse @ center
    p = w * (e @ q) / (e @ e)  # the nearest to the centre, in the ball's coordinates
    steep = inverse.T @ inverse @ (p - center)
    n = steep / np.linalg.norm(steep)
    flat = np.eye(3) - np.outer(n, n)
    return p, n, flat @ (inverse.T @ inverse) @ flat / np.linalg.norm(steep), np.array(phi)


def _each(kind):
    kinds = ("limb", "rim") if kind == "both" else (kind,)
    return [(k, i) for k in kinds for i in range(len(LIMBS if k == "limb" else RIMS))]


def _turned(gradient, phi):
    """(x, y) to (u, v)."""
    c, s = np.cos(phi), np.sin(phi)
    return np.array([c * gradient[0] + s * gradient[1], -s * gradient[0] + c * gradient[1]])


def against_bisection(kind: str, part: str) -> float:
    """Largest error of `part` ("u", "v", "x", "y", "bend") relative to the rate's size."""
    worst = 0.0
    for k, i in _each(kind):
        found, bend = ours(k, i)
        _, gradient, hessian = differences(k, i)
        worst = max(worst, _error(found, bend, gradient, hessian, part))
    return worst


def against_autodiff(kind: str, part: str) -> float:
    """The same against autodiff of the angle as a root of a quadratic, or from a plane."""
    worst = 0.0
    for k, i in _each(kind):
        gradient, hessian, _ = _differentiated(k, i)
        worst = max(worst, _error(*ours(k, i), gradient, hessian, part))
    return worst


def _differentiated(kind: str, i: int):
    return tuple(a[i] for a in _all_differentiated(kind))


@functools.cache
def _all_differentiated(kind: str):
    """Gradients, Hessians and gradients of weighed integrals, of all cases at once."""
    import jax
    import jax.numpy as jnp

    function = limb_angle if kind == "limb" else rim_angle
    t, weight = np.polynomial.legendre.leggauss(24)

    def three(*case):
        def integral(m):
            half = 0.5 * function(m, *case)
            return jnp.sum(half * weight * _weight(jnp, half * (1.0 + t)))

        still = jnp.zeros(2)
        gradient, hessian = jax.jacfwd(function)(still, *case), jax.hessian(function)(still, *case)
        return gradient, hessian, jax.jacfwd(integral)(still)

    cases = zip(*(LIMBS if kind == "limb" else RIMS), strict=True)
    args = [jnp.asarray(np.array(a)) for a in cases]
    return tuple(np.asarray(a) for a in jax.jit(jax.vmap(three))(*args))


def _error(found, bend, gradient, hessian, part) -> float:
    if part == "bend":
        return float(np.max(np.abs(bend - hessian)) / np.max(np.abs(hessian)))
    along = dict(zip("uv", _turned(gradient, float(found.phi)), strict=True))
    along |= dict(zip("xy", gradient, strict=True))
    return abs(float(getattr(found, f"alpha_{part}")) - along[part]) / np.max(np.abs(gradient))


def moved_point(i: int, route: str):
    """The rate dp for a unit step along m = (0.6, 0.8) and D', of the tangent point of a ball.

    By differences of bisected angles, or by autodiff of the closed-form angle; D from Pythagoras.
    """
    center, axes, phi, _ = LIMBS[i]
    radius = axes[0][0]

    def point(lib, alpha, t):
        gap = [center[0] - 0.6 * t, center[1] - 0.8 * t, center[2]]
        dist = lib.sqrt(gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2 - radius**2)
        s, c = lib.sin(alpha), lib.cos(alpha)
        way = [s * lib.cos(phi), s * lib.sin(phi), c]
        return [0.6 * t + dist * way[0], 0.8 * t + dist * way[1], dist * way[2]], dist

    if route == "brute":
        with mp.workdps(40):
            h, phi = STEP, mp.mpf(phi)
            sides = [
                point(mp, bisected(LIMBS[i], (mp.mpf("0.6") * t, mp.mpf("0.8") * t)), t)
                for t in (h, -h)
            ]
            rates = [(p - q) / (2 * h) for p, q in zip(sides[0][0], sides[1][0], strict=True)]
            return np.array([float(v) for v in rates]), float((sides[0][1] - sides[1][1]) / (2 * h))
    import jax
    import jax.numpy as jnp

    def both(t, alpha, turn):
        p, dist = point(jnp, alpha + turn * t, t)
        return jnp.stack([*p, dist])

    turn = _differentiated("limb", i)[0] @ [0.6, 0.8]
    found = np.asarray(jax.jacfwd(both)(0.0, differences("limb", i)[0], turn))
    return found[:3], found[3]


def motion_error(route: str, flat: bool) -> float:
    """(42), or with `flat` (43): dp - (D dalpha c + dD w + m), or dp . n, for balls."""
    worst = 0.0
    for i in (0, 1):
        found, _ = ours("limb", i)
        dp, dD = moved_point(i, route)
        alpha, phi, dist = float(found.value), float(found.phi), float(found.distance)
        e = np.array([np.cos(phi), np.sin(phi), 0.0])
        w = np.sin(alpha) * e + [0, 0, np.cos(alpha)]
        c = np.cos(alpha) * e - [0, 0, np.sin(alpha)]
        rate = 0.6 * float(found.alpha_x) + 0.8 * float(found.alpha_y)
        n = (dist * w - np.array(LIMBS[i][0])) / LIMBS[i][1][0][0]
        left = dp @ n if flat else dp - (dist * rate * c + dD * w + [0.6, 0.8, 0.0])
        worst = max(worst, float(np.max(np.abs(left))))
    return worst


def along_any(route: str) -> float:
    """(44) for m = (0.6, 0.8, 0): the rate against both routes, for balls and ellipsoids."""
    worst = 0.0
    for _, i in _each("limb"):
        found, _ = ours("limb", i)
        gradient = differences("limb", i)[1] if route == "brute" else _differentiated("limb", i)[0]
        rate = 0.6 * float(found.alpha_x) + 0.8 * float(found.alpha_y)
        worst = max(worst, float(np.abs(rate - gradient @ [0.6, 0.8])))
    return worst


def _weight(lib, t):
    return lib.cos(t) * (1.0 + 0.3 * t)


def weighed(route: str) -> float:
    """(39): d/dx of int f V dtheta against f(alpha) alpha_x."""
    worst = 0.0
    for _, i in _each("limb"):
        found, _ = ours("limb", i)
        value = float(_weight(np, float(found.value)) * found.alpha_x)
        if route == "brute":
            with mp.workdps(40):
                ends = [bisected(LIMBS[i], (s * STEP, 0)) for s in (1, -1)]
                truth = mp.quad(lambda u: _weight(mp, u), ends[::-1]) / (2 * STEP)
        else:
            truth = _differentiated("limb", i)[2][0]
        worst = max(worst, abs(value - float(truth)))
    return worst


def traced_visibility() -> float:
    """(38): H(alpha - theta) against rays, for angles up to the far end of the blocker."""
    worst = 0.0
    for _, i in _each("limb"):
        center, axes, phi, side = LIMBS[i]
        alpha = differences("limb", i)[0]
        for theta_ in np.linspace(alpha - 0.05, alpha + 0.05, 40):
            free = not ray_meets(center, axes, (0, 0, 0), phi, theta_)
            step = (alpha - theta_) * side > 0
            worst = max(worst, abs(float(free) - float(step)))
    return worst


def same_number() -> float:
    """(72) with a tangent of the silhouette against (46) with the normal, on ellipsoids.

    The tangent is found from two limbs of neighbouring slices, and so is only good to 1e-7.
    """
    import jax
    import jax.numpy as jnp

    from firstorder.visibility import rim_elevation

    limb, rim_at = jax.jit(limb_angle), jax.jit(rim_elevation)
    worst = 0.0
    for _, i in _each("limb"):
        found, _ = ours("limb", i)
        center, axes, phi, side = LIMBS[i]
        inverse = np.linalg.inv(np.array(axes))
        ends = []
        for e in (1e-5, -1e-5):
            angle = float(limb(jnp.zeros(2), jnp.asarray(center), jnp.asarray(axes), phi + e, side))
            w = [np.sin(angle) * np.cos(phi + e), np.sin(angle) * np.sin(phi + e), np.cos(angle)]
            d, q = inverse @ np.array(w), inverse @ np.array(center)
            ends.append(np.array(w) * (d @ q) / (d @ d))
        tangent, middle = ends[0] - ends[1], 0.5 * (ends[0] + ends[1])
        rim = rim_at(jnp.asarray(middle), jnp.asarray(tangent), phi)
        worst = max(worst, abs(float(rim.alpha_v / found.alpha_v) - 1.0))
    return worst


def grazing_order(case=LIMBS[0]) -> float:
    """Fitted exponent of alpha_v in phi0 - phi, less -1/2, from bisected angles and finite steps.

    phi0 of a ball is the azimuth at which its distance from the slice is its radius.
    """
    center, axes, _, side = case
    flat = np.hypot(center[0], center[1])
    phi0 = np.arctan2(center[1], center[0]) + np.arcsin(axes[0][0] / flat)
    gaps = np.array([1e-6, 1e-7, 1e-8, 1e-9])
    rates = []
    with mp.workdps(40):
        turn = mp.atan2(mp.mpf(center[1]), mp.mpf(center[0])) + mp.asin(
            mp.mpf(axes[0][0]) / mp.sqrt(mp.mpf(center[0]) ** 2 + mp.mpf(center[1]) ** 2)
        )
        for gap in gaps:
            phi = turn - mp.mpf(float(gap))
            rates.append(float(_across(center, axes[0][0], phi, side)))
    assert abs(float(turn) - phi0) < 1e-12
    return abs(float(np.polyfit(np.log(gaps), np.log(np.abs(rates)), 1)[0]) + 0.5)


def _across(center, radius, phi, side):
    """alpha_v of a ball by differences of the angle, which is found from the slice's circle."""
    h = mp.mpf(10) ** -18

    def angle(t):
        x, y = center[0] + t * mp.sin(phi), center[1] - t * mp.cos(phi)
        u, v = x * mp.cos(phi) + y * mp.sin(phi), -x * mp.sin(phi) + y * mp.cos(phi)
        cut = mp.sqrt(mp.mpf(radius) ** 2 - v**2)
        return mp.atan2(u, center[2]) - side * mp.asin(cut / mp.sqrt(u**2 + mp.mpf(center[2]) ** 2))

    return (angle(h) - angle(-h)) / (2 * h)


def grazing_value() -> float:
    """`limb_elevation` close to a grazing slice against those differences."""
    import jax.numpy as jnp

    from firstorder.visibility import limb_elevation

    center, axes, _, side = LIMBS[0]
    radius = axes[0][0]
    phi0 = np.arctan2(center[1], center[0]) + np.arcsin(radius / np.hypot(*center[:2]))
    with mp.workdps(40):
        phi = mp.mpf(phi0 - 1e-4)
        truth = float(_across(center, radius, phi, side))
        C0, S0 = mp.cos(phi), mp.sin(phi)
        u, v = center[0] * C0 + center[1] * S0, -center[0] * S0 + center[1] * C0
        cut = mp.sqrt(mp.mpf(radius) ** 2 - v**2)
        D2 = mp.sqrt(u**2 + mp.mpf(center[2]) ** 2 - cut**2)
        alpha = mp.atan2(u, center[2]) - side * mp.asin(cut / mp.sqrt(u**2 + center[2] ** 2))
        p = [D2 * mp.sin(alpha) * C0, D2 * mp.sin(alpha) * S0, D2 * mp.cos(alpha)]
        n = [(p[i] - center[i]) / radius for i in range(3)]
        p, n = (np.array([float(c) for c in a]) for a in (p, n))
    found = limb_elevation(jnp.asarray(p), jnp.asarray(n), float(phi))
    return abs(float(found.alpha_v) / truth - 1.0)


ELEVATION = "firstorder.visibility.elevation"
NONE = {"fourier": na("no spectrum")}


def _pair(kind, part, bound=1e-11):
    """The two numeric routes for one rate, relative to its size."""
    return {
        "autodiff": Check(lambda: against_autodiff(kind, part), bound),
        "brute_force": Check(lambda: against_bisection(kind, part), bound),
    } | NONE


ROWS = [
    Row(
        "R07.38",
        "definition",
        implements=f"{ELEVATION}.Elevation",
        symbolic=na("definition"),
        autodiff=na("no derivative"),
        brute_force=Check(traced_visibility, 0.0),
        **NONE,
    ),
    Row(
        "R07.39",
        "identity",
        implements=f"{ELEVATION}.Elevation",
        symbolic=step_derivative,
        autodiff=Check(lambda: weighed("autodiff"), 1e-12),
        brute_force=Check(lambda: weighed("brute"), 1e-12),
        **NONE,
        note="In the sense of distributions.",
    ),
    Row(
        "R07.40",
        "identity",
        implements=f"{ELEVATION}.Elevation.alpha_x",
        symbolic=chain,
        **_pair("both", "x"),
    ),
    Row(
        "R07.41",
        "identity",
        implements=f"{ELEVATION}.Elevation.alpha_y",
        symbolic=chain,
        **_pair("both", "y"),
        note="alpha_y = alpha_u sin(phi) + alpha_v cos(phi).",
    ),
    Row(
        "R07.42",
        "identity",
        implements=f"{ELEVATION}.limb_elevation",
        symbolic=motion,
        autodiff=Check(lambda: motion_error("autodiff", False), 1e-12),
        brute_force=Check(lambda: motion_error("brute", False), 1e-12),
        **NONE,
    ),
    Row(
        "R07.43",
        "identity",
        implements=f"{ELEVATION}.limb_elevation",
        symbolic=stays_in_the_plane,
        autodiff=Check(lambda: motion_error("autodiff", True), 1e-12),
        brute_force=Check(lambda: motion_error("brute", True), 1e-12),
        **NONE,
    ),
    Row(
        "R07.44",
        "identity",
        implements=f"{ELEVATION}.limb_elevation",
        symbolic=tangent_plane,
        autodiff=Check(lambda: along_any("autodiff"), 1e-12),
        brute_force=Check(lambda: along_any("brute"), 1e-12),
        **NONE,
        note="Derived without the tangent plane, from the least value along the ray of any "
        "function with the blocker's surface for a zero set; its curvature drops out. On a "
        "receiver that bends, m becomes m + omega x p.",
    ),
    Row(
        "R07.45",
        "identity",
        implements=f"{ELEVATION}.limb_elevation",
        symbolic=tangent_plane,
        **_pair("both", "u"),
        note="The sign is the opposite of (36)'s because the angle grows towards +u.",
    ),
    Row(
        "R07.46",
        "identity",
        implements=f"{ELEVATION}.limb_elevation",
        symbolic=lambda: [*tangent_plane(), second_of_a_limb()],
        autodiff=Check(
            lambda: max(against_autodiff("limb", "v"), against_autodiff("limb", "bend")), 1e-11
        ),
        brute_force=Check(
            lambda: max(against_bisection("limb", "v"), against_bisection("limb", "bend")), 1e-11
        ),
        **NONE,
        note="Ours: the second derivatives, -(q_i . H q_j - s_i s_j / (w . H w)) / (D c . n) with "
        "H = dn, q_i = m_i + alpha_i D c, s_i = w . H q_i + (n . c) alpha_i.",
    ),
    Row(
        "R07.72",
        "identity",
        implements=f"{ELEVATION}.rim_elevation",
        symbolic=lambda: [*straight_edge(), second_of_a_rim()],
        autodiff=Check(
            lambda: max(against_autodiff("rim", "v"), against_autodiff("rim", "bend")), 1e-11
        ),
        brute_force=Check(
            lambda: max(against_bisection("rim", "v"), against_bisection("rim", "bend")), 1e-11
        ),
        **NONE,
        note="k need not be across the ray. Ours: the second derivatives, for bent edges too.",
    ),
    Row(
        "R07.sDa",
        "identity",
        implements=f"{ELEVATION}.rim_elevation",
        symbolic=reduces,
        autodiff=na("one route"),
        brute_force=Check(same_number, 1e-8),
        **NONE,
        note="For n = k x w of any length, so for every k in the tangent plane, not only for the "
        "one that is orthogonal to w. With n = -k x w both signs change and the ratio does not.",
    ),
    Row(
        "R07.fn4",
        "approximation",
        implements=f"{ELEVATION}.limb_elevation",
        symbolic=grazing,
        autodiff=na("one route"),
        brute_force=Check(lambda: max(grazing_order(), grazing_value()), 1e-3),
        **NONE,
        note="Exponent -1/2, fitted to 1e-3 over phi0 - phi from 1e-9 to 1e-6 on a ball; it asks "
        "for a limb that bends where the slice grazes it. A flat one gives an exponent nearer to "
        "-1, still integrable; a corner gives none.",
    ),
]
