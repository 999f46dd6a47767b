"""Density of points on a line from the k nearest: its excess, and what J12 §4.4 says of it.

Points are independent. The width of the window that holds k of them has a known law, and the mean
of the estimate follows by integration.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Counterexample, Row, na


def excess():
    """K nearest points of a line of even density f: `E[k / (2 r)] = f k / (k - 1)`.

    In a Poisson process the count in a window of half-width r has the mean 2 f r, so that the
    chance of fewer than k is `sum_{j<k} exp(-2 f r) (2 f r)^j / j!`; its derivative is the law of
    the k-th distance. For N points thrown evenly on [0, 1] the window's share p = 2 r has the law
    `k C(N, k) p^(k-1) (1-p)^(N-k)`. Leaving the farthest out gives f in both.
    """
    f, r, p = sp.symbols("f r p", positive=True)
    out = []
    for k in (2, 5):
        fewer = sum(sp.exp(-2 * f * r) * (2 * f * r) ** j / sp.factorial(j) for j in range(k))
        law = sp.simplify(-sp.diff(fewer, r))
        out.append(sp.integrate(law, (r, 0, sp.oo)) - 1)
        mean = sp.integrate(sp.expand(law / (2 * r)), (r, 0, sp.oo))
        out += [k * mean - f * sp.Rational(k, k - 1), (k - 1) * mean - f]
        for n in (k + 1,):
            thrown = k * sp.binomial(n, k) * p ** (k - 1) * (1 - p) ** (n - k)
            share = sp.integrate(sp.expand(thrown / p), (p, 0, 1)) / n
            out += [sp.integrate(sp.expand(thrown), (p, 0, 1)) - 1]
            out += [k * share - sp.Rational(k, k - 1), (k - 1) * share - 1]
    return out


def distances(n, runs=4000):
    """From the middle of [0, 1] to n points thrown evenly, sorted; one seed."""
    x = np.random.default_rng(30).random((runs, int(n)))
    return np.sort(np.abs(x - 0.5), axis=1)


def nearest(k, n):
    """Mean of the printed estimate, k / (2 r n)."""
    return float(np.mean(k / (2.0 * distances(n)[:, int(k) - 1] * n)))


def counted(k, n):
    """The density of the same points, by how many fall into a window of fixed width."""
    return float(np.mean(distances(n) < 0.1) / 0.2)


def summed_over_all(k, n):
    """(30) with its sum to N, all photons there are, over the arc of the k-th."""
    return float(np.mean(n / (2.0 * distances(n)[:, int(k) - 1] * n)))


def kept_nearest(k, n):
    """The printed estimate of an even density 1 with k of n photons, as n grows: its mean."""
    return float(np.mean(k / (2.0 * distances(n)[:, int(k) - 1] * n)))


def _even(x):
    """Chance that a point thrown evenly on [0, 1] lies to the left."""
    return np.clip(x, 0.0, 1.0)


def nearest_means() -> float:
    """The library's excess of k nearest photons, against the mean over all even throws.

    With the k-th left out, too: then there is none.
    """
    from firstorder.sampling._density import DensityEstimator, expected_k_nearest

    worst = 0.0
    for k in (2, 5, 40):
        for kept in (k, k - 1):
            mean = expected_k_nearest(_even, 0.5, k, 4000, kept, nodes=1000).mean[0]
            ours = DensityEstimator(k=k, keep_farthest=kept == k).excess
            worst = max(worst, abs(ours / float(mean) - 1.0))
    return worst


ROWS = [
    Row(
        "J12.s4.4a",
        "misprint",
        implements="firstorder.sampling._density.DensityEstimator.excess",
        symbolic=excess,
        autodiff=na("no derivative"),
        brute_force=Check(nearest_means, 1e-9),
        fourier=na("no spectrum"),
        corrected="the sum is over the photons of P, the k nearest or those within r",
        counterexample=Counterexample(
            {"k": 5.0, "n": 200.0}, printed=summed_over_all, true=counted
        ),
        note="N is not explained there; it is the number of samples in (28) and of paths in (29).",
    ),
    Row(
        "J12.s4.4b",
        "over-claim",
        implements="firstorder.sampling._density.DensityEstimator.excess",
        symbolic=excess,
        autodiff=na("no derivative"),
        brute_force=Check(nearest_means, 1e-9),
        fourier=na("no spectrum"),
        corrected="k nearest photons are k / (k - 1) too bright however many there are: consistent "
        "only if k grows without limit and k / N falls to zero, and a fixed width only if it "
        "falls to zero while N times it grows",
        counterexample=Counterexample({"k": 5.0, "n": 4000.0}, printed=counted, true=kept_nearest),
        note="Printed is the density itself, to which the caption lets it converge. The library "
        "leaves the k-th photon out.",
    ),
]
