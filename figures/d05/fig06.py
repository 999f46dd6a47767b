"""D05 Fig. 6: light from a source past blockers to a diffuse receiver, with its spectra.

The paper gives no numbers for its 2D scene. Ours: a Gaussian area light (deviation 0.2 m, slopes
0.35), 1 m of travel, a comb of 7 opaque bars of period 0.25 m and half open, 1 m of travel, a
receiver facing the light (arrival turns x round), diffuse with rho = 1/2. The paper's 3D row
belongs to another figure. Upper spectra: closed form, step by step from that of the source. Lower
spectra: the transform of samples of the light at that step, which shares nothing with them; where
the light jumps (steps 3 to 5) the samples have a grid error, printed in the claims. At step 6 the
light is smooth again, and they agree to rounding.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.d05.shared import scene
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.fields import Grid, discrete_transform

TITLES = ("1 source", "2 travel", "3 blockers", "4 travel, arrival", "5 times $g(v)$")
SHOWN = (0, 1, 2, 4, 5)  # steps of the path; step 3 is travel before arrival


def draw(quick: bool) -> Drawing:
    frequencies = 25 if quick else 61
    samples = (2048, 128) if quick else (4096, 384)
    path = scene.path()
    steps, spectra = path.steps, path.spectra
    Omega = np.linspace(-6.0, 6.0, frequencies)
    grid = Grid.spanning(samples, (scene.HALF, scene.REACH))
    lights = [np.asarray(scene.sample(steps[k], grid)) for k in SHOWN]
    forms = [np.asarray(scene.closed(spectra[k], Omega, Omega)) for k in SHOWN]
    measured = [scene.transformed(steps[k], grid, Omega, Omega) for k in SHOWN]
    receiver = _receiver(path, 256 if quick else 512)

    figure, axes = plotting.panels(3, 6, 2.15, 2.1)
    for i, title in enumerate(TITLES):
        plotting.show_light_field(
            axes[0, i], lights[i], grid.axis(0), grid.axis(1), names=("x", "v"), title=title
        )
        axes[0, i].set(xlim=(-2.2, 2.2), ylim=(-1.2, 1.2))
        for row, F in ((1, forms[i]), (2, measured[i])):
            plotting.show_spectrum(
                axes[row, i],
                F,
                Omega,
                Omega,
                decades=3.0,
                names=("x", "v"),
                title=("closed form", "samples")[row - 1],
            )
    _draw_receiver(axes[:, 5], receiver)
    plotting.share_labels(axes[:, :5])
    errors = [
        float(np.max(np.abs(a - b)) / np.max(np.abs(b)))
        for a, b in zip(forms, measured, strict=True)
    ]
    arrays = {f"light_{k + 1}": a for k, a in enumerate(lights)}
    arrays |= {f"closed_{k + 1}": a for k, a in enumerate(forms)}
    arrays |= {f"sampled_{k + 1}": a for k, a in enumerate(measured)}
    arrays |= {"Omega_x": Omega, "Omega_v": Omega, "x": grid.axis(0), "v": grid.axis(1)}
    return Drawing(
        figure,
        arrays,
        [*_agreement(errors, receiver), *_shears(path), *_replicas(path)],
        {"receiver": {k: receiver[k] for k in ("x", "light")}},
        size=f"{samples[0]} x {samples[1]} samples, {frequencies}^2 frequencies",
    )


def _receiver(path, n: int) -> dict[str, np.ndarray]:
    """Light on the receiver, with both spectra."""
    line = Grid.spanning((n,), (scene.HALF,))
    Omega = np.linspace(-6.0, 6.0, 121)
    light = np.asarray(scene.sample(path.light, line))
    F = np.asarray(eqx.filter_jit(path.spectra[-1])(jnp.asarray(Omega)))
    sampled = np.asarray(discrete_transform(jnp.asarray(light), line, Omega))
    return {
        "x": np.asarray(line.axis(0)),
        "light": light,
        "Omega": Omega,
        "closed": F,
        "sampled": sampled,
    }


def _draw_receiver(axes, r) -> None:
    axes[0].plot(r["x"], r["light"])
    axes[0].set(xlim=(-2.2, 2.2), ylim=(0.0, None), xlabel=plotting.label("x"))
    axes[0].set_title("6 gathered: $l_o(x)$", loc="left")
    for ax, name, title in ((axes[1], "closed", "closed form"), (axes[2], "sampled", "samples")):
        magnitude = np.abs(r[name])
        ax.semilogy(r["Omega"], np.maximum(magnitude, 1e-16))
        ax.set(ylim=(1e-6 * magnitude.max(), 2.0 * magnitude.max()))
        ax.set(xlabel=plotting.label("Omega_x"))
        ax.set_title(title, loc="left")


def _agreement(errors, receiver) -> list[Claim]:
    difference = np.max(np.abs(receiver["closed"] - receiver["sampled"]))
    last = float(difference / np.max(np.abs(receiver["sampled"])))
    bounds = (1e-9, 1e-9, 0.02, 0.02, 0.02)
    names = ("source", "travel", "blockers", "second travel", "times g(v)")
    found = [
        Claim(
            f"spectrum after step {k + 1} ({name}): closed form and samples differ by",
            0.0,
            e,
            "of the peak" + (" (grid error of the edges)" if k > 1 else ""),
            e < bound,
        )
        for k, (name, e, bound) in enumerate(zip(names, errors, bounds, strict=True))
    ]
    words = "spectrum on the receiver: closed form and samples differ by"
    return [*found, Claim(words, 0.0, last, "of the peak", last < 1e-9)]


def _shears(path) -> list[Claim]:
    """Slope of the line on which the source's spatial frequencies lie after a travel."""
    S = np.asarray(path.covariances[1].matrix)
    slope = S[0, 1] / S[0, 0]
    words = "the first travel's shear has the slope of its distance (outgoing light)"
    return [Claim(words, scene.FIRST, slope, "m", abs(slope - scene.FIRST) < 1e-9)]


