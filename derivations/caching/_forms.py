"""Random quadratic forms, and the integral of their modulus by sums."""

from __future__ import annotations

import numpy as np


def matrices(count=24, seed=3):
    """Random symmetric matrices of all signs, of any orientation."""
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0.0, np.pi, count)
    c, s = np.cos(turn), np.sin(turn)
    Q = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    values = rng.normal(size=(count, 2)) * 10.0 ** rng.uniform(-1, 1, (count, 1))
    return (Q * values[:, None, :]) @ np.swapaxes(Q, 1, 2)


def integrated(H, matrix, n=400):
    """(68) over the ellipse |matrix x| < 1, on a polar midpoint grid of n directions.

    Along a radius the form is r^3: exact. Around it is analytic but for kinks, errors ~ n^-2.
    """
    angle = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    unit = np.stack([np.cos(angle), np.sin(angle)])
    step = np.linalg.solve(matrix, unit)
    form = np.abs(np.einsum("an,ab,bn->n", step, H, step))
    return float(0.5 * 0.25 * np.mean(form) * 2.0 * np.pi / abs(np.linalg.det(matrix)))
