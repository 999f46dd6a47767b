"""D05 Fig. 4: a point light and a spot light in space and slope, and their spectra.

Chosen: light at x = 0.15 m; a falloff of 0.25 in slope (standard deviation); a bulb of 0.8 m. The
paper's point shines evenly over all slopes, so its spectrum is a Dirac along Omega_v that no
picture can show. Ours has a falloff of 1.2, wide beside the panel, and the claims follow the
line's width as the falloff widens. A Dirac in x is drawn one sample wide.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.d05.shared.readings import equal
from figures.style import Drawing
from figures.verdicts import Statement, near
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import (
    Field,
    GaussianProfile,
    Grid,
    Separable,
    discrete_transform,
    point_light,
    spot_light,
)
from firstorder.plotting import panels, show_light_field, show_spectrum

X, BULB = 0.15, 0.8
WIDE, NARROW = 1.2, 0.25


def falloff(sigma: float) -> GaussianProfile:
    """A bell over slopes that is 1 in the middle."""
    return GaussianProfile(sigma, "v", FLATLAND_SLOPE, sigma * np.sqrt(2.0 * np.pi))


def draw(quick: bool) -> Drawing:
    """Fields on the left, spectra on the right."""
    n = 121 if quick else 361
    grid = Grid((n, n), (2.4 / n, 2.0 / n))
    point, spot = point_light(X, falloff(WIDE)), spot_light(X, 0.5 * BULB, falloff(NARROW))
    Omega = np.linspace(-6.0, 6.0, n), np.linspace(-3.0, 3.0, n)
    mesh = np.meshgrid(*Omega, indexing="ij")
    spectra = [np.asarray(light.spectrum()(*mesh)) for light in (point, spot)]
    values = [_column(grid), np.asarray(grid.sample(spot))]
    figure, axes = panels(2, 2, 3.2, 2.7)
    names = ("x", "v")
    rows = zip(axes, ("a b point", "c d spot"), values, spectra, strict=True)
    for row, words, value, F in rows:
        left, right, name = words.split()
        show_light_field(
            row[0], value, grid.axis(0), grid.axis(1), names=names, title=f"({left}) {name}"
        )
        show_spectrum(row[1], F, *Omega, decades=4.0, names=names, title=f"({right}) its spectrum")
    arrays = {"x": grid.axis(0), "v": grid.axis(1), "Omega_x": Omega[0], "Omega_v": Omega[1]}
    for name, value, F in zip(("point", "spot"), values, spectra, strict=True):
        arrays |= {name: value, f"{name}_spectrum": F}
    return Drawing(figure, arrays, _claims(spectra[0], spot), size=f"{n} x {n} samples")


def _column(grid: Grid) -> np.ndarray:
    """The point, its Dirac one sample wide and of unit height."""
    x, v = grid.axis(0), grid.axis(1)
    here = np.arange(len(x)) == np.argmin(np.abs(x - X))
    return here[:, None] * np.exp(-0.5 * (v / WIDE) ** 2)


def _claims(point: np.ndarray, spot: Field) -> list[Statement]:
    """What the paper says of both, measured."""
    magnitude = np.abs(point)
    unflat = normwise(magnitude, np.broadcast_to(magnitude[:1], magnitude.shape))
    sigmas = np.array([0.5, 1.0, 2.0, 4.0])
    widths = [_line_width(point_light(X, falloff(s))) for s in sigmas]
    order = fitted_order(sigmas, widths)
    cells = 240
    fine = Grid((cells + 40, 81), (BULB / cells, 0.05), (X, 0.0))
    Omega = np.linspace(-6.0, 6.0, 41), np.linspace(-2.0, 2.0, 21)
    sampled = discrete_transform(fine.sample(spot), fine, *Omega)
    sampled = sampled * np.sinc(fine.step[0] * Omega[0])[:, None]  # a sample stands for its cell
    error = normwise(spot.spectrum()(*np.meshgrid(*Omega, indexing="ij")), sampled)
    return [
        Statement("A point light's transform is a constant in space: relative departure", 0.0,
                  unflat, equal(), "D05 Fig. 4 (b)"),
        Statement("... and a Dirac in angle: the transform's width falls as the falloff's width to "
                  "this power", -1.0, order, near(-1.0, 0.01, "it narrows to a Dirac"),
                  "D05 Fig. 4 (b)", scanned="falloffs of 0.5 to 4 in slope"),
        Statement("The transform of a spot with a finite bulb is a sinc times a bell: error "
                  "against samples", "sinc times bell", error, equal(), "D05 Fig. 4 (d)"),
    ]  # fmt: skip


def _line_width(light: Separable) -> float:
    """Standard deviation of |F| along Omega_v, at Omega_x = 3."""
    w = np.linspace(-3.0, 3.0, 1201)
    F = np.abs(np.asarray(light.spectrum()(3.0, jnp.asarray(w))))
    return float(np.sqrt(np.sum(w**2 * F) / np.sum(F)))