def _replicas(path) -> list[Claim]:
    """Where the first replica lies, how wide it is, and what the receiver sees of it."""
    series = path.events[1].transparency.series(Grid.spanning((2048, 8), (scene.HALF, 1.0)))
    s, c = np.asarray(series.frequencies)[:, 0], np.abs(np.asarray(series.coefficients))
    near = (s > 2.0) & (s < 6.0)
    peak = s[near][np.argmax(c[near])]
    wide = s[near][c[near] > 0.5 * c[near].max()]
    width, expected = wide.max() - wide.min(), 1.0 / (scene.BARS * scene.PERIOD)
    left = {p: _left(p, n) for p, n in ((0.5, 4), (0.25, 7), (0.125, 14))}
    bounds = (1.0, left[0.5], left[0.25])
    return [
        Claim(
            "the comb's first side lobe lies at one over its period",
            1.0 / scene.PERIOD,
            peak,
            "cycles/m",
            abs(peak * scene.PERIOD - 1.0) < 0.05,
        ),
        Claim(
            "few bars blur it: half width about one over the comb's length",
            expected,
            width,
            "cycles/m",
            0.5 < width / expected < 2.0,
        ),
        *(
            Claim(
                f"side lobe over main lobe on the receiver, period {p:g} m",
                "less for smaller blockers",
                value,
                "",
                value < bound,
            )
            for (p, value), bound in zip(left.items(), bounds, strict=True)
        ),
    ]


def _left(period: float, bars: int) -> float:
    """What the receiver sees of the pattern: on Omega_v = 0 it is met at a magnified period."""
    met = scene.FIRST / (scene.FIRST + scene.SECOND) / period
    F = eqx.filter_jit(scene.path((320, 160), period, bars).spectra[-1])
    near = np.asarray(F(jnp.linspace(met - 0.25, met + 0.25, 41)))
    return float(np.max(np.abs(near)) / abs(complex(F(0.0))))
