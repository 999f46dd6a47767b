"""Every scene that ships by name, as a map.

Not a figure of the papers; what they leave open, and what is chosen here, stands in the docstring
of each scene (`firstorder.flatland.library._scenes`, `firstorder.flatland.library._e11`). Lines are
as dark as their albedo is low; yellow emits, stars are lights without size, a ring is the sky,
short ticks are normals, and what is outlined in red is the floor, on which the papers look.

The one claim: every scene comes back from its TOML file to the bit.
"""

from __future__ import annotations

import jax
import numpy as np

from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_least
from firstorder import plotting
from firstorder.flatland.library import _scenes as scenes
from firstorder.io import flatland_from_toml, flatland_to_toml


def draw(quick: bool) -> Drawing:
    """Five in a row."""
    names = scenes.scene_names()
    columns = 5
    rows = -(-len(names) // columns)
    figure, axes = plotting.panels(rows, columns, 2.5, 2.3)
    back = 0
    for ax, name in zip(axes.flat, names, strict=False):
        scene = scenes.named_scene(name)
        ax.set_title(name, loc="left")
        plotting.draw_scene(ax, scene, receivers=("floor",))
        plotting.print_scale(ax, f"{scene.count} shapes")
        again = flatland_from_toml(flatland_to_toml(scene))
        back += _same(scene, again)
    for ax in axes.flat[len(names) :]:
        ax.set_axis_off()
    counts = {"shapes": np.array([scenes.named_scene(name).count for name in names])}
    claim = Statement(
        "Share of the scenes that ship by name that come back from their TOML file to the bit",
        None, back / len(names), at_least(1.0, "all"), OURS,
    )  # fmt: skip
    return Drawing(figure, counts, [claim], size=f"{len(names)} scenes")


def _same(one, other) -> bool:
    """Whether two trees have one form, names among it, and every leaf the same bits."""
    leaves = [[np.asarray(a) for a in jax.tree.leaves(tree)] for tree in (one, other)]
    return jax.tree.structure(one) == jax.tree.structure(other) and all(
        a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in zip(*leaves, strict=True)
    )
