"""The thread: one light field from the source to a curved glossy receiver, and its portraits.

Not a figure of the papers; it is D05 Fig. 6 and R07 Fig. 3 in one, and opens the README. Chosen:
a tilted Gaussian source (0.5 m, slope 0.3), 1 m of travel, a half-plane that lets nothing through
left of x = 0.2 m, 0.7 m of travel, a valley of curvature 0.4 per metre with a Gaussian lobe of
0.2 rad. Angles stand for slopes to first order (D05 §2.1).

Gradients are those between the edges; the half-plane's own spectrum is its square wave on a window
of 24 m, so a spectrum is in closed form at every step although no covariance is finite behind the
edge.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_most
from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import GaussianProfile, Grid, autodiff_jet, discrete_transform, gaussian
from firstorder.plotting import portrait_strip, portraits
from firstorder.transport import (
    Curvature,
    Mirror,
    Path,
    Reflection,
    ToAngle,
    Travel,
    half_plane_blocker,
)

TITLES = ("source", "travel 1 m", "half-plane", "travel 0.7 m", "rotated", "reflected")
RAY = np.array([0.3, 0.1])


def thread() -> Path:
    """Source, travel, half-plane, travel, curved glossy receiver."""
    window = Grid.spanning((801, 8), (12.0, 4.0))
    source = gaussian((0.1, -0.05), (0.5, 0.3), 0.3, frame=FLATLAND_SLOPE)
    shine = Mirror() >> Reflection(GaussianProfile(0.2)) >> Curvature(0.4, back=True)
    blocked = source >> Travel(1.0) >> half_plane_blocker(0.2, FLATLAND_SLOPE, window=window)
    arrived = blocked >> Travel(0.7) >> ToAngle().linearised(jnp.zeros(2))
    return arrived >> Curvature(0.4) >> shine


def draw(quick: bool) -> Drawing:
    """Steps across, portraits down."""
    path = thread()
    shown = [path.steps[k] for k in (0, 1, 2, 3, 5, 8)]
    n = 64 if quick else 192
    grid = Grid.spanning((n, n), (1.6, 1.2))
    Omega = np.linspace(-2.5, 2.5, n // 2 + 1), np.linspace(-2.5, 2.5, n // 2 + 1)
    strip = [portraits(t, f, grid, *Omega) for t, f in zip(TITLES, shown, strict=True)]
    figure = portrait_strip(strip, decades=4.0)
    keys = ("value", "gradient", "spectrum")
    arrays = {f"{key}_{k}": getattr(s, key) for k, s in enumerate(strip) for key in keys}
    return Drawing(figure, arrays, _claims(path), size=f"{n} x {n} rays", seed=None)


def _claims(path: Path) -> list[Statement]:
    """What the closed forms at the end of the path are worth."""
    light = path.light
    u = jnp.asarray(RAY)
    ours = eqx.filter_jit(lambda f: f.jet(u))(light)
    exact = eqx.filter_jit(lambda f: autodiff_jet(f.at, u, f.frame))(light)
    errors = [normwise(getattr(ours, k), getattr(exact, k)) for k in ("gradient", "hessian")]
    n = 161
    grid = Grid.spanning((n, n), (9.0, 6.0))
    Omega = np.linspace(-0.7, 0.9, 5), np.linspace(-0.5, 0.6, 4)
    sampled = discrete_transform(grid.sample(light), grid, *Omega)
    closed = path.spectra[-1](*np.meshgrid(*Omega, indexing="ij"))
    spectral = normwise(closed, sampled)
    rounding = at_most(1e-9, "rounding")
    return [
        Statement("Gradient and Hessian behind the edge equal autodiff: error", None, max(errors),
                  rounding, OURS, "normwise"),
        Statement("Spectrum behind the edge equals the transform of samples: error", None, spectral,
                  rounding, OURS, "normwise"),
    ]  # fmt: skip
