"""What shapes hide of the hemisphere, in closed form or by plain quadrature: oracles.

Nothing here knows of slices: caps by Gauss and Bonnet, polygons by Van Oosterom and Strackee,
cones by a contour in the direction's own parameter. The receiver is at the origin, its normal +z.
"""

import mpmath as mp
import numpy as np


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cap(center, radius):
    """Solid angle that a ball hides above the horizon."""
    d = mp.sqrt(_dot(center, center))
    beta, gamma = mp.asin(radius / d), mp.acos(center[2] / d)
    if gamma + beta <= mp.pi / 2:
        return 2 * mp.pi * (1 - mp.cos(beta))
    if gamma - beta >= mp.pi / 2:
        return mp.mpf(0)
    return _lens(beta, mp.pi / 2, mp.cos(gamma))


def two_caps(one, two):
    """Solid angle of the union of two balls above the horizon that overlap in direction."""
    (c, r), (d, s) = one, two
    lengths = [mp.sqrt(_dot(v, v)) for v in (c, d)]
    apart = _dot(c, d) / (lengths[0] * lengths[1])
    lens = _lens(mp.asin(r / lengths[0]), mp.asin(s / lengths[1]), apart)
    return cap(c, r) + cap(d, s) - lens


def _lens(one, two, cosine):
    """Area of the intersection of two caps by Gauss and Bonnet: two arcs and two corners."""
    sine = mp.sqrt(1 - cosine**2)
    arcs = [
        2 * mp.cos(a) * mp.acos((mp.cos(b) - mp.cos(a) * cosine) / (mp.sin(a) * sine))
        for a, b in ((one, two), (two, one))
    ]
    corner = mp.acos((cosine - mp.cos(one) * mp.cos(two)) / (mp.sin(one) * mp.sin(two)))
    return 2 * mp.pi - sum(arcs) - 2 * corner


def ellipsoid(center, axes, points=512):
    """Solid angle and cosine-weighted one of an ellipsoid above the horizon: a periodic contour.

    The trapezoid rule converges geometrically.
    """
    inverse = np.linalg.inv(axes)
    e = -inverse @ center  # the eye, where the ellipsoid is the unit ball
    square = e @ e
    around = np.linalg.qr(np.column_stack([e, np.eye(3)]))[0]
    t = 2.0 * np.pi * np.arange(points) / points
    ring = np.sqrt(1.0 - 1.0 / square)
    q = e[:, None] / square + ring * (
        np.outer(around[:, 1], np.cos(t)) + np.outer(around[:, 2], np.sin(t))
    )
    dq = ring * (np.outer(around[:, 2], np.cos(t)) - np.outer(around[:, 1], np.sin(t)))
    p, v = (axes @ q).T + center, (axes @ dq).T
    turn = p[:, 0] * v[:, 1] - p[:, 1] * v[:, 0]
    far, flat = np.linalg.norm(p, axis=1), p[:, 0] ** 2 + p[:, 1] ** 2
    step = 2.0 * np.pi / points
    solid = step * np.sum((1.0 - p[:, 2] / far) * turn / flat)
    return abs(solid), abs(0.5 * step * np.sum(turn / far**2))


def triangle(a, b, c):
    """Signed solid angle of a triangle above the horizon."""
    la, lb, lc = (mp.sqrt(_dot(v, v)) for v in (a, b, c))
    cross = [b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2] for i in range(3)]
    below = la * lb * lc + _dot(a, b) * lc + _dot(a, c) * lb + _dot(b, c) * la
    return 2 * mp.atan2(_dot(a, cross), below)


def box(low, high):
    """Solid angle of an upright box above the horizon, seen from outside: its front faces."""
    low = [low[0], low[1], max(low[2], mp.mpf(0))]
    total = mp.mpf(0)
    for axis in range(3):
        for face in (low, high):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            corners = []
            for u, v in (
                (low[i], low[j]),
                (high[i], low[j]),
                (high[i], high[j]),
                (low[i], high[j]),
            ):
                p = [mp.mpf(0)] * 3
                p[axis], p[i], p[j] = face[axis], u, v
                corners.append(p)
            total += abs(triangle(*corners[:3])) + abs(triangle(corners[0], *corners[2:]))
    return total / 2  # every direction that meets the box meets one front and one back face


def cylinder(flat, radius, height):
    """Solid angle of an upright cylinder on the floor, its axis at the distance `flat`, seen below.

    Over each azimuth it hides the angles below the near point of its upper rim.
    """

    def hidden(psi):
        square = radius**2 - (flat * mp.sin(psi)) ** 2
        near = flat * mp.cos(psi) - mp.sqrt(max(square, 0))  # rounding, where it grazes
        return height / mp.sqrt(height**2 + near**2)

    end = mp.asin(radius / flat)
    # psi = end sin(s) takes the root at the ends away.
    return mp.quad(
        lambda s: 2 * hidden(end * mp.sin(s)) * end * mp.cos(s), [0, mp.pi / 4, mp.pi / 2]
    )
