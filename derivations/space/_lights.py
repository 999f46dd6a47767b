"""A rectangular light over a receiver, bare or half hidden: irradiance with 40 digits.

Lambert's sum over the edges of what is seen, differenced. Nothing here is the library's.
"""

from __future__ import annotations

import functools
import itertools

import mpmath as mp
import numpy as np

LIGHT = ((-0.5, 0.7), (-0.3, 0.9))  # at z = 1, facing down, radiance 1
BLOCKER = ((0.1, 0.55), (0.0, 0.37))  # at z = 1/2, black; its shadow leaves the light at one side
PLACE = (0.2, 0.1, 0.0)
# The five freedoms in the receiver's own axes, which are the world's here.
FREEDOMS = 5


def polygon(points, eye, normal):
    """Lambert: `E = 1/2 sum angle (n . g)` for a polygon of radiance 1 above the horizon."""
    rays = []
    for p in points:
        d = [a - b for a, b in zip(p, eye, strict=True)]
        length = mp.sqrt(sum(c * c for c in d))
        rays.append([c / length for c in d])
    total = mp.mpf(0)
    for a, b in zip(rays, rays[1:] + rays[:1], strict=True):
        g = [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]
        size = mp.sqrt(sum(c * c for c in g))
        if size == 0:
            continue
        angle = mp.atan2(size, sum(p * q for p, q in zip(a, b, strict=True)))
        total += angle * sum(p * q for p, q in zip(normal, g, strict=True)) / size
    return total / 2


def corners(bounds, z):
    (a, b), (c, d) = bounds
    return [(a, c, z), (b, c, z), (b, d, z), (a, d, z)]


def irradiance(motion, hidden, place=PLACE):
    """E after a motion: a step (3) and a tilt (2) towards x and y."""
    step, tilt = motion[:3], motion[3:]
    eye = [mp.mpf(p) + s for p, s in zip(place, step, strict=True)]
    size = mp.sqrt(tilt[0] ** 2 + tilt[1] ** 2)
    lean = mp.sin(size) / size if size else mp.mpf(1)
    normal = [lean * tilt[0], lean * tilt[1], mp.cos(size)]
    light = [[mp.mpf(v) for v in side] for side in LIGHT]
    E = polygon(corners(light, mp.mpf(1)), eye, normal)
    if not hidden:
        return E
    k = (1 - eye[2]) / (mp.mpf(1) / 2 - eye[2])
    shade = [
        [min(max(e + k * (mp.mpf(v) - e), low), high) for v in side]
        for side, e, (low, high) in zip(BLOCKER, eye[:2], light, strict=True)
    ]
    return E - polygon(corners(shade, mp.mpf(1)), eye, normal)


@functools.cache
def motion(hidden, place=PLACE):
    """Value, gradient (5,) and Hessian (5, 5), by central differences with 40 digits."""
    with mp.workdps(40):
        h = mp.mpf(10) ** -9
        unit = [[h if i == j else mp.mpf(0) for j in range(FREEDOMS)] for i in range(FREEDOMS)]

        def at(*moves):
            return irradiance([mp.fsum(m) for m in zip(*moves, strict=True)], hidden, place)

        def back(m):
            return [-v for v in m]

        zero = [mp.mpf(0)] * FREEDOMS
        E = at(zero)
        plus, minus = [at(u) for u in unit], [at(back(u)) for u in unit]
        gradient = [(p - m) / (2 * h) for p, m in zip(plus, minus, strict=True)]
        H = np.zeros((FREEDOMS, FREEDOMS))
        for i, j in itertools.combinations_with_replacement(range(FREEDOMS), 2):
            if i == j:
                H[i, i] = (plus[i] - 2 * E + minus[i]) / h**2
            else:
                a, b = unit[i], unit[j]
                corner = at(a, b) - at(a, back(b)) - at(back(a), b) + at(back(a), back(b))
                H[i, j] = H[j, i] = corner / (4 * h**2)
        return float(E), np.array(gradient, float), H


