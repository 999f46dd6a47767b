"""How steep band-limited light is behind a lobe: Bernstein's inequality, and what reaches it."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import Frame
from firstorder.fields import Function, GaussianProfile
from firstorder.transport import Reflection

SIGMA = 0.3
_OUT = Frame(("x", "theta"), "outgoing")


def blurred_slope(Omega, A) -> float:
    """Largest |L_theta (*) rho| for the light `A cos(2 pi Omega theta)`, by differences of sums."""
    a = np.linspace(-6.0, 6.0, 4001)
    h = a[1] - a[0]

    def blurred(r):
        lobe = np.exp(-0.5 * ((r - a) / SIGMA) ** 2) / (SIGMA * np.sqrt(2.0 * np.pi))
        return np.sum(A * np.cos(2.0 * np.pi * Omega * a) * lobe) * h

    places = np.linspace(-1.0, 1.0, 201)
    return max(abs(blurred(r + 1e-4) - blurred(r - 1e-4)) / 2e-4 for r in places)


def bernstein_violation() -> float:
    """Search for a band-limited light whose slope exceeds `2 pi Omega max |f|`: none is found."""
    rng = np.random.default_rng(7)
    angle = np.linspace(0.0, 1.0, 4001)
    worst = 0.0
    for _ in range(200):
        c = rng.normal(size=(2, 6)) * rng.integers(0, 2, size=(1, 6))
        n = 2.0 * np.pi * np.arange(1, 7)[:, None] * angle
        f = c[0] @ np.cos(n) + c[1] @ np.sin(n)
        order = 2.0 * np.pi * np.arange(1, 7)
        slope = (c[1] * order) @ np.cos(n) - (c[0] * order) @ np.sin(n)
        if np.any(f):
            worst = max(worst, np.max(np.abs(slope)) / (2.0 * np.pi * 6 * np.max(np.abs(f))))
    return max(0.0, worst - 1.0)


def bernstein_reached() -> float:
    """One harmonic reaches `2 pi Omega` times its blurred size: by sums, and by the library."""
    Omega = 0.4
    light = Function(lambda x, a: jnp.cos(2.0 * jnp.pi * Omega * a) + 0.0 * x, _OUT)
    B = Reflection(GaussianProfile(SIGMA, frame=_OUT))(light)
    places = jnp.stack([jnp.zeros(201), jnp.linspace(-1.0, 1.0, 201)], axis=-1)
    ours = jnp.max(jnp.abs(jax.jit(jax.vmap(lambda u: B.jet(u).gradient[1]))(places)))
    bound = 2.0 * np.pi * Omega * np.exp(-2.0 * (np.pi * SIGMA * Omega) ** 2)
    return max(abs(float(slope) / bound - 1.0) for slope in (blurred_slope(Omega, 1.0), ours))
