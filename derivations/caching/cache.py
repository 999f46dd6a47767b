"""Interpolation between records (J12 §4.5, §6.3): what it reproduces, and how fast it converges."""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.caching._light import scene_a_columns
from firstorder.checks.tolerance import fitted_order
from firstorder.ledger import Check, Row, na


def reproduces(order: int):
    """For any weights, the mean of the expansions of a polynomial of that degree is it."""
    t, first, second = sp.symbols("t x_1 x_2", real=True)
    weights = sp.symbols("w_1 w_2", positive=True)
    coefficients = sp.symbols(f"c0:{order + 1}", real=True)
    E = sum(c * t**k for k, c in enumerate(coefficients))
    x = sp.Symbol("x", real=True)

    def expansion(at):
        return sum(
            sp.diff(E, t, k).subs(t, at) * (x - at) ** k / sp.factorial(k) for k in range(order + 1)
        )

    mean = sum(w * expansion(at) for w, at in zip(weights, (first, second), strict=True))
    return sp.simplify(sp.expand(mean) - sp.expand(sum(weights) * E.subs(t, x)))


def misses_the_next(order: int):
    """For a polynomial of one degree more, the mean misses by the mean of `c (x - x_i)^q`."""
    x, at = sp.symbols("x x_1", real=True)
    q = order + 1
    expansion = sum(
        sp.diff(x**q, x, k).subs(x, at) * (x - at) ** k / sp.factorial(k) for k in range(q)
    )
    return sp.expand(x**q - expansion - (x - at) ** q)


def slope_of_a_polynomial(order: int) -> float:
    """Between records, autodiff of the interpolated polynomial is the polynomial's own slope."""
    import jax
    import jax.numpy as jnp

    from firstorder.caching import Cache, Candidates, circular_regions

    def E(x):
        return 0.3 + 0.7 * x - (0.9 * x**2 if order == 2 else 0.0)

    at = jnp.array([-0.5, 0.1, 0.6])
    some = Candidates.from_function(E, at)
    reach = circular_regions(jnp.array([0.9, 0.5, 1.2]), 0.1, 2.0)
    cache = Cache.of(some, reach, order=order)
    x = jnp.linspace(-0.45, 0.55, 7)
    value, slope = jax.vmap(jax.value_and_grad(lambda x: cache(x).value))(x)
    expected = 0.7 - (1.8 * np.asarray(x) if order == 2 else 0.0)
    return float(max(np.max(np.abs(value - E(x))), np.max(np.abs(slope - expected))))


def order_of_convergence(order: int) -> float:
    """How far the fitted order of the largest error is from `order + 1`, below the lamp."""
    from firstorder.caching import Cache, Candidates, circular_regions

    x = np.linspace(-0.9, 0.9, 1201)
    truth = scene_a_columns(x)[:, 0]
    spacings, errors = [], []
    for records in (24, 48, 96, 192):
        spacing = 2.0 / records
        at = -1.0 + spacing * (0.5 + np.arange(records))
        some = Candidates.on_line(at, scene_a_columns(at))
        reach = circular_regions(np.full(records, 1.2 * spacing), 1e-3, 1.0)
        cache = Cache(some, reach, order)
        spacings.append(spacing)
        errors.append(float(np.max(np.abs(cache(x[:, None]).value - truth))))
    return abs(fitted_order(spacings, errors) - (order + 1))


def _row(equation: str, order: int, note: str) -> Row:
    return Row(
        equation,
        "approximation",
        implements="firstorder.caching.Cache",
        symbolic=lambda: [reproduces(order), misses_the_next(order)],
        autodiff=Check(lambda: slope_of_a_polynomial(order), 1e-12),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: order_of_convergence(order), 0.1),
        note=note,
    )


ROWS = [
    _row(
        "J12.33", 1, "Error O(spacing^2), fitted on scene A; lines are reproduced by any weights."
    ),
    _row(
        "J12.52",
        2,
        "Error O(spacing^3), fitted on scene A; parabolas are reproduced by any weights. Across a "
        "kink of E both fall to first order.",
    ),
]
