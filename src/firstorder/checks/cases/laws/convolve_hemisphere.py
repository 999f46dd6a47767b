"""Convolve above the horizon of a normal that turns: the ends of the integral move with x."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad

from firstorder.checks.cases import FREQUENCIES, GRID
from firstorder.checks.cases.laws.convolve import OFFSET, WIDTH, Leaning, lobe, with_kernel
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Affine, Constant, Function, gaussian
from firstorder.laws import Convolve, Hemisphere

NORMAL = Function(lambda x, t: 0.5 * x + 0.2 * jnp.sin(2.0 * x) - 0.9)  # a bumpy valley


def brute(u):
    """Adaptive quadrature from horizon to horizon."""
    x, t = u
    n = 0.5 * x + 0.2 * np.sin(2.0 * x) - 0.9

    def product(s):
        a, b = (x - 0.2) / 0.6, (s + 0.1) / 1.2
        return np.exp(-0.5 * (a * a - 0.6 * a * b + b * b) / 0.91) * lobe(t - s)

    ends = n - 0.5 * np.pi, n + 0.5 * np.pi
    peak = np.clip(t - OFFSET, *ends)
    return quad(product, *ends, points=[peak], epsabs=1e-13, epsrel=1e-13)[0]


CASES = (
    Case(
        "convolve, hemisphere",
        Convolve(Leaning(WIDTH, OFFSET), Hemisphere(NORMAL)),
        gaussian((0.2, -0.1), (0.6, 1.2), 0.3),
        GRID,
        FREQUENCIES,
        # near the horizon, where its end terms show
        np.array([[0.3, 0.9], [-0.4, 0.45], [0.7, 1.1]]),
        brute,
        expected={p: "refused" for p in ("spectrum", "covariance", "wavelet")},
    ),
)


def with_normal(normal):
    """Fault that gives the law another normal."""
    return lambda s: eqx.tree_at(lambda m: m.domain.normal, s, normal)


def without_end_terms(m, f, u):
    """A horizon frozen where this ray's is: what forgets its end terms."""
    still = Hemisphere(Constant(m.domain.normal.at(u)))
    return Convolve(m.kernel, still, m.nodes).jet(f, u)


JETS = ("gradient", "hessian")
FAULTS = (
    Fault("forget the end terms", lambda s: twin(s, jet=without_end_terms), JETS),
    Fault("the flat horizon", with_normal(Constant(0.0)), ("value", *JETS)),
    Fault("a plain valley", with_normal(Affine([0.5, 0.0], -0.9)), ("value", *JETS)),
    Fault("turn the normal back", with_normal((-1.0) * NORMAL), ("value", *JETS)),
    Fault("correlate", with_kernel(lambda g: Leaning(g.sigma, -g.offset)), ("value", *JETS)),
)
