"""What the derivation of `gathering` measures: the library's forms against `_lights`.

And what the paper prints, in NumPy, for the counterexamples.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np

from derivations.space import _lights as lights

# --- numbers --------------------------------------------------------------------------------------


def gauss(n, low, high):
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (high + low) + 0.5 * (high - low) * x, 0.5 * (high - low) * w


@functools.cache
def frozen():
    """Value, gradient and Hessian of the surface-area integral over the bare light."""
    import jax
    import jax.numpy as jnp

    from firstorder.space.estimators._irradiance_forms import Samples, surface_area_estimate
    from firstorder.space.estimators.strata import Strata

    (x, wx), (y, wy) = (gauss(40, *side) for side in lights.LIGHT)
    X, Y = np.meshgrid(x, y, indexing="ij")
    p = np.stack([X, Y, np.ones_like(X)], -1) - lights.PLACE
    distance = np.linalg.norm(p, axis=-1)
    w = p / distance[..., None]
    solid = wx[:, None] * wy * w[..., 2] / distance**2
    borders = np.zeros(X.shape[0] + 1)  # the nodes are those of a rule, and not of cells
    where = Strata(*map(jnp.asarray, (borders, borders, w, solid)))
    down = np.broadcast_to([0.0, 0.0, -1.0], w.shape)
    lit = map(jnp.asarray, (np.ones_like(X), distance, down, w[..., 2], np.zeros(X.shape, int)))
    found = jax.jit(surface_area_estimate)(Samples(where, *lit))
    steps = found.value, found.gradient[:3], found.hessian[:3, :3]
    return [np.asarray(part) for part in steps]


def frozen_error(order):
    from firstorder.checks.tolerance import normwise

    truth = lights.motion(False)[order]
    return normwise(frozen()[order], truth if order == 0 else truth[(slice(3),) * order])


def _light(t, f):
    """A smooth light without symmetry."""
    return np.exp(np.sin(2.0 * t) * np.cos(f - 0.4))


def _quadrature(low, high, left, right, n=24, light=_light):
    (t, wt), (f, wf) = gauss(n, low, high), gauss(n, left, right)
    return np.einsum("i,j,ij", wt * np.sin(t) * np.cos(t), wf, light(t[:, None] + 0.0 * f, f))


def _gathered(where, L, distance=1.0):
    """The library's stratified form of samples that see given radiances at given distances."""
    import jax.numpy as jnp

    from firstorder.space.estimators._irradiance_forms import Samples, stratified_estimate

    L, r = jnp.asarray(L), jnp.broadcast_to(jnp.asarray(distance), jnp.shape(L))
    w, one = where.directions, jnp.ones_like(L)
    return stratified_estimate(Samples(where, L, r, -w, one, jnp.zeros(L.shape, int)))


def split_numbers():
    """(59) with numbers, uneven cells; and the library's sum of a light that is even in each."""
    where, t, f = _uneven()
    cells = [
        (*rows, *columns) for rows in itertools.pairwise(t) for columns in itertools.pairwise(f)
    ]
    whole = _quadrature(0.0, np.pi / 2, 0.2, 0.2 + 2 * np.pi, 60)
    even = np.random.default_rng(5).uniform(0.5, 2.0, len(cells))
    shares = [_quadrature(*cell, light=lambda t, f: np.ones_like(t)) for cell in cells]
    ours = _gathered(where, even.reshape(t.size - 1, f.size - 1)).value
    return max(abs(sum(_quadrature(*c) for c in cells) - whole), float(abs(ours - even @ shares)))


def split_autodiff():
    """(59): the sum does not depend on a border inside."""
    import jax
    import jax.numpy as jnp

    from firstorder.numerics._quadrature import composite_gauss_legendre

    def E(border):
        t, w = composite_gauss_legendre(jnp.asarray(0.0), jnp.asarray(0.5 * jnp.pi), [border], 24)
        return jnp.sum(w * jnp.exp(jnp.sin(2.0 * t)) * jnp.sin(t) * jnp.cos(t))

    return float(abs(jax.jit(jax.grad(E))(jnp.asarray(0.7))))


def constant_per_cell():
    """(60): departure of the fitted order of the error from -2, in the number of rows."""
    from firstorder.checks.tolerance import fitted_order
    from firstorder.space.estimators.strata import hemisphere_strata

    right, sizes, errors = _quadrature(0.0, np.pi / 2, 0.0, 2 * np.pi, 60), [8, 16, 32, 64], []
    for n in sizes:
        t, f = np.linspace(0.0, np.pi / 2, n + 1), np.linspace(0.0, 2 * np.pi, 3 * n + 1)
        middle = _light(0.5 * (t[1:] + t[:-1])[:, None], 0.5 * (f[1:] + f[:-1]))
        errors.append(float(abs(_gathered(hemisphere_strata(t, f), middle).value - right)))
    return abs(fitted_order(sizes, errors) + 2.0)


