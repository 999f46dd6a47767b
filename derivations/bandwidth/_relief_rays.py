"""Rays that meet waves, one by one in NumPy: what an eye sees by a mirror in waves, without laws.

The eye is far, at the angle `view`. Its ray through u on the base runs along (u - t tan view, t),
meets the waves `a sin(2 pi f x)` and goes on as a mirror sends it. Where it goes is told by where
that line crosses the base, and its angle.
"""

import numpy as np


def met(u, a, f, view):
    """Where on the waves the eye's ray through u ends: x with `x + a sin(2 pi f x) tan view = u`.

    By bisection in the height, for waves that are nowhere hidden: `2 pi f a |tan view| < 1`.
    """
    slant = np.tan(view)
    high, low = np.full_like(u, a), np.full_like(u, -a)
    for _ in range(60):
        middle = 0.5 * (high + low)
        over = middle > a * np.sin(2.0 * np.pi * f * (u - middle * slant))
        high, low = np.where(over, middle, high), np.where(over, low, middle)
    return u - 0.5 * (high + low) * slant


def normal(x, a, f):
    """Angle of the waves' normal."""
    return np.arctan(2.0 * np.pi * f * a * np.cos(2.0 * np.pi * f * x))


def traced(u, a, f, view):
    """Where on the base, and from what angle, light comes that goes to the eye: (x, theta)."""
    x = met(u, a, f, view)
    theta = 2.0 * normal(x, a, f) - view
    return x + a * np.sin(2.0 * np.pi * f * x) * np.tan(theta), theta


def bumped(u, a, f, view):
    """The same of normals on a flat base."""
    return u, 2.0 * normal(u, a, f) - view


def flat(u, a, f, view):
    """The same of a flat mirror."""
    return u, 0.0 * u - view


def averaged(light, width, period, phases=512):
    """Middles of 16 Gaussian pixels over a period, and what each gets of `light(u)`, complex."""
    t = np.linspace(-6.0, 6.0, 12 * phases + 1)
    weight = np.exp(-0.5 * t**2)
    weight /= weight.sum()
    middles = np.linspace(0.0, period, 16, endpoint=False)
    return middles, np.array([weight @ light(m + width * t) for m in middles])
