"""Tabulate: the light of the cases on a grid; each portrait with what the table costs."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.faults import Fault, twin
from firstorder.checks.squares import Case
from firstorder.fields import Covariance, Field, Grid, Spectrum, Wavelet
from firstorder.laws import Move
from firstorder.transport.events.tabulate import Tabulate

TABLE = Grid.spanning((80, 81), (4.0, 4.0))

CASES = (
    Case(
        "tabulate",
        Tabulate(TABLE),
        light(),
        GRID,
        FREQUENCIES,
        RAYS,
        lambda u: bell(*u),
        Grid.spanning((16, 8), (2.0, 2.0)),
        # The step is 0.25 of the light's smaller width; the error is its fourth power, over 384.
        bounds={"value": 1e-4, "spectrum": 1e-4, "covariance": 1e-4, "wavelet": 1e-4},
        expected={p: "approximate" for p in ("value", "spectrum", "covariance", "wavelet")},
    ),
)


class Unfiltered(Tabulate):
    """The samples themselves for coefficients: a spline near the samples, not through them."""

    def __call__(self, portrait):
        """Without the fit."""
        table = super().__call__(portrait)
        if not isinstance(portrait, Field):
            return portrait
        return eqx.tree_at(lambda s: s.coefficients, table, self.grid.sample(portrait))


def mistold(M):
    """A table read as if its rays were somewhere else; all portraits follow."""

    def call(self, portrait):
        if isinstance(portrait, Wavelet):
            return Wavelet.of(Move(M)(light()), portrait.grid)
        return Move(M)(Tabulate.__call__(self, portrait))

    return lambda s: twin(s, __call__=call)


def scaled(self, portrait):
    """Values that have lost a 2 pi."""
    table = Tabulate.__call__(self, portrait)
    if isinstance(table, Field):
        return (0.5 / np.pi) * table
    if isinstance(table, Covariance):
        return Covariance(table.matrix / (4.0 * np.pi**2), table.frame)
    if isinstance(table, Spectrum):
        return Move(np.eye(2), jnp.array([0.1, 0.0]))(table)
    return eqx.tree_at(lambda w: w.coefficients, table, table.coefficients / (2.0 * np.pi))


EVERY = ("value", "gradient", "hessian", "spectrum", "covariance", "wavelet")
FAULTS = (
    Fault("transpose the table", mistold(np.eye(2)[::-1]), EVERY),
    Fault("turn the angle round", mistold(np.diag([1.0, -1.0])), EVERY),
    Fault("drop a 2 pi", lambda s: twin(s, __call__=scaled), EVERY),
    Fault(
        "do not fit the spline",
        lambda s: Unfiltered(s.grid),
        ("value", "gradient", "hessian"),
    ),
)
