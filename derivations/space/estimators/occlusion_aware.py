"""The Hessian of irradiance behind edges: what the light that varies behind an edge adds.

The truth is a rectangle light that a tilted quadrilateral hides in part: the light's outline is
cut by the blocker's projection, and Lambert's formula and differences are taken in 50 digits.
"""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.space.silhouettes.lambert_edge_term import differences
from firstorder.ledger import Check, Row, na

LIGHT = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))  # at z = 1, radiance 1
BLOCKER = ((-0.3, -0.2), (0.15, -0.25), (0.2, 0.3), (-0.25, 0.35))  # on the plane below
SMALL = ((-0.05, -0.06), (0.08, -0.04), (0.06, 0.07), (-0.04, 0.05))
HEIGHT, SLOPE = 0.46, (0.1, 0.12)
GLOW = 0.2  # radiance of the blocker
# On the floor: both penumbrae and shadow, edges of light and blocker crossing at all these.
PLACES = ((0.6, 0.1), (0.5, -0.4), (-0.55, 0.3), (0.35, 0.2), (-0.6, -0.5), (0.1, 0.05))
INSIDE = ((0.1, 0.1), (0.15, -0.1), (-0.1, 0.05))  # here SMALL's outline crosses none


def crossing():
    """Where two edges cross: the area between, against that with the crossing on the nearer edge.

    Two lines with directions t1, t2 move with v1 and v2; their crossing moves with u, where u - v1
    is along t1 and u - v2 along t2. A triangulation pins the crossing to the nearer edge, u = v1.
    Second derivatives of an outline ..., p, q, ... are sums of `p' x q'`.
    """
    v1, v2, t1, t2 = (sp.Matrix(sp.symbols(f"{n}_x {n}_y")) for n in ("v1", "v2", "t1", "t2"))

    def cross(a, b):
        return a[0] * b[1] - a[1] * b[0]

    delta = v2 - v1
    u = v1 + t1 * cross(delta, t2) / cross(t1, t2)
    on_both = [cross(u - v1, t1), cross(u - v2, t2)]
    lost = cross(v1, u) + cross(u, v2) - cross(v1, v2)
    # The jump of light passed on the way along the edge, times what `_uncovered` takes for it.
    n1, n2 = sp.Matrix([t1[1], -t1[0]]), sp.Matrix([t2[1], -t2[0]])
    ours = -delta.dot(n1) * delta.dot(n2) / n2.dot(t1)
    # Smooth light: the level lines run along t2, the change along the edge is grad . t1.
    g = sp.Symbol("g") * n2
    smooth = -delta.dot(n1) * delta.dot(g)
    return [*map(sp.simplify, (*on_both, lost - ours, g.dot(t1) * ours - smooth))]


def _clipped(outline, window):
    """Sutherland and Hodgman: the part of a convex outline inside a counter-clockwise window."""
    for a, b in zip(window, window[1:] + window[:1], strict=True):

        def side(p, a=a, b=b):
            return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])

        kept = []
        for p, q in zip(outline, outline[1:] + outline[:1], strict=True):
            f, g = side(p), side(q)
            if f >= 0:
                kept.append(p)
            if (f >= 0) != (g >= 0):
                kept.append([p[i] + f / (f - g) * (q[i] - p[i]) for i in (0, 1)])
        outline = kept
    return outline


def _projected(outline, x):
    """Projected solid angle of an outline in space, in the precision of its numbers."""
    total, seen = mp.mpf(0), [[p[0] - x[0], p[1] - x[1], p[2]] for p in outline]
    for a, b in zip(seen, seen[1:] + seen[:1], strict=True):
        c = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        size = mp.sqrt(sum(t * t for t in c))
        if size > 0:
            angle = mp.atan2(size, sum(i * j for i, j in zip(a, b, strict=True)))
            total += angle * c[2] / size / 2
    return abs(total)


def partly_hidden(x, blocker=BLOCKER):
    """Irradiance at (x, 0): the light that is left, and the blocker's own."""
    light = [[mp.mpf(c) for c in p] for p in LIGHT]
    corners = [[mp.mpf(p[0]), mp.mpf(p[1])] for p in blocker]
    for p in corners:
        p.append(mp.mpf(HEIGHT) + sum(mp.mpf(m) * c for m, c in zip(SLOPE, p, strict=True)))
    shadow = [[x[i] + (p[i] - x[i]) / p[2] for i in (0, 1)] for p in corners]
    hidden = _clipped(light, shadow)
    left = _projected([[*p, 1] for p in light], x)
    if hidden:
        left -= _projected([[*p, 1] for p in hidden], x)
    return left + mp.mpf(GLOW) * _projected(corners, x)


