"""Pictures of the comparisons, small enough for the documentation."""

from __future__ import annotations

import io
import pathlib
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from benchmarks.peers import contenders, gradients
from benchmarks.peers.soft_shadows import QUESTIONS, SHADOWS
from firstorder import plotting

LOOKS = {
    contenders.OURS: (plotting.COLOURS[0], "*"),
    contenders.MITSUBA_STEPS: (plotting.COLOURS[1], "o"),
    contenders.RADIANCE_STEPS: (plotting.COLOURS[2], "s"),
    contenders.RADIANCE: (plotting.COLOURS[3], "D"),
    contenders.SAMPLED: ("0.45", "x"),
    f"{contenders.PROJECTIVE}, octree": (plotting.COLOURS[4], "^"),
    f"{contenders.PROJECTIVE}, none": (plotting.COLOURS[4], "v"),
}


def drawn(results: dict[str, Any]) -> dict[str, Figure]:
    """A figure for each comparison that has one."""
    makers = {"gradients": _gradients, "floor_cache": _floor_cache}
    with plotting.house_style():
        return {name: make(results[name]) for name, make in makers.items() if name in results}


def write(folder: pathlib.Path, results: dict[str, Any]) -> None:
    """Every figure as a PNG of few colours."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, figure in drawn(results).items():
        raw, few = io.BytesIO(), io.BytesIO()
        figure.savefig(raw, format="png", dpi=110)
        with Image.open(raw) as image:
            colours = image.convert("RGB").quantize(128, Image.Quantize.FASTOCTREE,
                                                    dither=Image.Dither.NONE)  # fmt: skip
            colours.save(few, "png", optimize=True)
        (folder / f"{name}.png").write_bytes(few.getvalue())


# --- gradients -----------------------------------------------------------------------------------


def _gradients(found: dict[str, Any]) -> Figure:
    """A column for each shadow: the floor, and errors over time for both questions."""
    names = list(found["shadows"])
    figure, axes = plotting.panels(3, len(names), 3.0, 2.4)
    for column, name in enumerate(names):
        _floor(axes[0, column], name)
        for row, question in enumerate(QUESTIONS, 1):
            _errors(axes[row, column], found["shadows"][name]["questions"][question]["rows"])
            axes[row, column].set_title(f"{name}: gradient for the {question}", fontsize=8)
    handles = {line.get_label(): line for ax in axes[1:].ravel() for line in ax.get_lines()}
    shown = [handles[name] for name in LOOKS if name in handles]
    figure.legend(handles=shown, loc="outside lower center", ncols=max(1, 4 * len(names) // 3),
                  fontsize=7)  # fmt: skip
    return figure


def _floor(ax: Axes, name: str) -> None:
    shadow, e = SHADOWS[name], gradients.EXTENT
    image = gradients.light(shadow, 64)
    ax.imshow(image, cmap="magma", vmin=0.0, extent=(-e, e, -e, e), origin="lower")
    places = np.asarray(shadow.places)
    ax.plot(places[:, 0], places[:, 1], "o", color="white", markersize=3.5, markeredgecolor="black")
    ax.set_title(f"{name}: E on the floor, places", fontsize=8)
    ax.set(xticks=[-e, e], yticks=[-e, e], xlabel="x (m)", ylabel="y (m)")


def _errors(ax: Axes, rows: list[dict[str, Any]]) -> None:
    for name in dict.fromkeys(row["way"] for row in rows):
        own = [row for row in rows if row["way"] == name]
        colour, mark = LOOKS[name]
        ax.loglog([r["seconds"] for r in own], [r["error"] for r in own], f"{mark}-", color=colour,
                  markersize=8 if mark == "*" else 4, linewidth=0.9, label=name)  # fmt: skip
    ax.axhline(gradients.LEVEL, color="0.7", linewidth=0.7, linestyle=":")
    ax.set(xlabel="time of a place, over ours", ylabel="relative error", ylim=(1e-12, 30.0))


# --- the cache -----------------------------------------------------------------------------------


def _floor_cache(found: dict[str, Any]) -> Figure:
    """The true light on the floor, and where each cache errs."""
    images = {k: np.array(v, float) for k, v in found["images"].items()}
    names = [name for name in images if name != "truth"]
    figure, axes = plotting.panels(1, len(names) + 1, 2.1, 2.5)
    shown = axes[0, 0].imshow(images["truth"], cmap="magma", vmin=0.0, origin="lower")
    axes[0, 0].set_title("reflected E (W/m²)", fontsize=8)
    figure.colorbar(shown, ax=axes[0, 0], location="bottom")
    for ax, name in zip(axes[0, 1:], names, strict=True):
        error = ax.imshow(
            100.0 * images[name], cmap="RdBu_r", vmin=-15.0, vmax=15.0, origin="lower"
        )
        ax.set_title(f"{name}\nRMS {100.0 * found['rows'][name]['error']:.2f} %", fontsize=7.5)
    figure.colorbar(error, ax=list(axes[0, 1:]), location="bottom", shrink=0.5,
                    label="error, % of the mean")  # fmt: skip
    for ax in axes[0]:
        ax.set(xticks=[], yticks=[])
    return figure
