"""What J12's Figs. 10 and 11 share: both forms at every place of the floor of scenes A and B.

"Performs well" is read as an RMS error of at most a twentieth of the peak at the paper's 100
samples. "Fails" and "tracks" are read from 16 times as many: an error of sampling falls to a
quarter or below, and one of the formulation stays. Standard errors are over seeds.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.spread import Spread, ratio_of_means, spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.flatland import Receiver, derivatives, irradiance
from firstorder.flatland.estimators._irradiance_forms import (
    arc_length_estimate,
    stratified_estimate,
)
from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata
from firstorder.flatland.library._scenes import scene_a, scene_b

SAMPLES, MORE, SEED = 100, 1600, 10
FORMS = ("arc length", "strata")
# Both were written down before the run. A twentieth of the peak is a line's width in a plot. An
# error of random samples falls at least with their square root, here by 4; what is left out stays.
WELL, FALLS, STAYS = 0.05, 0.25, 0.5
UNIT = "RMS error over the peak"
SCENES = {"A": scene_a, "B": scene_b}
RED, GREEN, BLUE, ORANGE, BLACK = "#c81e1e", "#15803d", "#1d4ed8", "#ea8a12", "#1b1b1b"


def curves(places: int, seeds: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """E, E' and E'' of each scene, exact and by both forms: of one seed, and of all.

    The first has `"A exact 1"` and the like by place; the second `"A strata 1600"`, by seed, order
    and place.
    """
    x = jnp.linspace(-1.0, 1.0, places)
    shown, runs = {"x": np.asarray(x)}, {}
    for name, make in SCENES.items():
        scene = make()
        (floor,) = scene.named("floor")

        def at(x, floor=floor):
            return Receiver(jnp.stack([x, jnp.zeros_like(x)]), 0.0, floor)

        def right(x, scene=scene, at=at):
            return derivatives(lambda r: irradiance(scene, r), at(x), freedoms=("x",))

        d = jax.jit(jax.vmap(right))(x)
        for order, values in enumerate((d.value, d.first, d.second)):
            shown[f"{name} exact {order}"] = np.asarray(values)
        for samples in (SAMPLES, MORE):
            runs |= {
                f"{name} {form} {samples}": values
                for form, values in _sampled(scene, at, x, samples, seeds).items()
            }
        for form in FORMS:
            for order in range(3):
                shown[f"{name} {form} {order}"] = runs[f"{name} {form} {SAMPLES}"][0, order]
    return shown, runs


def _sampled(scene, at, x, samples: int, seeds: int) -> dict[str, np.ndarray]:
    """Both forms from jittered strata, by seed, order and place."""

    def one(x, key):
        seen = trace_strata(scene, at(x), where=hemicircle_strata(samples, key))
        both = arc_length_estimate(seen), stratified_estimate(seen)
        found = [motion.translation() for motion in both]
        return jnp.stack([jnp.stack([d.value, d.first, d.second]) for d in found])

    run = jax.jit(lambda key: jax.vmap(one)(x, jax.random.split(key, x.shape[0])))
    keys = jax.random.split(jax.random.key(SEED), seeds)
    found = np.stack([np.asarray(run(key)) for key in keys])  # seeds, places, forms, orders
    return {form: found[:, :, k].transpose(0, 2, 1) for k, form in enumerate(FORMS)}


def draw_pair(data, order: int, colour: str, words: str):
    """Two panels: the derivative of each scene, exact and by both forms, over E in red."""
    figure, axes = plotting.panels(1, 2, 4.2, 2.9)
    for ax, name in zip(axes[0], SCENES, strict=True):
        x = data["x"]
        ax.axhline(0.0, color="0.8", lw=0.6)
        ax.plot(x, data[f"{name} exact 0"], "-", color=RED, label="E")
        for form, shade in (("arc length", ORANGE), ("strata", BLACK)):
            ax.plot(x, data[f"{name} {form} {order}"], "-", color=shade, lw=0.8, label=form)
        ax.plot(x, data[f"{name} exact {order}"], "-", color=colour, lw=1.6, label=words)
        ax.set(xlabel=plotting.label("x"), ylabel=f"E (W/m), {words}")
        ax.set_title(f"scene {name}, {SAMPLES} samples a point", loc="left")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    plotting.share_labels(axes)
    return figure


def penumbra(x):
    """Where a shadow edge of scene B lies on its light: everywhere but near the ends."""
    return np.abs(x) < 0.9


def drawn(order: int, colour: str, words: str, name: str, quick: bool) -> Drawing:
    """Figs. 10 and 11: a derivative of irradiance by both methods over both scenes."""
    places, seeds = (61, 3) if quick else (401, 20)
    data, runs = curves(places, seeds)
    figure = draw_pair(data, order, colour, words)
    return Drawing(
        figure,
        data,
        _claims(data, runs, order, name),
        {"curves": data},
        size=f"{places} places, {SAMPLES} and {MORE} samples each, {seeds} seeds",
        seed=SEED,
    )


def _claims(data, runs, order: int, name: str) -> list[Statement | Measurement]:
    source = {1: "J12 §6.1", 2: "J12 Fig. 11"}[order]
    claims: list[Statement | Measurement] = []
    for form in FORMS:
        e = spread(errors(data, runs, "A", form, SAMPLES, order))
        claims.append(_well(f"Without occlusion the {form} {name} performs well", e, source))
    words = f"In fully lit regions of scene B both {name}s match: their difference, {MORE} samples"
    claims.append(_well(words, spread(_apart(data, runs, order)), source))
    for form in FORMS:
        few, many = (errors(data, runs, "B", form, n, order) for n in (SAMPLES, MORE))
        claims.append(_in_the_penumbra(form, name, ratio_of_means(many, few), source))
        e = spread(few)
        words = f"Error of the {form} {name} in the penumbra, {SAMPLES} samples"
        claims.append(Measurement(words, e.mean, UNIT, e.error, source))
    return claims + ([_underestimated(data, runs)] if order == 1 else [])


def _well(words: str, found: Spread, source: str) -> Statement:
    return Statement(
        words,
        paper="works well",
        measured=found.mean,
        rule=at_most(WELL, "'well': a line's width in a plot"),
        source=source,
        unit=UNIT,
        error=found.error,
    )


def _in_the_penumbra(form: str, name: str, found: Spread, source: str) -> Statement:
    fails = form == "arc length"
    return Statement(
        f"In the penumbra the {form} {name} {'fails' if fails else 'resembles the exact one'}: "
        f"RMS error with {MORE} samples over that with {SAMPLES}",
        paper="fails" if fails else "resembles closely",
        measured=found.mean,
        rule=at_least(STAYS, "'fails': more samples do not mend it")
        if fails
        else at_most(FALLS, "'resembles': an error of sampling, n^(-1/2) or faster"),
        source=source,
        error=found.error,
    )


def _underestimated(data, runs) -> Statement:
    where = penumbra(data["x"])
    right = np.mean(np.abs(data["B exact 1"][where]))
    means = np.mean(np.abs(runs[f"B arc length {MORE}"][:, 1, where]), axis=-1)
    found = spread(means / right)
    return Statement(
        "In the penumbra the magnitude of the arc-length gradient is underestimated: its mean over "
        "that of the exact one",
        paper="underestimated",
        measured=found.mean,
        rule=at_most(1.0, "'underestimated'"),
        source="J12 §6.1",
        error=found.error,
    )


def errors(data, runs, scene: str, form: str, samples: int, order: int) -> np.ndarray:
    """RMS error over the largest magnitude, by seed: A everywhere, B in the penumbra."""
    where = penumbra(data["x"]) if scene == "B" else np.ones_like(data["x"], bool)
    right = data[f"{scene} exact {order}"][where]
    wrong = runs[f"{scene} {form} {samples}"][:, order, where] - right
    return np.sqrt(np.mean(wrong**2, axis=-1)) / np.max(np.abs(right))


def _apart(data, runs, order: int) -> np.ndarray:
    """RMS difference of the forms where scene B has no penumbra, over the peak, by seed.

    The gap between lamp and blocker is narrower there than one of 100 strata, of which the paper
    says that it makes spikes: there are 16 times as many here.
    """
    lit = np.abs(data["x"]) > 0.9 + 1e-9
    arc, strata = (runs[f"B {form} {MORE}"][:, order, lit] for form in FORMS)
    peak = np.max(np.abs(data[f"B exact {order}"]))
    return np.sqrt(np.mean((arc - strata) ** 2, axis=-1)) / peak