@functools.cache
def _uneven():
    from firstorder.space.estimators.strata import hemisphere_strata

    t = np.array([0.0, 0.3, 0.5, 1.2, np.pi / 2])
    f = 0.2 + np.array([0.0, 0.7, 2.0, 3.0, 5.5, 2 * np.pi])
    return hemisphere_strata(t, f), t, f


def cell_numbers():
    """(61): the library's cells against quadrature of the cosine."""
    where, t, f = _uneven()
    x, w = np.polynomial.legendre.leggauss(20)
    mid, half = 0.5 * (t[1:] + t[:-1]), 0.5 * np.diff(t)
    nodes = mid[:, None] + half[:, None] * x
    rows = half * np.sum(w * np.sin(nodes) * np.cos(nodes), 1)
    return float(np.max(np.abs(np.asarray(where.projected) - rows[:, None] * np.diff(f))))


def cell_autodiff():
    """(61): by its upper border a cell grows as the integrand there."""
    import jax
    import jax.numpy as jnp

    from firstorder.space.estimators.strata import Strata

    _, t, f = _uneven()
    zero = jnp.zeros((1, 1))

    def share(top):
        borders = jnp.stack([jnp.asarray(t[1]), top])
        return Strata(borders, jnp.asarray(f[:2]), zero[..., None], zero).projected[0, 0]

    true = np.sin(t[2]) * np.cos(t[2]) * (f[1] - f[0])
    return float(abs(jax.jit(jax.grad(share))(jnp.asarray(t[2])) - true))


def summed_by_parts():
    """(62) put right, both ways, with numbers."""
    where, t, f = _uneven()
    L = np.random.default_rng(3).uniform(0.0, 2.0, (t.size - 1, f.size - 1))
    E = float(_gathered(where, L).value)
    s, wide, high = np.sin(t) ** 2, np.diff(f), np.diff(np.sin(t) ** 2)[:, None]
    circles = np.sum((L[:-1] - L[1:]) * wide * s[1:-1, None]) + np.sum(L[-1] * wide)
    meridians = np.sum((np.roll(L, 1, 1) - L) * high * f[:-1]) + 2 * np.pi * np.sum(
        L[:, -1:] * high
    )
    return max(abs(0.5 * circles - E), abs(0.5 * meridians - E))


def summed_autodiff():
    """(62) put right: by the radiance of a cell both sums grow as its projected solid angle."""
    import jax
    import jax.numpy as jnp

    where, t, f = _uneven()
    s, wide, high = np.sin(t) ** 2, np.diff(f), np.diff(np.sin(t) ** 2)[:, None]

    def sums(L):
        circles = jnp.sum((L[:-1] - L[1:]) * wide * s[1:-1, None]) + jnp.sum(L[-1] * wide)
        meridians = jnp.sum((jnp.roll(L, 1, 1) - L) * high * f[:-1])
        return 0.5 * jnp.stack([circles, meridians + 2 * jnp.pi * jnp.sum(L[:, -1:] * high)])

    slopes = jax.jit(jax.jacfwd(sums))(jnp.zeros((t.size - 1, f.size - 1)))
    return float(jnp.max(jnp.abs(slopes - where.projected)))


def wall_motion():
    """(63), (64): the slopes of sin^2 theta and phi of a fixed point, by autodiff."""
    import jax
    import jax.numpy as jnp

    t, f, reach = 0.8, 2.1, 1.7
    point = reach * np.array([np.sin(t) * np.cos(f), np.sin(t) * np.sin(f), np.cos(t)])

    def both(x):
        p = jnp.asarray(point) - jnp.append(x, 0.0)
        return (p[0] ** 2 + p[1] ** 2) / (p @ p), jnp.arctan2(p[1], p[0])

    square, azimuth = jax.jit(jax.jacfwd(both))(jnp.zeros(2))
    u, v = np.array([np.cos(f), np.sin(f)]), np.array([np.sin(f), -np.cos(f)])
    off = square + 2 * np.sin(t) * np.cos(t) ** 2 / reach * u
    return float(np.max(np.abs([off, azimuth - v / (reach * np.sin(t))])))


