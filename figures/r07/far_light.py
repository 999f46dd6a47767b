"""R07 §5.2: lamps taken for distant where CDV is much larger than SV, and the error that makes.

The paper proposes it and shows no picture. The scene is `r07.shared.table` without shadows; the
lamp has 8 x 8 Gauss nodes, at its own distance of 3 m and at 4 times that. Where `CDV > t SV` (both
lobes together) a pixel is shaded by the lamp as it looks from the middle of its object
(`imaging.sky_lights.distant_lamp`): from a sphere's centre, and on the table from the point below
them. Errors are over those pixels alone: of values as a share of the rms value, of gradients as a
share of the rms gradient. What is claimed is judged over lay-outs of materials, lamps and bumps
(`r07.shared.table.layouts`), by geometric means.

"Far" is taken for CDV > 8 SV. The SV that is left out there is an eighth of CDV at most, and by
that an error of an eighth is what the criterion promises. Of the gradient along the surface a
single lobe loses at most `1 / (t - 1)` with its SV; where the CDV of two lobes point against each
other, or the turn of the view against both, the share is larger. That the light is looked at from
elsewhere costs more: on a sphere of 0.5 m under a lamp at 3 m its near side gets up to 1.4 times
what its centre would, in values and in gradients alike. The criterion compares slopes and does not
know of it: errors do not fall with the threshold. They do with the distance.
"""

from __future__ import annotations

import functools

import numpy as np

from figures.r07.shared import table as shared
from figures.spread import geometric
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.imaging.shading import SurfaceMaps, shade_pixels
from firstorder.imaging.sky_lights import distant_lamp
from firstorder.reconstruction.importance import is_far_light

PLACES = {"table": (0.0, 0.0, 0.0), "diffuse": (-1.2, 0.0, 0.5), "glossy": (0.0, 0.0, 0.5),
          "bumpy": (1.2, 0.0, 0.5)}  # fmt: skip
THRESHOLDS = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
SHOWN = 8.0
SOURCE = "R07 §5.2"


def draw(quick: bool) -> Drawing:
    side = 64 if quick else 512
    world = shared.table()
    p = shared.coordinates(shared.grid(side), side)
    index = shared.shown(world, p)
    found = {far: _both(world, shared.lamp(far), p, index) for far in (1.0, 4.0)}
    tables = {far: _errors(*each) for far, each in found.items()}
    count, small = (3, 32) if quick else (24, 96)
    scan = [_scanned(layout, small) for layout in shared.layouts(count)]
    shares = {far: _shares(world, each[0], index) for far, each in found.items()}

    near, distant = found[1.0]
    chosen = _far(near, SHOWN)
    mixed = np.where(chosen, distant.value, near.value).reshape(side, side)
    figure, axes = plotting.panels(1, 4, 3.1, 2.9)
    options = dict(cmap=plotting.RADIANCE, vmin=0.0, vmax=np.quantile(near.value, 0.998))
    shared.show(axes[0, 0], mixed, "a) distant where CDV > 8 SV", **options)
    error = abs(mixed - near.value.reshape(side, side))
    drawn = shared.show_decades(axes[0, 1], error, "b) error of a", -5.0, -1.0)
    figure.colorbar(drawn, ax=axes[0, 1], label="log$_{10}$ W/(m$^2$ sr)")
    for far, rows in tables.items():
        axes[0, 2].loglog(THRESHOLDS, rows["value"], "o-", markersize=3, label=f"values, {far:g}x")
        axes[0, 2].loglog(THRESHOLDS, rows["gradient"], "s-", markersize=3,
                          label=f"gradients, {far:g}x")  # fmt: skip
    axes[0, 2].loglog(THRESHOLDS, tables[1.0]["SV"], ":", color="0.5", label="SV over CDV, 1x")
    axes[0, 2].set(title="c) errors with the threshold", xlabel="threshold of CDV / SV",
                   ylabel="share of rms")  # fmt: skip
    axes[0, 2].legend(fontsize=7)
    for name in shared.NAMES:
        axes[0, 3].semilogx(THRESHOLDS, shares[1.0][name], "o-", markersize=3, label=name)
    axes[0, 3].set(title="d) pixels taken for far-lit, 1x", xlabel="threshold of CDV / SV",
                   ylabel="share")  # fmt: skip
    axes[0, 3].legend(fontsize=7)

    curves = {
        "near": {"threshold": THRESHOLDS, **tables[1.0], **shares[1.0]},
        "far": {"threshold": THRESHOLDS, **tables[4.0], **shares[4.0]},
    }
    arrays = {"mixed": mixed, "near": near.value.reshape(side, side)}
    size = f"{side} x {side} pixels, 64 light nodes; lay-outs {small} x {small}"
    claims = [*_claims(scan, f"{count} lay-outs"), *_shown(tables, shares)]
    return Drawing(figure, arrays, claims, curves, size)


