"""What the numeric routes of reflection in space share: an ellipsoid, light, and sums in NumPy.

Written apart from the library: implicit surfaces instead of charts, one product rule for all
directions instead of polar coordinates about each, differences instead of derivatives.
"""

from __future__ import annotations

import functools

import numpy as np

from derivations.squares import FIRST

RADII = np.array([1.0, 0.7, 0.5])
LAMP = np.array([0.6, 1.1, 2.2])
STEPS = np.arange(-4, 5)
SHARPNESS = 7.0


def unit(a):
    """A vector of length one."""
    a = np.asarray(a, float)
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def on_ellipsoid(a, radii=RADII):
    """The point of the ellipsoid above a direction; a motion along a tangent, to first order."""
    a = np.asarray(a, float)
    return a / np.sqrt(np.sum((a / radii) ** 2))


def normal_at(x, radii=RADII):
    """Unit outward normal: the gradient of the implicit function."""
    return unit(x / radii**2)


def shape_operator(x, tangents, radii=RADII):
    """`-T^T dn` from the implicit function's Hessian."""
    slope = 2.0 * x / radii**2
    return -tangents.T @ np.diag(2.0 / radii**2) @ tangents / np.linalg.norm(slope)


def frame_at(x, turn, radii=RADII):
    """Columns t, b, n, with t, b turned in the tangent plane."""
    n = normal_at(x, radii)
    t = unit(np.cross(n, [0.3, -0.5, 0.8]))
    b = np.cross(n, t)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * t + s * b, c * b - s * t, n], 1)


def principal_frame(x, radii=RADII):
    """Columns t, b, n with t, b principal, and the two curvatures."""
    axes = frame_at(x, 0.0, radii)
    kappas, V = np.linalg.eigh(shape_operator(x, axes[:, :2], radii))
    t = axes[:, :2] @ V[:, 0]
    return np.stack([t, np.cross(axes[:, 2], t), axes[:, 2]], 1), kappas


def smallest_rotation(n, m):
    """The rotation that carries unit vector n to m and leaves n x m alone (Rodrigues)."""
    v = np.cross(n, m)
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + K + K @ K / (1.0 + n @ m)


def light(x, w, m=np):
    """Smooth light: a sky that varies with place, and a lamp at a finite distance."""
    sky = m.exp(0.6 * w[..., 0] - 0.4 * w[..., 1] * w[..., 2] + 0.3 * w[..., 2] * x[1] + 0.2 * x[0])
    to = LAMP - x
    square = m.sum(to * to)
    lamp = m.exp(4.0 * (m.sum(w * to, -1) / m.sqrt(square) - 1.0)) / square
    return 0.3 * sky + 2.0 * lamp


@functools.cache
def sphere(size: int = 40):
    """A product rule on the sphere of directions: nodes (k, 3) and weights."""
    z, weight = np.polynomial.legendre.leggauss(size)
    phi = np.pi * np.arange(2 * size) / size
    s = np.sqrt(1.0 - z**2)[:, None]
    w = np.stack([s * np.cos(phi), s * np.sin(phi), z[:, None] + 0.0 * phi], -1)
    return w.reshape(-1, 3), np.repeat(weight, 2 * size) * np.pi / size


def bell(t, k=SHARPNESS):
    """The lobe: a von Mises-Fisher bell of the cosine."""
    return k / (2.0 * np.pi * (1.0 - np.exp(-2.0 * k))) * np.exp(k * (t - 1.0))


def glossy(x, n, to_eye, of=light):
    """Light reflected to the eye: the sum over all directions."""
    w, weights = sphere()
    r = 2.0 * (n @ to_eye) * n - to_eye
    return float(np.sum(weights * of(x, w) * bell(w @ r)))


def slope(f, step=0.01):
    """df/ds at 0 by central differences of eighth order."""
    return sum(c * np.asarray(f(step * s)) for c, s in zip(FIRST, STEPS, strict=True) if s) / step


PLACE = on_ellipsoid([0.5, 0.4, 0.6])
AXES = frame_at(PLACE, 0.6)
S = shape_operator(PLACE, AXES[:, :2])
TO_EYE = unit(AXES @ [0.4, -0.3, 0.8])
LOCAL = unit([0.3, -0.5, 0.7])  # a direction in the local frame


def moved(i, s, axes=AXES, place=PLACE, radii=RADII):
    """Position and normal a distance s along the i-th tangent."""
    x = on_ellipsoid(place + s * axes[:, i], radii)
    return x, normal_at(x, radii)


@functools.cache
def truth():
    """Derivatives of the glossy reflection along t, b and over two outgoing directions."""
    along = [slope(lambda s, i=i: glossy(*moved(i, s), TO_EYE)) for i in (0, 1)]
    n = AXES[:, 2]
    e1 = unit(np.cross(TO_EYE, [0.2, 0.9, -0.3]))
    turns = np.stack([e1, np.cross(TO_EYE, e1)])
    over = [
        slope(lambda s, e=e: glossy(PLACE, n, TO_EYE * np.cos(s) + e * np.sin(s))) for e in turns
    ]
    return np.array(along), turns, np.array(over)