@functools.cache
def walls_moved():
    """(63), (64): the library's gradient by steps against autodiff of what all walls sweep.

    Walls of uneven cells, each carried along by the nearer of the samples beside it.
    """
    import jax
    import jax.numpy as jnp

    from firstorder.checks.tolerance import normwise

    where, t, f = _uneven()
    rng, shape = np.random.default_rng(6), (t.size - 1, f.size - 1)
    L, r = rng.uniform(0.0, 2.0, shape), rng.uniform(0.4, 3.0, shape)

    def moved(theta, phi, distance, step):
        w = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0.0 * phi]
        return jnp.asarray(np.stack(w, -1) * distance) - step

    def swept(step):
        total = 0.0
        for j, i in np.ndindex(shape):
            if j:  # the circle above the cell
                phi, weight = gauss(20, f[i], f[i + 1])
                p = moved(t[j], phi, min(r[j - 1, i], r[j, i]), step)
                square = jnp.sum(p[:, :2] ** 2, -1) / jnp.sum(p**2, -1)
                total += (L[j - 1, i] - L[j, i]) * 0.5 * jnp.sum(weight * square)
            theta, weight = gauss(20, t[j], t[j + 1])  # the meridian before it
            p = moved(theta, f[i], min(r[j, i - 1], r[j, i]), step)
            weight = weight * np.sin(theta) * np.cos(theta)
            azimuth = jnp.arctan2(p[:, 1], p[:, 0])
            total += (L[j, i - 1] - L[j, i]) * jnp.sum(weight * azimuth)
        return total

    truth = jax.jit(jax.grad(swept))(jnp.zeros(3))
    return max(normwise(_gathered(where, L, r).gradient[:3], truth), wall_motion())


@functools.cache
def gradient_error(hidden, rows=96):
    """The library's stratified gradient by three steps, against the truth."""
    import jax

    from firstorder.checks.tolerance import normwise
    from firstorder.space.estimators._irradiance_forms import stratified_estimate
    from firstorder.space.estimators.strata import hemisphere_strata

    found = jax.jit(
        lambda: (
            stratified_estimate(lights.samples(hemisphere_strata(rows, 4 * rows), hidden)).gradient
        )
    )()
    return normwise(found[:3], lights.motion(hidden)[1][:3])


# --- what is printed ------------------------------------------------------------------------------


def _borders(rows, columns):
    return np.arcsin(np.sqrt(np.arange(rows + 1) / rows)), 2 * np.pi * np.arange(
        columns + 1
    ) / columns


def printed_sum(radiance):
    """(62) as printed, two rows and four columns, one cell of which shines; L = 0 for j = 0."""
    t, f = _borders(2, 4)
    s, L = np.sin(t) ** 2, np.zeros((2, 4))
    L[0, 1] = radiance
    before, below = np.roll(L, 1, 1), np.concatenate([np.zeros((1, 4)), L[:-1]])
    first = np.sum((before - L)[1:] * np.diff(f) * s[1:-1, None])
    return 0.5 * float(first + np.sum((L - below) * np.diff(s)[:, None] * f[:-1]))


def true_sum(radiance, n=400):
    """Its irradiance: the cosine summed over small pieces of the hemisphere."""
    t, f = (np.arange(n) + 0.5) / n * np.pi / 2, (np.arange(n) + 0.5) / n * 2 * np.pi
    inside = (np.sin(t) ** 2 < 0.5)[:, None] & (f > np.pi / 2) & (f < np.pi)
    piece = (np.pi / 2 / n) * (2 * np.pi / n)
    return radiance * float(np.sum(inside * (np.sin(t) * np.cos(t))[:, None]) * piece)


def printed_gradient(rows, half=1.0):
    """(64) as printed, over the bare light: the component along x; (63) with `half` = 1/2."""
    rows = int(rows)
    t, f = _borders(rows, 4 * rows)
    mid = np.arcsin(np.sqrt((np.arange(rows) + 0.5) / rows))[:, None]
    across = 0.5 * (f[1:] + f[:-1])
    w = np.stack([np.sin(mid) * np.cos(across), np.sin(mid) * np.sin(across)], -1)
    w = np.concatenate([w, np.broadcast_to(np.cos(mid), w.shape[:2])[..., None]], -1)
    distance, lit = lights.seen(w, False)
    L, near = lit.astype(float), 1.0 / distance
    circle = np.maximum(near[1:], near[:-1])
    meridian = np.maximum(near, np.roll(near, 1, 1))
    before, below = np.roll(L, 1, 1), np.concatenate([np.zeros_like(L[:1]), L[:-1]])
    inner = t[1:-1, None]
    weight = np.diff(f) * np.sin(inner) * np.cos(inner) ** 2 * circle
    # (63) inserts grad sin^2 = -2 sin cos^2 u / r, (64) drops its sign.
    sign = -1.0 if half != 1.0 else 1.0
    first = sign * np.sum((before - L)[1:] * weight * np.cos(across))
    weight = half * np.diff(np.sin(t) ** 2)[:, None] / np.sin(mid) * meridian
    return float(first + np.sum((L - below) * weight * np.sin(f[:-1])))


def true_gradient(rows):
    return float(lights.motion(False)[1][0])
