"""What J12's Figs. 10 and 11 share: both forms at every place of the floor of scenes A and B."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland import Receiver, derivatives, irradiance
from firstorder.flatland.estimators._irradiance_forms import (
    arc_length_estimate,
    stratified_estimate,
)
from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata
from firstorder.flatland.library._scenes import scene_a, scene_b

SAMPLES, SEED = 100, 10
SCENES = {"A": scene_a, "B": scene_b}
RED, GREEN, BLUE, ORANGE, BLACK = "#c81e1e", "#15803d", "#1d4ed8", "#ea8a12", "#1b1b1b"


def curves(places: int) -> dict[str, np.ndarray]:
    """E, E' and E'' of each scene, exact and by both forms, by place."""
    x = jnp.linspace(-1.0, 1.0, places)
    keys = jax.random.split(jax.random.key(SEED), places)
    out = {"x": np.asarray(x)}
    for name, make in SCENES.items():
        scene = make()
        (floor,) = scene.named("floor")

        def at(x, floor=floor):
            return Receiver(jnp.stack([x, jnp.zeros_like(x)]), 0.0, floor)

        def sampled(x, key, scene=scene, at=at):
            seen = trace_strata(scene, at(x), where=hemicircle_strata(SAMPLES, key))
            return arc_length_estimate(seen).translation(), stratified_estimate(seen).translation()

        def right(x, scene=scene, at=at):
            return derivatives(lambda r: irradiance(scene, r), at(x), freedoms=("x",))

        found = (jax.jit(jax.vmap(right))(x), *jax.jit(jax.vmap(sampled))(x, keys))
        for form, d in zip(("exact", "arc length", "strata"), found, strict=True):
            for order, values in enumerate((d.value, d.first, d.second)):
                out[f"{name} {form} {order}"] = np.asarray(values)
    return out


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


def errors(data, order: int) -> dict[str, float]:
    """RMS error of each form over the largest magnitude: A everywhere, B in the penumbra."""
    out = {}
    for name in SCENES:
        where = penumbra(data["x"]) if name == "B" else np.ones_like(data["x"], bool)
        right = data[f"{name} exact {order}"]
        for form in ("arc length", "strata"):
            wrong = (data[f"{name} {form} {order}"] - right)[where]
            out[f"{name} {form}"] = float(np.sqrt(np.mean(wrong**2)) / np.max(np.abs(right[where])))
    return out


def drawn(order: int, colour: str, words: str, name: str, quick: bool) -> Drawing:
    """Figs. 10 and 11: a derivative of irradiance by both methods over both scenes."""
    places = 61 if quick else 401
    data = curves(places)
    figure = draw_pair(data, order, colour, words)
    return Drawing(
        figure,
        data,
        _claims(errors(data, order), name),
        {"curves": data},
        size=f"{places} places, {SAMPLES} samples each",
        seed=SEED,
    )


def _claims(error, name: str) -> list[Claim]:
    unit = "RMS error over the peak"
    ratio = error["B arc length"] / error["B strata"]
    return [
        Claim(
            f"Without occlusion the arc-length {name} is that of the closed form",
            "works well",
            error["A arc length"],
            unit,
            error["A arc length"] < 0.05,
        ),
        Claim(
            f"Without occlusion the stratified {name} is too",
            "works well",
            error["A strata"],
            unit,
            error["A strata"] < 0.05,
        ),
        Claim(
            f"In the penumbra the arc-length {name} fails",
            "fails",
            error["B arc length"],
            unit,
            error["B arc length"] > 0.2,
        ),
        Claim(
            f"In the penumbra the stratified {name} tracks the truth",
            "accounts for occlusion changes",
            error["B strata"],
            unit,
            error["B strata"] < 0.2,
        ),
        Claim(
            f"Error of the arc-length {name} over that of the stratified one, in the penumbra",
            "fails against tracks",
            ratio,
            "ratio",
            ratio > 2.0,
        ),
    ]