@functools.cache
def truth(x, blocker=BLOCKER) -> np.ndarray:
    """E, gradient and Hessian (xx, xy, yy) at a place of the floor, exact."""
    return differences(lambda y: partly_hidden(y, blocker), x)


def gathered(x, w, blocker=BLOCKER):
    """Radiance and distance that rays meet from (x, 0), by NumPy."""
    w, (x0, x1) = np.asarray(w, float), x
    up = np.array([-SLOPE[0], -SLOPE[1], 1.0])
    t = (HEIGHT + SLOPE[0] * x0 + SLOPE[1] * x1) / np.where(w @ up > 0, w @ up, np.nan)
    y = np.array([x0, x1]) + t[:, None] * w[:, :2]
    hit = t > 0
    for a, b in zip(np.array(blocker), np.roll(blocker, -1, 0), strict=True):
        hit &= (b[0] - a[0]) * (y[:, 1] - a[1]) - (b[1] - a[1]) * (y[:, 0] - a[0]) >= 0
    far = 1.0 / w[:, 2]
    lit = np.all(np.abs(np.array([x0, x1]) + far[:, None] * w[:, :2]) <= 0.5, 1)
    L = np.where(hit, GLOW, np.where(lit, 1.0, 0.0))
    return L, np.where(hit, t, np.where(lit, far, np.inf))


def both(radiance, directions, distances, triangles, neighbours):
    """The estimate without and with the light that varies behind edges, as six numbers each."""
    import jax.numpy as jnp

    from firstorder.space.estimators import occlusion_aware as module

    found = []
    for window in (None,) if neighbours is None else (None, neighbours):
        E, g, H = module.occlusion_aware_estimate(
            radiance, directions, distances, triangles, window
        )
        found.append(jnp.stack([E, *g, H[0, 0], H[0, 1], H[1, 1]]))
    return jnp.stack(found)


@functools.cache
def _jitted(step):
    import jax

    return jax.jit(step)


def _plain(*gathered):
    """Without the window, and with half the code to compile."""
    return both(*gathered[:-1], None)[:1]


def estimates(rays, places=PLACES, blocker=BLOCKER, step=both) -> np.ndarray:
    """E, gradient and Hessian at all places, by what `step` returns: (2, places, 6)."""
    from firstorder.space.estimators._triangulation import hemisphere_triangulation

    net = hemisphere_triangulation(rays)
    found = []
    for x in places:
        L, r = (a.astype(net.directions.dtype) for a in gathered(x, net.directions, blocker))
        found.append(_jitted(step)(L, net.directions, r, net.triangles, net.neighbours))
    return np.moveaxis(np.array(found, float), 1, 0)


def errors(estimate, places=PLACES, blocker=BLOCKER) -> np.ndarray:
    """RMS error of E, gradient and Hessian, each over the RMS of the true one."""
    right = np.array([truth(x, blocker) for x in places])
    off = (estimate - right) ** 2
    parts = (slice(0, 1), slice(1, 3), slice(3, 6))
    return np.array([np.sqrt(off[:, p].sum() / (right[:, p] ** 2).sum()) for p in parts])


def inside_the_light() -> float:
    """Relative RMS error of the Hessian at 1024 rays, where no edges cross."""
    return errors(estimates(1024, INSIDE, SMALL, _plain)[0], INSIDE, SMALL)[2]


ROWS = [
    Row(
        "C.space.uncovered",
        "approximation",
        "firstorder.space.estimators.occlusion_aware.occlusion_aware_estimate",
        symbolic=crossing,
        autodiff=na("measured"),
        fourier=na("no spectrum"),
        brute_force=Check(inside_the_light, 0.15),
        note="Relative RMS error of the Hessian where no edges cross: 0.13, 0.055, 0.018 at 256, "
        "1024, 4096 rays, order -0.7. Where they cross: 0.44, 0.43, 0.42 without this term, 0.41, "
        "0.36, 0.28 with it. Curved limbs are left out.",
    ),
]
