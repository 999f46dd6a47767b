"""Adaptive quadrature of functions with kinks at unknown places."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from firstorder.checks.tolerance import rounding
from firstorder.numerics._quadrature import gauss_legendre

NODES, START, ROUNDS = 8, 16, 40
HEM = 0.02


class Integral(NamedTuple):
    """An integral and the sum of what its panels changed by when they were last halved."""

    value: complex
    bound: float


def adaptive(
    f: Callable[[np.ndarray], np.ndarray],
    low: float,
    high: float,
    tolerance: float = 1e-14,
    most: int = 1 << 15,
) -> Integral:
    """`int f` over an interval: panels are halved until none changes by more than the tolerance.

    All panels of one round are asked in one call. A kink is closed in by halving, each time with a
    quarter of the error; a jump with half of it.

    Args:
        f: vectorised, real or complex.
        low: lower end.
        high: upper end.
        tolerance: for each panel, relative to the integral of the modulus.
        most: values that are asked; what is not settled then goes into the bound.

    Example:
        >>> from firstorder.checks.agreements._quadrature import adaptive
        >>> found = adaptive(lambda x: abs(x - 0.3), 0.0, 1.0)
        >>> abs(found.value - 0.29) <= found.bound < 1e-12
        True
    """
    t, w = (np.asarray(a) for a in gauss_legendre(NODES))
    # Legendre coefficients of a panel: the two highest are large where f is not smooth.
    series = np.polynomial.legendre.legvander(t, NODES - 1) * w[:, None] * (np.arange(NODES) + 0.5)
    sides = np.stack([(-1.0) ** np.arange(NODES), np.ones(NODES)], -1)  # P_k at both ends

    def panels(a, b):
        half, middle = 0.5 * (b - a), 0.5 * (b + a)
        values = f((middle[:, None] + half[:, None] * t).ravel()).reshape(-1, NODES)
        found = values @ series
        rough = half * np.sum(abs(found[:, -2:]), -1)
        return half * (values @ w), half * (abs(values) @ w), rough, found @ sides

    a, b = np.linspace(low, high, START + 1)[:-1], np.linspace(low, high, START + 1)[1:]
    whole, size, _, _ = panels(a, b)
    magnitude, asked, settled = float(np.sum(size)), NODES * START, []
    height = max(magnitude / (high - low), np.finfo(float).tiny)
    for _ in range(ROUNDS):
        middle = 0.5 * (a + b)
        parts, _, rough, ends = panels(np.concatenate([a, middle]), np.concatenate([middle, b]))
        left, right = np.split(parts, 2)
        rough = np.sum(np.split(rough, 2), 0)
        change = np.maximum(abs(left + right - whole), rough**2 / (height * 0.5 * (b - a)))
        asked += 2 * NODES * len(change)
        done = change <= tolerance * magnitude
        if asked + 4 * NODES * np.sum(~done) > most:  # enough: what is left is taken as it is
            done = done | True
        jumps = rough > 1e-3 * height * (b - a)  # there a change may be small by accident
        change = np.where(jumps, np.maximum(change, 2.0 * rough), change)
        lows, highs = np.split(ends, 2)
        table = a, middle, left, lows[:, 0], lows[:, 1], 0.0 * change, jumps
        settled.append(np.stack([c[done] for c in table]))
        table = middle, b, right, highs[:, 0], highs[:, 1], change, jumps
        settled.append(np.stack([c[done] for c in table]))
        a, b = (np.concatenate(p) for p in ((a[~done], middle[~done]), (middle[~done], b[~done])))
        whole = np.concatenate([left[~done], right[~done]])
        if not len(a):
            break
    a, b, value, first, last, change, jumps = np.concatenate(settled, -1)
    order = np.argsort(a.real)
    width, first, last, jumps = (c[order] for c in (abs(b - a), first, last, jumps.real))
    # No node is nearer to an end than `HEM` of a panel: a jump there shows between neighbours, if
    # neither of them has one already.
    apart = np.where(jumps[1:] + jumps[:-1] > 0.0, 0.0, abs(last[:-1] - first[1:]))
    hidden = HEM * np.sum(apart * (width[1:] + width[:-1]))
    bound = float(np.sum(change.real) + hidden + rounding(NODES * START) * magnitude)
    return Integral(np.sum(value), bound + float(np.sum(abs(whole)) if len(whole) else 0.0))
