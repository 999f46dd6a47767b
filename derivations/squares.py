"""Errors of squares, computed once per process: most numeric routes of the ledger are squares."""

from __future__ import annotations

import functools

import numpy as np

from firstorder.checks.registry import all_cases
from firstorder.checks.squares import by_rule, square
from firstorder.checks.tolerance import normwise

# Central differences of order 8: first and second derivatives from samples at -4 h ... 4 h.
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])


@functools.cache
def square_error(case: str, portrait: str) -> float:
    """Normwise error of one square; a refusal is infinite, so it never passes for a proof."""
    error = square(all_cases()[case], portrait).error
    return float("inf") if error is None else error


@functools.cache
def refusal(case: str, portrait: str) -> float:
    """0 if the square is refused with a reason, infinity if it is not: for "no formula" rows."""
    found = square(all_cases()[case], portrait)
    return 0.0 if found.verdict == "refused" and found.reason else float("inf")


@functools.cache
def difference_error(case: str, portrait: str, step: float = 0.02) -> float:
    """Normwise error of a rule for gradient or Hessian against differences of brute force.

    Shares no code with the rule or with autodiff. The truncation is of order step^8; an error of
    1e-13 in the brute-force values costs some 1e-13 / step (gradient) or / step^2 (Hessian).
    """
    this = all_cases()[case]
    offsets = step * np.arange(-4, 5)
    eye = np.eye(this.rays.shape[1])

    def line(u, i):
        return np.array([this.brute(u + h * eye[i]) for h in offsets])

    def gradient(u):
        return np.array([FIRST @ line(u, i) for i in range(u.size)]) / step

    def hessian(u):
        result = np.diag([SECOND @ line(u, i) for i in range(u.size)])
        for i in range(u.size):
            for j in range(i):
                rows = [FIRST @ line(u + h * eye[i], j) for h in offsets]
                result[i, j] = result[j, i] = FIRST @ np.array(rows)
        return result / step**2

    truth = np.array([{"gradient": gradient, "hessian": hessian}[portrait](u) for u in this.rays])
    return normwise(by_rule(this, portrait), truth)


@functools.cache
def parseval_error(case: str, size: int = 41, step: float = 0.02) -> float:
    """Normwise error of a rule for covariances against gradients of brute force.

    `int grad h grad h^T / (4 pi^2 int h^2)`: trapezoid sums on a grid of its own, gradients by
    differences of eighth order. Nothing is transformed, and nothing is the rule's.
    """
    this = all_cases()[case]
    n = len(this.grid.size)
    axes = [np.linspace(a[0], a[-1], size) for a in map(this.grid.axis, range(n))]
    rays = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, n)
    offsets = step * np.arange(-4, 5)
    values = np.array([this.brute(u) for u in rays])
    slopes = np.array(
        [
            [FIRST @ [this.brute(u + h * e) if h else 0.0 for h in offsets] / step for u in rays]
            for e in np.eye(n)
        ]
    )
    truth = slopes @ slopes.T / (4.0 * np.pi**2 * np.sum(values**2))
    return normwise(by_rule(this, "covariance"), truth)


@functools.cache
def transform_error(case: str, half_width: float = 4.0, size: int = 25) -> float:
    """Normwise error of a rule for spectra against sums of brute force, written out in NumPy.

    The trapezoid rule is spectrally accurate for light that dies out inside the box.
    """
    this = all_cases()[case]
    axis = np.linspace(-half_width, half_width, size)
    rays = np.stack(np.meshgrid(*[axis] * len(this.frequencies), indexing="ij"), -1)
    values = np.array([this.brute(u) for u in rays.reshape(-1, rays.shape[-1])])
    result = values.reshape(rays.shape[:-1]) * (axis[1] - axis[0]) ** rays.shape[-1]
    for Omega in this.frequencies:  # contract the first axis, append its frequencies
        kernel = np.exp(-2j * np.pi * np.outer(axis, Omega))
        result = np.tensordot(result, kernel, axes=(0, 0))
    return normwise(by_rule(this, "spectrum"), result)
