"""What a quadratic expansion misses over a disc, by its third derivatives: C.cache.third."""

from __future__ import annotations

import numpy as np
import sympy as sp


def disc_of_a_cubic():
    """`int |T[x, x, x]| / 6` over a disc, from its integral over sectors, and solved for R.

    In polar coordinates the form is `r^3 f(phi)`, f a sum of cosines of phi and of 3 phi of any
    phases; m is the mean of its modulus. For `f = cos` the modulus is integrated outright. Without
    the modulus nothing is left.
    """
    R, eps, m, r = sp.symbols("R epsilon m r", positive=True)
    phi, a, b, c, d = sp.symbols("phi a b c d", real=True)
    total = sp.integrate(sp.integrate(m * r**3 / 6 * r, (phi, 0, 2 * sp.pi)), (r, 0, R))
    root = (15 * eps / (sp.pi * m)) ** sp.Rational(1, 5)
    quarter = sp.integrate(sp.cos(phi) ** 3, (phi, 0, sp.pi / 2))
    x, y = r * sp.cos(phi), r * sp.sin(phi)
    form = a * x**3 + 3 * b * x**2 * y + 3 * c * x * y**2 + d * y**3
    return [
        sp.expand(total - sp.pi * m * R**5 / 15),
        sp.simplify(total.subs(R, root) - eps),
        sp.simplify(4 * quarter / (2 * sp.pi) - sp.Rational(4, 3) / sp.pi),
        sp.integrate(sp.expand(form), (phi, 0, 2 * sp.pi)),
    ]


def cubics(count: int = 12, seed: int = 4) -> np.ndarray:
    """Random symmetric tensors of third derivatives."""
    c = np.random.default_rng(seed).normal(size=(count, 4))
    rows = [[[0, 1], [1, 2]], [[1, 2], [2, 3]]]
    return np.array([[[k[:, i] for i in row] for row in plane] for k in [c] for plane in rows]).T


def cubic_by_sums() -> float:
    """Largest relative error of radii: what they miss, summed on a grid of squares, over 0.01."""
    import jax
    import jax.numpy as jnp

    from firstorder.caching import derivative_norm, radius_for

    T = cubics()

    @jax.jit
    def find(T):
        return radius_for(derivative_norm(T, 3, "mean"), 0.01, order=2, dims=2)

    s = (np.arange(400) + 0.5) / 200 - 1.0
    x = np.stack(np.meshgrid(s, s), -1)
    x = x[np.sum(x**2, -1) < 1.0]
    form = np.abs(np.einsum("mabc,na,nb,nc->mn", T, x, x, x, optimize=True)) / 6.0
    unit = np.sum(form, axis=1) / 200**2
    return float(np.max(np.abs(unit * np.asarray(find(jnp.asarray(T))) ** 5 / 0.01 - 1.0)))


def growth_of_a_cubic() -> float:
    """d/dR of the expected error over a disc is what is missing around its rim, by autodiff."""
    import jax
    import jax.numpy as jnp

    from firstorder.caching import ValidityRegion, expected_error

    def error(R, T):
        return expected_error(T, ValidityRegion(jnp.eye(2) / R), order=2)

    angle = 2.0 * np.pi * (np.arange(6000) + 0.5) / 6000
    u = np.stack([np.cos(angle), np.sin(angle)], -1)
    T, R = cubics(), 0.7
    slope = np.asarray(jax.jit(jax.vmap(jax.grad(error), (None, 0)))(R, jnp.asarray(T)))
    form = np.abs(np.einsum("mabc,na,nb,nc->mn", T, u, u, u, optimize=True)) / 6.0
    return float(np.max(np.abs(slope / (2.0 * np.pi * R**4 * np.mean(form, axis=1)) - 1.0)))