def seen(directions, hidden, place=PLACE, xp=np):
    """Distance, and whether it is the light, for unit directions (..., 3); in NumPy, or in JAX."""

    def reach(bounds, height):
        t = (height - place[2]) / directions[..., 2]
        x, y = place[0] + t * directions[..., 0], place[1] + t * directions[..., 1]
        (a, b), (c, d) = bounds
        return xp.where((t > 0) & (x > a) & (x < b) & (y > c) & (y < d), t, xp.inf)

    lamp = reach(LIGHT, 1.0)
    block = reach(BLOCKER, 0.5) if hidden else xp.full_like(lamp, xp.inf)
    return xp.minimum(lamp, block), lamp < block


def samples(where, hidden, place=PLACE):
    """What the cells see: the library's `Samples`, without the library's tracer."""
    import jax.numpy as jnp

    from firstorder.space.estimators._irradiance_forms import Samples

    w = where.directions
    distance, lit = seen(w, hidden, place, jnp)
    met = jnp.isfinite(distance)
    down = jnp.broadcast_to(jnp.array([0.0, 0.0, -1.0], w.dtype), w.shape)
    normal = jnp.where(met[..., None], down, -w)
    return Samples(
        where,
        jnp.where(lit, 1.0, 0.0).astype(w.dtype),
        distance,
        normal,
        jnp.where(met, w[..., 2], 1.0),
        jnp.where(lit, 0, jnp.where(met, 1, -1)),
    )


MOST = (64, 256)


def jittered(rows, hidden, measure="cosine", seed=0, sets=8, borders=None):
    """`Samples` of jittered cells, made in NumPy, with copies so that all sizes have one shape.

    A copy is a cell of no size beside its original: no jump, no weight, no difference.
    """
    import jax.numpy as jnp

    from firstorder.space.estimators._irradiance_forms import Samples
    from firstorder.space.estimators.strata import Strata

    columns = 4 * rows
    if borders is None:
        even = np.arange(rows + 1) / rows
        theta = np.arcsin(np.sqrt(even)) if measure == "cosine" else np.arccos(1.0 - even)
        phi = 2.0 * np.pi * np.arange(columns + 1) / columns
    else:
        theta, phi = borders
    up, across = np.random.default_rng(seed).uniform(size=(2, sets, rows, columns))
    height = np.sin(theta) ** 2 if measure == "cosine" else 1.0 - np.cos(theta)
    height = height[:-1, None] + up * np.diff(height)[:, None]
    cosine = np.sqrt(1.0 - height) if measure == "cosine" else 1.0 - height
    sine, f = np.sqrt(1.0 - cosine**2), phi[:-1] + across * np.diff(phi)
    w = np.stack([sine * np.cos(f), sine * np.sin(f), cosine], -1)
    area = np.diff(0.5 * np.sin(theta) ** 2 if measure == "cosine" else -np.cos(theta))
    weights = area[:, None] * np.diff(phi) / (cosine if measure == "cosine" else 1.0)
    distance, lit = seen(w, hidden)
    met = np.isfinite(distance)
    times = [m // n for m, n in zip(MOST, (rows, columns), strict=True)]

    def copied(a):
        return jnp.asarray(np.repeat(np.repeat(a, times[0], 1), times[1], 2))

    def spread(b, n):
        return jnp.asarray(np.concatenate([b[:1], np.repeat(b[1:], n)]))

    where = Strata(
        spread(theta, times[0]), spread(phi, times[1]), copied(w),
        copied(np.broadcast_to(weights, met.shape)) / (times[0] * times[1]),
    )  # fmt: skip
    normal = np.where(met[..., None], [0.0, 0.0, -1.0], -w)
    return Samples(
        where,
        copied(lit.astype(float)),
        copied(distance),
        copied(normal),
        copied(np.where(met, cosine, 1.0)),
        copied(np.where(lit, 0, np.where(met, 1, -1))),
    )