def _both(world, lamp, p, index):
    """Pixels by near light, and by the same taken for distant, object by object."""
    finish, camera = SurfaceMaps(world.height), world.camera
    near = shade_pixels(world.scene, camera, [lamp], p, index, finish, False)
    parts = []
    for name, place in PLACES.items():
        k = world.scene.named(name)[0]
        own = np.where(index == k, index, -1)
        lights = [distant_lamp(lamp, np.array(place))]
        parts.append(shade_pixels(world.scene, camera, lights, p, own, finish, False))
    return near, functools.reduce(_sum, parts)


def _sum(a, b):
    """Pixels of different objects together: where one has any the other has zeros."""
    return type(a)(*(getattr(a, f) + getattr(b, f) for f in a.__dataclass_fields__))


def _far(near, threshold: float) -> np.ndarray:
    SV, CDV = np.sum(near.SV, -1), np.sum(near.CDV, -1)
    return is_far_light(CDV, SV, threshold) & (near.value > 0.0)


def _errors(near, distant, thresholds=THRESHOLDS) -> dict[str, np.ndarray]:
    """Over the pixels that are taken for far-lit, by the threshold."""
    out = {"value": [], "gradient": [], "SV": []}
    for t in thresholds:
        far = _far(near, t)
        SV, CDV = (np.sum(a, -1)[far] for a in (near.SV, near.CDV))
        out["SV"].append(float(np.sqrt(np.mean(SV**2) / np.mean(CDV**2))))
        for name in ("value", "gradient"):
            errors = out[name]
            a, b = (np.asarray(getattr(each, name))[far] for each in (distant, near))
            errors.append(float(np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2))))
    return {k: np.array(v) for k, v in out.items()}


def _shares(world, near, index) -> dict[str, np.ndarray]:
    """Of each object's lit pixels, how many are taken for far-lit."""
    out = {}
    for name in shared.NAMES:
        here = (index == world.scene.named(name)[0]) & (near.value > 0.0)
        out[name] = np.array([np.mean(_far(near, t)[here]) for t in THRESHOLDS])
    return out


def _scanned(layout, side: int) -> dict[str, float]:
    """Of one lay-out: errors where the lamp is far, at both distances, and who is far-lit."""
    p = shared.coordinates(shared.grid(side), side)
    index = shared.shown(layout.world, p)
    out, at = {}, int(np.flatnonzero(SHOWN == THRESHOLDS)[0])
    for far in (1.0, 4.0):
        near, distant = _both(layout.world, layout.lamp(far), p, index)
        errors = _errors(near, distant, THRESHOLDS[at : at + 1])
        out |= {f"{name}, {far:g}x": errors[name][0] for name in ("value", "gradient")}
        if far == 1.0:
            shares = _shares(layout.world, near, index)
            out |= {name: share[at] for name, share in shares.items()}
    return out


def _claims(scan, scanned: str) -> list[Statement]:
    """Over lay-outs: means with their standard errors."""
    more = [row["bumpy"] - row["table"] for row in scan]
    told = [
        Statement("A lamp may be far for a bump-mapped object and not for a flat table: share of "
                  "lit pixels with CDV > 8 SV, bumpy sphere less table", "far, not far",
                  np.mean(more), at_least(0.0, "more of the bumpy sphere"), SOURCE, "",
                  np.std(more, ddof=1) / len(more) ** 0.5, scanned)
    ]  # fmt: skip
    elsewhere = (
        "The lamp is looked at from the middle of the object, a radius r from where its light "
        "falls: that changes light by 2 r / d, whatever SV and CDV are. "
    )
    reasons = {
        "value": elsewhere + "It fails for lamps nearer than some 16 radii.",
        "gradient": elsewhere + "SV is lost besides, of a single lobe up to 1/7, and more of two "
        "whose CDV point against each other: it fails at 24 radii too.",
    }
    for name in ("value", "gradient"):
        for far, words in ((1.0, "3 m away"), (4.0, "12 m away")):
            got = geometric([row[f"{name}, {far:g}x"] for row in scan])
            told.append(
                Statement(f"Lamps could be treated as distant where CDV > 8 SV: error of {name}s, "
                          f"the lamp {words}", "distant", got.mean,
                          at_most(1.0 / SHOWN, "an eighth, as the criterion leaves out"), SOURCE,
                          "of rms", got.error, scanned, reasons[name])
            )  # fmt: skip
    return told


def _shown(tables, shares) -> list[Measurement]:
    """Of the scene in the picture."""
    at = int(np.flatnonzero(SHOWN == THRESHOLDS)[0])
    words = "The scene that is shown: lit pixels with CDV > 8 SV, {}"
    told = [
        Measurement(words.format(o), 100.0 * shares[1.0][o][at], "%", source=SOURCE)
        for o in shared.NAMES
    ]
    table = tables[1.0]["value"]
    last = f"{table[0]:.2f}, {table[at]:.2f}, {table[-1]:.2f}"
    words = "The scene that is shown: error of values where CDV > 1, 8, 64 SV"
    return [*told, Measurement(words, last, "of rms")]
