"""Pits traced by NumPy: rays between walls, and light that bounces in a groove, solved for.

In flatland a pit is a chain of points below y = 0, from (-D/2, 0) to (D/2, 0), its normals on the
left of each way. Rays come in through the plane y = 0 from the eye, go from wall to wall and leave
through that plane: where and to where, and with what weight.
"""

from __future__ import annotations

import numpy as np


def followed(u, view, points, albedo=1.0, diffuse=None, rng=None, most=400):
    """Where rays leave that come in at u from the angle `view`: x, angle theta, and weight.

    Each wall mirrors, or scatters by Lambert's law where `diffuse` says so. Rays that are still
    inside after `most` bounces keep the weight 0.
    """
    A, B = points[:-1], points[1:]
    along = (B - A) / np.linalg.norm(B - A, axis=-1, keepdims=True)
    normals = np.stack([-along[:, 1], along[:, 0]], -1)
    diffuse = np.zeros(len(A), bool) if diffuse is None else diffuse
    place = np.stack([u, 0.0 * u], -1)
    d = np.broadcast_to([np.sin(view), -np.cos(view)], place.shape).copy()
    weight, last = np.ones(u.shape), np.full(u.shape, -1)
    inside = np.ones(u.shape, bool)
    for _ in range(most):
        i = np.flatnonzero(inside)
        if not i.size:
            break
        t, wall = _nearest(place[i], d[i], last[i], A, B)
        up = np.where(d[i, 1] > 0, -place[i, 1] / np.where(d[i, 1] > 0, d[i, 1], 1.0), np.inf)
        out = (up <= t) & (last[i] >= 0)
        place[i] += np.where(out, up, t)[:, None] * d[i]
        inside[i[out]] = False
        j, hit = i[~out], wall[~out]
        last[j], N = hit, normals[hit]
        weight[j] *= albedo
        d[j] = d[j] - 2.0 * np.sum(d[j] * N, -1, keepdims=True) * N
        rough = diffuse[hit]
        if np.any(rough):
            s = rng.uniform(-1.0, 1.0, np.sum(rough))[:, None]
            N = N[rough]
            d[j[rough]] = np.sqrt(1.0 - s**2) * N + s * np.stack([N[:, 1], -N[:, 0]], -1)
    weight[inside] = 0.0
    return place[:, 0], np.arctan2(-d[:, 0], d[:, 1]), weight


def _nearest(place, d, last, A, B):
    """Distance to the nearest wall but the last one, and which it is."""
    edge, to = B - A, A - place[:, None]
    cross = d[:, None, 0] * edge[:, 1] - d[:, None, 1] * edge[:, 0]
    safe = np.where(cross == 0, 1.0, cross)
    t = (to[..., 0] * edge[:, 1] - to[..., 1] * edge[:, 0]) / safe
    s = (to[..., 0] * d[:, None, 1] - to[..., 1] * d[:, None, 0]) / safe
    meets = (cross != 0) & (t > 0) & (s >= -1e-12) & (s <= 1.0 + 1e-12)
    meets &= np.arange(len(A)) != last[:, None]
    t = np.where(meets, t, np.inf)
    return t.min(-1), t.argmin(-1)


def wedge(half, nodes=64):
    """Nodes on the walls of a groove down to (0, -1), whose walls lean by `half` from upright.

    Places and normals of both walls, weights, and the kernel `cos cos / (2 r)` by which one wall
    lights the other. Near the bottom that is large only where distances from it are alike: the
    logarithms of these are even, down to exp(-12).
    """
    x, w = np.polynomial.legendre.leggauss(nodes)
    s = np.exp(6.0 * (x - 1.0)) / np.cos(half)
    weight = 6.0 * w * s
    ways = np.array([[-np.sin(half), np.cos(half)], [np.sin(half), np.cos(half)]])
    normals = np.array([[np.cos(half), np.sin(half)], [-np.cos(half), np.sin(half)]])
    places = np.array([0.0, -1.0]) + s[:, None] * ways[:, None]
    apart = places[1][None] - places[0][:, None]
    r = np.linalg.norm(apart, axis=-1)
    cosines = (apart @ normals[0]) * -(apart @ normals[1])
    kernel = cosines / (2.0 * r**3)
    return places, normals, weight, kernel


def groove_light(u, view, half, albedo, light, nodes=64, openings=400):
    """What the eye sees at u of a diffuse groove by light(x, theta): walls solved for, forwards.

    Light comes through the opening at x from the angle theta; a wall gets `int L cos d(theta)` of
    it and what the other wall sends, and sends albedo / 2 of all.
    """
    places, normals, weight, kernel = wedge(half, nodes)
    D = 2.0 * np.tan(half)
    x, w = np.polynomial.legendre.leggauss(openings)
    x, w = 0.5 * D * x, 0.5 * D * w
    direct = []
    for wall in (0, 1):
        to = np.stack(np.broadcast_arrays(x, 0.0), -1) - places[wall][:, None]
        r = np.linalg.norm(to, axis=-1)
        fall = (to @ normals[wall]) * to[..., 1] / r**3  # cos d(theta) per metre of the opening
        theta = np.arctan2(-to[..., 0], to[..., 1])
        direct.append(np.sum(w * fall * light(x, theta), -1))
    K = albedo * kernel * weight
    zero = np.zeros_like(K)
    system = np.eye(2 * nodes) - np.block([[zero, K], [albedo * kernel.T * weight, zero]])
    sent = np.linalg.solve(system, 0.5 * albedo * np.concatenate(direct)).reshape(2, nodes)
    return _seen(u, view, half, sent)


def _seen(u, view, half, sent):
    """Light of the walls where the eye's rays end, between their nodes."""
    ways = np.tan(half)
    d = np.array([np.sin(view), -np.cos(view)])
    t = np.stack([
        (s * ways - u) / (d[0] - s * ways * d[1]) for s in (-1.0, 1.0)
    ])  # x = +-(1 + y) tan(half)  # fmt: skip
    t = np.where(t >= 0.0, t, np.inf)
    wall = t.argmin(0)
    depth = 1.0 + np.minimum(t[0], t[1]) * d[1]  # height above the bottom
    nodes = np.polynomial.legendre.leggauss(sent.shape[1])[0]
    at = 1.0 + np.log(np.clip(depth, 1e-9, 1.0)) / 6.0
    found = np.empty(u.shape, complex)
    for k in (0, 1):
        here = wall == k
        parts = [np.interp(at[here], nodes, part) for part in (sent[k].real, sent[k].imag)]
        found[here] = parts[0] + 1j * parts[1]
    return found


def box(u, e, sides, depth, most=100):
    """Where rays leave that come into a box of mirrors at u (n, 2) from the direction e: x, w.

    Its walls are upright and its floor level, so a mirror is a change of sign: the ray goes down
    and up again, and is folded from side to side.
    """
    across = -2.0 * depth * e[:2] / e[2]
    w = np.append(-e[:2], e[2])
    at = (u + across) / sides  # the box is [0, 1]^2 in units of its sides
    folds = np.floor(at)
    back = folds % 2 == 1
    x = np.where(back, 1.0 - (at - folds), at - folds) * sides
    turned = np.where(back, -1.0, 1.0) * w[:2]
    return x, np.concatenate([turned, np.full((len(u), 1), w[2])], -1)
