"""One path of light, step by step, and below it the spectrum of every step.

Above, radiance over place (across) and slope or angle (upwards); below, its frequencies by powers
of ten. Travel shears the light, and its spectrum the other way about; a grating cuts the light, and
sets copies of the spectrum side by side; more travel shears all of them; a mirror turns angles
round, and its gloss blurs them and keeps a band of the spectrum. All in closed form, event by
event.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import GaussianProfile, Grid, gaussian
from firstorder.numerics._batching import host_blocks
from firstorder.transport import Mirror, Path, Reflection, ToAngle, Travel, grating_blocker
from gallery.frame import Frame, drawn

STEPS = ((0, "light"), (1, "travel"), (2, "grating"), (3, "travel"), (6, "gloss"))
HALF_X, HALF_V = 1.9, 1.3  # of what is shown [m], [1]
BAND_X, BAND_V = 3.3, 5.4  # [1/m], [1]
DECADES = 4.0
FINE, COARSE = 3, 2  # rays in a pixel with edges, and pixels from ray to ray without; both ways
WARM = ("#07060d", "#3b0f4a", "#a3263f", "#f0702a", "#ffc55c", "#fff6dc")
COLD = ("#05070f", "#0c2146", "#135a86", "#2aa6b0", "#a7e6c3", "#fbfff2")


def path() -> Path:
    """Light from a small source to a glossy mirror behind a grating."""
    window = Grid.spanning((401, 8), (12.0, 4.0))
    source = gaussian((0.0, 0.0), (0.62, 0.30), 0.0, frame=FLATLAND_SLOPE)
    grating = grating_blocker(0.5, FLATLAND_SLOPE, window=window)
    arrived = source >> Travel(1.2) >> grating >> Travel(0.9)
    return arrived >> ToAngle().linearised(jnp.zeros(2)) >> Mirror() >> Reflection(
        GaussianProfile(0.14)
    )  # fmt: skip


def still(frame: Frame):
    ax = frame.canvas(None, (0.0, 1.0, 0.0, 1.0), "#05060b")
    light, gap = path(), 4.0 / 1920.0
    fields, spectra = light.steps, light.spectra
    wide, tall = (1.0 - (len(STEPS) - 1) * gap) / len(STEPS), 0.5 - gap
    size = int(frame.width * wide), int(frame.height * tall)
    for k, (step, name) in enumerate(STEPS):
        for row, (values, colours, words) in enumerate((
            (_decades(spectra[step], size), COLD, "" if k else "its spectrum"),
            (_values(fields[step], size), WARM, name),
        )):  # fmt: skip
            panel = ax.figure.add_axes((k * (wide + gap), row * (1.0 - tall), wide, tall))
            shades = LinearSegmentedColormap.from_list("", colours)
            panel.imshow(values.T, shades, vmin=0.0, vmax=1.0, origin="lower", aspect="auto",
                         interpolation="bicubic")  # fmt: skip
            panel.set_axis_off()
            panel.text(0.06, 0.9, words, transform=panel.transAxes, color="white", alpha=0.85,
                       fontsize=24 * frame.fine)  # fmt: skip
    return drawn(ax)


def _values(field, size) -> np.ndarray:
    """Radiance over place and slope, at most 1; where it has edges, means over pixels."""
    fine = FINE if field.edges() else 1
    wide, tall = size if field.edges() else (n // COARSE for n in size)
    points = Grid.spanning((fine * wide, fine * tall), (HALF_X, HALF_V)).points()
    L = host_blocks(jax.jit(jax.vmap(field.at)), np.asarray(points).reshape(-1, 2), 4096)
    L = L.reshape(wide, fine, tall, fine).mean((1, 3))
    return (L / L.max()) ** 0.8


def _decades(spectrum, size) -> np.ndarray:
    """Magnitude of a spectrum by powers of ten, from 0 to 1."""
    axes = (np.linspace(-b, b, n // COARSE) for b, n in zip((BAND_X, BAND_V), size, strict=True))
    F = np.abs(np.asarray(spectrum(*np.meshgrid(*axes, indexing="ij"))))
    return np.clip(1.0 + np.log10(F / F.max() + 1e-12) / DECADES, 0.0, 1.0)
