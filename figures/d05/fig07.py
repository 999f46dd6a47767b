"""D05 Fig. 7: two blockers that each hide half of the light, and together all of it.

The paper gives no numbers. Ours: the light of Fig. 6 (deviation 0.2 m, slopes 0.35) after 1 m of
travel; an opaque half-plane on the left of x = 0.05 m, one on its right, and both. Upper spectra
keep the phase and are empty behind both: convolved one blocker after the other, with series that
are cut off, they leave what falls as one over the harmonics. Lower spectra convolve magnitudes, as
somebody does who has only a maximal frequency for each: they see light where there is none. That is
the overestimation the paper allows. Its converse, "but not an underestimation", holds if maximal
frequencies are added at every blocker, and fails if the larger is taken: two soft gratings
(1 + cos) / 2 show it.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.d05.shared import scene
from figures.d05.shared.readings import equal
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
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
        blind = _convolved(light, masks, box, Omega, phase=False)
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
        _claims(arrays, _left_over(light, (left, right), box)),
        size=f"301 x 200 samples, {n}^2 frequencies, {harmonics} harmonics",
    )


def _convolved(light: Field, masks, box: Grid, Omega, phase: bool) -> np.ndarray:
    """`|sum_k c_k F(Omega - s_k)|`, one blocker after the other; without phase of `|c_k| |F|`."""
    shifts, weights = np.zeros((1, 2)), np.ones(1)
    for mask in masks:
        series = mask.series(box)
        s, c = np.asarray(series.frequencies), np.asarray(series.coefficients)
        # All harmonics are multiples of one step: add those that coincide.
        shifts = (shifts[:, None] + s).reshape(-1, 2)
        weights = (weights[:, None] * (c if phase else np.abs(c))).ravel()
        keys, inverse = np.unique(np.round(shifts[:, 0], 9), return_inverse=True)
        weights = np.bincount(inverse, weights.real) + 1j * np.bincount(inverse, weights.imag)
        shifts = np.stack([keys, np.zeros_like(keys)], axis=1)
    F = light.spectrum()

    @eqx.filter_jit
    def total(across):
        def column(w):
            u = jnp.stack(jnp.broadcast_arrays(w, jnp.asarray(Omega)), -1)
            moved = u[:, None] - jnp.asarray(shifts)
            found = jax.vmap(jax.vmap(F.at))(moved)
            return jnp.abs(jnp.sum((found if phase else jnp.abs(found)) * weights, axis=1))

        return jax.lax.map(column, across)

    return np.asarray(total(jnp.asarray(Omega)))


def _left_over(light: Field, masks, box: Grid) -> tuple[float, float]:
    """Largest value behind both blockers with phase, and its bound, over the peak.

    Two series that add to 1 and are cut off after H harmonics multiply to what has the mean
    `sum_{|k|>H} |c_k|^2 <= 2 / (pi^2 H)` over the box: all of it lies at the edges.
    """
    Omega = np.linspace(-2.0, 2.0, 17)
    peak = float(np.max(_convolved(light, (), box, Omega, True)))
    left = float(np.max(_convolved(light, masks, box, Omega, True)))
    harmonics, side = box.size[0] // 2, box.size[0] * box.step[0]
    brightest = 1.0 / np.sqrt(2.0 * np.pi * (scene.SIGMA_X**2 + (scene.FIRST * scene.SIGMA_V) ** 2))
    return left / peak, 2.0 * side * brightest / (np.pi**2 * harmonics)


def _claims(arrays, left: tuple[float, float]) -> list[Statement | Measurement]:
    peak = [float(np.max(np.abs(arrays[f"closed_{k}"]))) for k in range(4)]
    blind = float(np.max(arrays["blind_3"])) / peak[0]
    under = [np.max(np.abs(arrays[f"closed_{k}"]) - arrays[f"blind_{k}"]) for k in range(4)]
    through = [arrays[f"light_{k}"].sum() / arrays["light_0"].sum() for k in (1, 3)]
    added, larger = _highest_over(), "where the larger of the two frequencies is taken"
    pairs = f"two soft gratings, {FIRST:g} and 1 to {FIRST:g} cycles/m"
    return [
        Measurement("Light that one blocker lets through, of all", through[0]),
        Measurement("Light that both let through, of all", through[1]),
        Statement("With phase the spectrum behind both is empty, but for what series that are cut "
                  "off leave: largest value", 0.0, left[0],
                  at_most(left[1], "harmonics that are left out, |c_k| <= 1 / (pi k)"), "D05 §3.4",
                  "of the peak"),
        Statement("Maximal frequencies can be overestimated: light where there is none, by "
                  "magnitudes", "overestimation", blind,
                  at_least(0.01, "'can get': a hundredth of the peak"), "D05 §3.4", "of the peak"),
        Statement("... not underestimated: the true spectrum exceeds magnitudes by", 0.0,
                  max(0.0, float(np.max(under))), equal(), "D05 §3.4"),
        Statement("... not underestimated, where two maximal frequencies are added: true one over "
                  "the sum, at most", 1.0, added[0], at_most(1.0, "'not an underestimation'"),
                  "D05 §3.4", scanned=pairs),
        Statement(f"... not underestimated, {larger}: true one over that, at most", 1.0, added[1],
                  at_most(1.0, "'not an underestimation'"), "D05 §3.4", scanned=pairs,
                  reason="A product of two cosines has the sum of their frequencies: the larger "
                  "one is too low for every pair, by half where they are equal."),
    ]  # fmt: skip


FIRST = 3.0  # cycles per metre of the finer grating


def _highest_over() -> tuple[float, float]:
    """Highest frequency behind two gratings over their sum and over the larger: largest."""
    others = np.linspace(1.0, FIRST, 9)
    found = np.array([_highest(FIRST, f) for f in others])
    return float(np.max(found / (FIRST + others))), float(np.max(found / FIRST))


def _highest(f: float, g: float) -> float:
    """Highest frequency in (1 + cos) / 2 of f times that of g, from samples."""
    t = np.arange(1024) / 64.0
    one, two = (0.5 + 0.5 * np.cos(2.0 * np.pi * a * t) for a in (f, g))
    power = np.abs(np.fft.rfft(one * two)) ** 2
    return float(np.fft.rfftfreq(t.size, 1.0 / 64.0)[power > 1e-9 * power.max()].max())
