"""J12 Fig. 17: the two test scenes in space, and the indirect light on their floor.

The paper gives albedos (0.5 on the left, 0 on the right) and no size: sizes are those of
`space.library._scenes.j12_box` and `j12_occluder`, the block's albedo is 0.5. The floor is black
and one reflection is followed, so that the light on walls and block is known in closed form, and
that on the floor by quadrature cut at every edge: once from maps of what surfaces send
(`shared.box`), once from the closed form (`shared.exact_box`, which later figures use).
Beside it stands what 30,000 stratified rays from every cell find, the number that the paper
uses: their difference is the noise below which no cache of such records can be judged.
"""

from __future__ import annotations

import numpy as np

from figures.j12.shared.box import Case, Size, case, exact, show_light, size
from figures.j12.shared.exact_box import Room, blocked_light, empty_light
from figures.style import Drawing
from figures.verdicts import Measurement
from firstorder import plotting
from firstorder.plotting.style import COLOURS
from firstorder.space import Scene

SCENES = {"j12_box": "box", "j12_occluder": "box with a block"}


def draw(quick: bool) -> Drawing:
    s = size(quick) if quick else Size(48, 100, 300, 1000, 3)
    figure, axes = plotting.panels(2, 3, 2.6, 2.4)
    claims, arrays = [], {}
    for row, (name, words) in enumerate(SCENES.items()):
        c = case(name, s)
        view, light, noise = axes[row]
        _view(view, c.maps.scene)
        view.set_title(words, fontsize=8)
        show_light(light, c, "indirect irradiance, exact")
        miss = c.image(c.table.E - c.truth)
        most = 3.0 * c.noise
        noise.imshow(miss, cmap="RdBu_r", vmin=-most, vmax=most, extent=(0, 1, 0, 1))
        noise.set(xticks=[], yticks=[])
        noise.set_title("table minus exact", fontsize=8)
        noise.set_xlabel(f"RMS {c.noise:.1e} W/m²", fontsize=7.5)
        arrays |= {f"{name}_truth": c.image(c.truth), f"{name}_table": c.image(c.table.E)}
        finer = exact(c.maps, c.table.position[::7], 48, 32)
        claims += _claims(words, c, finer, _closed(name, c.table.position))
    return Drawing(
        figure, arrays, claims, size=f"{s.pixels}^2 places, {s.rows * s.columns} rays", seed=0
    )


def _closed(name: str, x: np.ndarray) -> np.ndarray:
    """Irradiance from what surfaces send in closed form."""
    return empty_light(Room())(x).E if name == "j12_box" else blocked_light(Room(), x).E


def _claims(words: str, c: Case, finer: np.ndarray, closed: np.ndarray) -> list[Measurement]:
    mean = np.mean(c.truth)
    return [
        Measurement(
            f"RMS error of the irradiance of 30,000 rays over its mean, {words}", c.noise / mean
        ),
        Measurement(
            f"Change of the exact irradiance with twice the nodes, over its mean, {words}",
            np.max(np.abs(finer - c.truth[::7])) / mean,
        ),
        Measurement(
            "RMS difference of the exact irradiance by radiance maps of 128^2 cells from that in "
            f"closed form, over its mean, {words}",
            np.sqrt(np.mean((c.truth - closed) ** 2)) / mean,
        ),
    ]


def _view(ax, scene: Scene) -> None:
    """Faces as a pinhole before the box sees them, the farthest first; lamps are yellow."""
    eye, target = np.array([0.72, -1.7, 0.95]), np.array([0.5, 0.5, 0.45])
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0]) / np.hypot(*ahead[:2])
    frame = np.stack([right, np.cross(right, ahead), ahead])
    square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    faces, index = [], 0
    for group in scene.groups:
        cube = type(group).__name__ == "Boxes"
        for center, axes in zip(np.asarray(group.center), np.asarray(group.axes), strict=True):
            for a, sign in [(a, b) for a in range(3) for b in (-1, 1)] if cube else [(2, 0)]:
                q = np.roll(np.insert(square, 0, sign, axis=1), a, axis=1)
                faces.append((center + q @ axes.T, index))
            index += 1
    faces.sort(key=lambda face: -np.linalg.norm(face[0].mean(axis=0) - eye))
    for corners, index in faces:
        p = (corners - eye) @ frame.T
        lamp = float(scene.material.emission[index, 0]) > 0.0
        grey = str(0.3 + 0.9 * float(scene.material.albedo[index, 0]))
        color = COLOURS[3] if lamp else grey
        ax.fill(
            p[:, 0] / p[:, 2], p[:, 1] / p[:, 2], facecolor=color, edgecolor="black", lw=0.7, ls="-"
        )
    ax.set(aspect="equal", xticks=[], yticks=[])
