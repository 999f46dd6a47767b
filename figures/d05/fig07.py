"""D05 Fig. 7: two blockers that each hide half of the light, and together all of it.

The paper gives no numbers. Ours: the light of Fig. 6 (deviation 0.2 m, slopes 0.35) after 1 m of
travel; an opaque half-plane on the left of x = 0.05 m, one on its right, and both. Upper spectra
keep the phase and are empty behind both (up to the harmonics that the series of two edges leaves
out, half a percent of the peak, below the two decades shown). Lower spectra convolve magnitudes,
as somebody does who has only a maximal frequency for each: they see light where there is none. That
is the overestimation the paper allows. Its converse, "but not an underestimation", holds if
maximal frequencies are added at every blocker, and fails if the larger is taken: two soft gratings
(1 + cos) / 2 of one frequency show it.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.d05.shared import scene
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.fields import Affine, Field, Grid, HalfPlane
from firstorder.transport import Travel
from firstorder.transport.events.occlusion import Occlusion, PlanarBlockers

EDGE = 0.05


def draw(quick: bool) -> Drawing:
    n, harmonics = (33, 96) if quick else (81, 160)
    light = Travel(scene.FIRST)(scene.source())
    Omega = np.linspace(-5.0, 5.0, n)
    box = Grid.spanning((harmonics, 8), (4.0, scene.REACH))
    level = Affine([1.0, 0.0], -EDGE, scene.LEAVING)
    left, right = HalfPlane(level, 0.0, 1.0), HalfPlane(level, 1.0, 0.0)
    steps = {
        "no blocker": (light, ()),
        "left one": (Occlusion(left, 0.0, box)(light), (left,)),
        "right one": (Occlusion(right, 0.0, box)(light), (right,)),
        "both": (PlanarBlockers((left, right), [0.0, 0.0], box)(light), (left, right)),
    }
    grid = Grid.spanning((301, 200), (2.2, 1.2))
    figure, axes = plotting.panels(3, 4, 2.5, 2.1)
    arrays: dict = {"x": grid.axis(0), "v": grid.axis(1), "Omega": Omega}
    top = None
    for column, (name, (field, masks)) in enumerate(steps.items()):
        values = np.asarray(scene.sample(field, grid))
        F = np.asarray(scene.closed(field.spectrum(), Omega, Omega))
        blind = _without_phase(light, masks, box, Omega)
        top = np.max(np.abs(F)) if top is None else top
        plotting.show_light_field(
            axes[0, column],
            values,
            grid.axis(0),
            grid.axis(1),
            limit=1.0,
            names=("x", "v"),
            title=name,
        )
        for row, data, title in ((1, F, "with phase"), (2, blind, "magnitudes only")):
            plotting.show_spectrum(
                axes[row, column],
                data,
                Omega,
                Omega,
                decades=2.0,
                reference=top,
                names=("x", "v"),
                title=title,
            )
        arrays |= {f"light_{column}": values, f"closed_{column}": F, f"blind_{column}": blind}
    plotting.share_labels(axes)
    return Drawing(
        figure,
        arrays,
        _claims(arrays, harmonics),
        size=f"301 x 200 samples, {n}^2 frequencies, {harmonics} harmonics",
    )


def _without_phase(light: Field, masks, box: Grid, Omega) -> np.ndarray:
    """`sum_k |c_k| |F(Omega - s_k)|`, one blocker after the other."""
    shifts, weights = np.zeros((1, 2)), np.ones(1)
    for mask in masks:
        series = mask.series(box)
        s, c = np.asarray(series.frequencies), np.abs(np.asarray(series.coefficients))
        # All harmonics are multiples of one step: add those that coincide.
        shifts = (shifts[:, None] + s).reshape(-1, 2)
        weights = (weights[:, None] * c).ravel()
        keys, inverse = np.unique(np.round(shifts[:, 0], 9), return_inverse=True)
        weights = np.bincount(inverse, weights)
        shifts = np.stack([keys, np.zeros_like(keys)], axis=1)
    F = light.spectrum()

    @eqx.filter_jit
    def total(across):
        def column(w):
            u = jnp.stack(jnp.broadcast_arrays(w, jnp.asarray(Omega)), -1)
            moved = u[:, None] - jnp.asarray(shifts)
            return jnp.sum(jnp.abs(jax.vmap(jax.vmap(F.at))(moved)) * jnp.asarray(weights), axis=1)

        return jax.lax.map(column, across)

    return np.asarray(total(jnp.asarray(Omega)))


def _claims(arrays, harmonics: int) -> list[Claim]:
    peak = [float(np.max(np.abs(arrays[f"closed_{k}"]))) for k in range(4)]
    blind = float(np.max(arrays["blind_3"])) / peak[0]
    under = [np.max(np.abs(arrays[f"closed_{k}"]) - arrays[f"blind_{k}"]) for k in range(4)]
    half = [arrays[f"light_{k}"].sum() / arrays["light_0"].sum() for k in (1, 2)]
    product, behind = _highest(3.0), float(np.max(arrays["light_3"]))
    empty, excess = peak[3] / peak[0], max(0.0, float(np.max(under)))
    return [
        Claim(
            "light behind both blockers, largest sample", 0.0, behind, "of the peak", behind == 0.0
        ),
        Claim(
            "each blocker alone lets through",
            "half",
            half[0],
            "of the light",
            abs(half[0] - 0.5) < 0.1,
        ),
        Claim(
            "with phase, the spectrum behind both is empty: largest value (series cut off)",
            0.0,
            empty,
            "of the peak",
            empty < 4.0 / harmonics,
        ),
        Claim(
            "magnitudes alone overestimate: largest value behind both",
            "more than 0",
            blind,
            "of the peak",
            blind > 0.1,
        ),
        Claim(
            "... and never underestimate: largest excess of the true spectrum",
            0.0,
            excess,
            "",
            excess < 1e-9,
        ),
        Claim(
            "'not an underestimation' if the maximal frequencies of two gratings are added",
            6.0,
            product,
            "cycles/m",
            product <= 6.0,
        ),
        Claim(
            "'not an underestimation' if the larger of the two is taken",
            3.0,
            product,
            "cycles/m",
            product <= 3.0,
        ),
    ]


def _highest(f: float) -> float:
    """Highest frequency in ((1 + cos) / 2)^2, from samples."""
    t = np.arange(1024) / 64.0
    power = np.abs(np.fft.rfft((0.5 + 0.5 * np.cos(2.0 * np.pi * f * t)) ** 2))
    return float(np.fft.rfftfreq(t.size, 1.0 / 64.0)[power > 1e-9 * power.max()].max())
