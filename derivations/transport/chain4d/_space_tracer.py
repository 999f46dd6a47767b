"""Rays off a paraboloid, in plain NumPy: what the first order in space is judged by."""

from __future__ import annotations

import numpy as np


def tilted(angle) -> np.ndarray:
    """Axes as columns of a frame whose normal is the ray at this longitude."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def spun(angle) -> np.ndarray:
    """Axes as columns, turned about the normal."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def hit(S, p, d):
    """Where the ray p + t d meets `z = x.S x / 2`, next to the origin."""
    a = 0.5 * d[:2] @ S @ d[:2]
    b = p[:2] @ S @ d[:2] - d[2]
    c = 0.5 * p[:2] @ S @ p[:2] - p[2]
    q = p - 2.0 * c / (b - np.sqrt(b * b - 4.0 * a * c)) * d
    n = np.append(-S @ q[:2], 1.0)
    return q, n / np.linalg.norm(n)


def ray(frame, u):
    """Point and unit direction of the coordinates (x, y, v, w) in a frame."""
    d = frame @ np.array([-u[2], -u[3], 1.0])
    return frame @ np.array([u[0], u[1], 0.0]), d / np.linalg.norm(d)


def coordinates(frame, q, w) -> np.ndarray:
    """(x, y, v, w) of the ray through q along w, across a frame's normal."""
    p, d = frame.T @ q, frame.T @ w
    at = p - d * (p[2] / d[2])
    return np.array([at[0], at[1], -d[0] / d[2], -d[1] / d[2]])


def reflected_ray(S, theta0, theta1, azimuth, roll, u) -> np.ndarray:
    """Incoming coordinates of the ray that a mirror sends out at the coordinates u."""
    p, d = ray(spun(azimuth) @ tilted(theta1), u)
    q, n = hit(S, p, d)
    return coordinates(tilted(theta0) @ spun(-roll), q, 2.0 * (n @ d) * n - d)


def reflected_light(light, S, sigma, theta0, theta1, azimuth, roll, u, nodes=24) -> float:
    """Light about the direction u off a lobe `exp(-g^2 / 2 sigma^2) / (2 pi sigma^2)`.

    g is the angle between the outgoing direction and the mirror image of the incoming one; the sum
    runs over the sphere about the outgoing direction, by rings.
    """
    p, d = ray(spun(azimuth) @ tilted(theta1), u)
    q, n = hit(S, p, d)
    a = np.cross(d, [0.0, 1.0, 0.0])
    a /= np.linalg.norm(a)
    b = np.cross(d, a)
    t, weight = np.polynomial.legendre.leggauss(nodes)
    angle, weight = 3.5 * sigma * (t + 1.0), 3.5 * sigma * weight
    frame, total = tilted(theta0) @ spun(-roll), 0.0
    for g, dg in zip(angle, weight, strict=True):
        lobe = np.exp(-0.5 * (g / sigma) ** 2) / (2.0 * np.pi * sigma**2) * np.sin(g) * dg
        for turn in 2.0 * np.pi * np.arange(nodes) / nodes:
            mirror = np.cos(g) * d + np.sin(g) * (np.cos(turn) * a + np.sin(turn) * b)
            w = 2.0 * (n @ mirror) * n - mirror
            total += lobe * 2.0 * np.pi / nodes * light(coordinates(frame, q, w))
    return float(total)


def jacobian(function, size=4, h=1e-4) -> np.ndarray:
    """Differences of fourth order about zero."""
    columns = [
        (8.0 * (function(h * e) - function(-h * e)) - function(2 * h * e) + function(-2 * h * e))
        / (12.0 * h)
        for e in np.eye(size)
    ]
    return np.stack(columns, axis=-1)
