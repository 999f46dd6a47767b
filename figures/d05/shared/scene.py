"""The flatland scene of D05 Figs. 6 and 8: area light, comb of blockers, diffuse receiver."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import Frame
from firstorder.fields import Field, Gaussian, Grid, Spectrum, discrete_transform
from firstorder.transport import Chain, Path, Travel
from firstorder.transport.events.diffuse import diffuse
from firstorder.transport.events.occlusion import comb_blocker
from firstorder.transport.events.travel import Arrival

LEAVING = Frame(("x", "v"), "outgoing")
SIGMA_X, SIGMA_V = 0.2, 0.35
FIRST, SECOND = 1.0, 1.0  # metres from the light to the blockers, and on to the receiver
PERIOD, BARS, OPEN = 0.25, 7, 0.5
RHO, HALF, REACH = 0.5, 5.0, 2.6


def source(sigma_v: float = SIGMA_V) -> Gaussian:
    """The area light: small, and brightest along its normal."""
    return Gaussian([0.05, 0.02], np.diag([SIGMA_X**-2.0, sigma_v**-2.0]), 1.0, LEAVING)


def path(
    harmonics: tuple[int, int] = (224, 136),
    period: float = PERIOD,
    bars: int = BARS,
    sigma_v: float = SIGMA_V,
) -> Path:
    """Source, travel, blockers, travel, arrival, differential irradiance, gathering."""
    box = Grid.spanning(harmonics, (HALF, REACH))  # holds the light at every step
    comb = comb_blocker(period, bars, LEAVING, OPEN, 0.0, 0.0, box)
    receiver = diffuse(RHO, REACH, box, nodes=80)
    chain: Chain = Travel(FIRST) >> comb >> Travel(SECOND) >> Arrival() >> receiver
    return source(sigma_v) >> chain


@eqx.filter_jit
def sample(field: Field, grid: Grid):
    """Radiance on a grid."""
    return grid.sample(field)


@eqx.filter_jit
def closed(spectrum: Spectrum, Omega_x, Omega_v):
    """A closed-form spectrum on the product of two axes, row by row to save memory."""
    across, up = jnp.asarray(Omega_x), jnp.asarray(Omega_v)
    return jax.lax.map(lambda w: spectrum(w, up), across)


def transformed(field: Field, grid: Grid, Omega_x, Omega_v) -> np.ndarray:
    """The same from samples of the light."""
    F = discrete_transform(sample(field, grid), grid, jnp.asarray(Omega_x), jnp.asarray(Omega_v))
    return np.asarray(F)
