"""Exact rays off a circular mirror in plain NumPy: the oracle of the bandwidths.

Shares no code with `firstorder`. The mirror is the circle `y = kappa (x^2 + y^2) / 2` through the
origin with the normal +y there: concave for kappa > 0, a line for 0, convex for kappa < 0. Angles
turn counter-clockwise from +y.
"""

from __future__ import annotations

import itertools

import numpy as np


def direction(a):
    """Unit vector at angle `a` from +y."""
    return np.stack([-np.sin(a), np.cos(a)], axis=-1)


def angle(w):
    """Inverse of `direction`."""
    return np.arctan2(-w[..., 0], w[..., 1])


def dot(a, b):
    """Scalar product along the last axis."""
    return np.sum(a * b, axis=-1)


def normal(P, kappa):
    """Gradient of `y - kappa (x^2 + y^2) / 2`, of unit length on the mirror."""
    kappa = np.asarray(kappa)
    return np.stack([-kappa * P[..., 0], 1.0 - kappa * P[..., 1]], axis=-1)


def hit(start, w, kappa):
    """Where the ray leaves the mirror's front side: the root of the quadratic that is it.

    The discriminant, cos^2 of the incidence, is written without cancellation far from the mirror.
    """
    F = start[..., 1] - 0.5 * kappa * dot(start, start)
    N = normal(start, kappa)
    sin_i = w[..., 0] * N[..., 1] - w[..., 1] * N[..., 0]
    t = 2.0 * F / (np.sqrt(1.0 - sin_i**2) - dot(w, N))
    return start + t[..., None] * w


def reflect(w, N):
    """Mirror image of a direction of flight."""
    return w - 2.0 * dot(w, N)[..., None] * N


def eye(d, theta):
    """The eye that sees the origin from distance d under the angle theta."""
    return np.asarray(d)[..., None] * direction(theta)


def seen(d, theta, kappa, psi):
    """Where on the mirror the eye looks, and the angle that the light there comes from.

    Args:
        d: distance from the eye to the origin.
        theta: angle under which the eye sees the origin.
        kappa: curvature of the mirror.
        psi: angle of the ray towards the eye; theta hits the origin.
    """
    w = -direction(psi)
    P = hit(eye(d, theta), w, kappa)
    return P, angle(reflect(w, normal(P, kappa)))


def rate(function, at, h=1e-3):
    """Derivative by central differences, extrapolated three times: error O(h^8)."""
    first = [
        (function(at + s) - function(at - s)) / (2.0 * s) for s in (h, h / 2.0, h / 4.0, h / 8.0)
    ]
    for k in (4.0, 16.0, 64.0):
        first = [(k * b - a) / (k - 1.0) for a, b in itertools.pairwise(first)]
    return first[0]


def step(d, kappa, theta):
    """A difference step in angle that suits the configuration: small beside its radii of change."""
    c = np.cos(theta)
    return 0.02 * np.minimum(c**2, c**2 / (1.0 + np.abs(kappa) * d / c))


def traced_frequency(d, kappa, theta):
    """Cycles at the eye for each cycle of the environment, by differences of traced rays."""
    return np.abs(rate(lambda p: seen(d, theta, kappa, p)[1], theta, step(d, kappa, theta)))


def traced_edge(d, kappa, theta, depth, theta_edge):
    """Rates at the eye of (mirrored angle minus the edge's angle) and of the edge's angle.

    The edge of the blocker stands still, `depth` from the origin in the direction theta_edge.
    """
    edge = eye(depth, theta_edge)

    def angles(psi):
        P, mirrored = seen(d, theta, kappa, psi)
        at_edge = angle(edge - P)
        return np.stack([mirrored - at_edge, at_edge])

    h = np.minimum(step(d, kappa, theta), 0.02 * depth * np.cos(theta) / d)
    return rate(angles, theta, h)


def chord_frequency(d, kappa, theta):
    """The same by the sine rule in the triangle (eye, centre, hit), for a circle of radius R.

    `sin i = D sin(phi) / R`, and a reflection turns the ray by pi - 2 i: no curvature, no
    footprint, no derivative of a normal is used.
    """
    R = 1.0 / np.abs(kappa)
    E = eye(d, theta)
    to_center = np.stack([np.zeros_like(R), 1.0 / kappa], -1) - E
    D = np.sqrt(dot(to_center, to_center))
    D_cos_phi = dot(to_center, -direction(theta))
    D_sin_phi = np.sqrt(np.maximum(D**2 - D_cos_phi**2, 0.0))
    cos_i = np.sqrt(1.0 - (D_sin_phi / R) ** 2)
    return np.abs(2.0 * D_cos_phi / (R * cos_i) + np.sign(kappa))


def configurations(count, seed, sign=None):
    """Log-uniform curvatures and distances, |kappa| d from 1e-4 to 1e4; angles up to 85 degrees."""
    rng = np.random.default_rng(seed)
    kappa = 10.0 ** rng.uniform(-2, 2, count)
    kappa = kappa * (rng.choice([-1.0, 1.0], count) if sign is None else sign)
    d = 10.0 ** rng.uniform(-2, 2, count)
    theta = rng.uniform(-1.0, 1.0, count) * np.deg2rad(85.0)
    return d, kappa, theta


def traced_frequency_in_space(d, S, theta, h=2e-3):
    """Largest turn of the mirrored ray per turn of the eye's, off `z = r . S r / 2` in space.

    The eye is at distance d from the origin, theta from +z, in the xz plane. Rays are met by
    Newton steps; directions are compared as vectors, so no frame of angles enters.
    """
    eye3 = d * np.array([np.sin(theta), 0.0, np.cos(theta)])
    to_eye = eye3 / d
    across = np.array([[np.cos(theta), 0.0, -np.sin(theta)], [0.0, 1.0, 0.0]])
    h = h * np.cos(theta) ** 2 / (1.0 + d)

    def mirrored(a):
        w = -(to_eye + a @ across)
        w, length, N = w / np.sqrt(w @ w), d, np.array([0.0, 0.0, 1.0])
        for _ in range(8):
            P = eye3 + length * w
            slope = S @ P[:2]
            N = np.array([-slope[0], -slope[1], 1.0])
            length = length - (P[2] - 0.5 * P[:2] @ slope) / (w @ N)
        N = N / np.sqrt(N @ N)
        return w - 2.0 * (w @ N) * N

    columns = [rate(lambda s, e=e: mirrored(s * e), 0.0, h) for e in np.eye(2)]
    return float(np.linalg.norm(np.stack(columns, -1), 2))
