"""Edge angles found without the library: by rays alone in 40 digits, and as roots in JAX."""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np

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
