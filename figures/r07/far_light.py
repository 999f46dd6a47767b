"""R07 §5.2: lamps taken for distant where CDV is much larger than SV, and the error that makes.

The paper proposes it and shows no picture. The scene is `r07.shared.table` without shadows; the
lamp has 8 x 8 Gauss nodes, at its own distance of 3 m and at 4 times that. Where `CDV > t SV` (both
lobes together) a pixel is shaded by the lamp as it looks from the middle of its object
(`imaging.sky_lights.distant_lamp`): from a sphere's centre, and on the table from the point below
them. Errors are over those pixels alone: of values as a share of the rms value, of gradients as a
share of the rms gradient. Of the gradient along the surface a single lobe loses at most `1 / (t -
1)` with its SV; where the CDV of two lobes point against each other, or the turn of the view
against both, the share is larger. That the light is looked at from elsewhere costs more: on a
sphere of 0.5 m under a lamp at 3 m its near side gets up to 1.4 times what its centre would, in
values and in gradients alike. The criterion compares slopes and does not know of it: errors do not
fall with the threshold. They do with the distance. That SV is below an eighth of CDV where `CDV > 8
SV` is how these pixels were chosen: it is measured, and no verdict is given.
"""

from __future__ import annotations

import functools

import numpy as np

from figures.r07.shared import table as shared
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.imaging.shading import SurfaceMaps, shade_pixels
from firstorder.imaging.sky_lights import distant_lamp
from firstorder.reconstruction.importance import is_far_light

PLACES = {"table": (0.0, 0.0, 0.0), "diffuse": (-1.2, 0.0, 0.5), "glossy": (0.0, 0.0, 0.5),
          "bumpy": (1.2, 0.0, 0.5)}  # fmt: skip
THRESHOLDS = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
SHOWN = 8.0


def draw(quick: bool) -> Drawing:
    side = 64 if quick else 512
    world = shared.table()
    p = shared.coordinates(shared.grid(side), side)
    index = shared.shown(world, p)
    found = {far: _both(world, shared.lamp(far), p, index) for far in (1.0, 4.0)}
    tables = {far: _errors(*each, index) for far, each in found.items()}
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
    size = f"{side} x {side} pixels, 64 light nodes"
    return Drawing(figure, arrays, _claims(tables, shares), curves, size)


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


def _errors(near, distant, index) -> dict[str, np.ndarray]:
    """Over the pixels that are taken for far-lit."""
    out = {"value": [], "gradient": [], "SV": []}
    for t in THRESHOLDS:
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


def _claims(tables, shares) -> list[Claim]:
    at = int(np.flatnonzero(SHOWN == THRESHOLDS)[0])
    share = {o: 100.0 * shares[1.0][o][at] for o in shared.NAMES}
    claims = [
        Claim(f"Lit pixels for which the lamp is far, CDV > 8 SV: {o}", None, v, "%")
        for o, v in share.items()
    ]
    most = max(share.values())
    claims += [
        Claim("The lamp is far for more of the bumpy sphere than of anything else", "far",
              "yes" if share["bumpy"] == most else "no", "", share["bumpy"] == most),
        Claim("SV where CDV > 8 SV, rms, of the rms CDV there", "<<", 100.0 * tables[1.0]["SV"][at],
              "%"),
    ]  # fmt: skip
    for far, words in ((1.0, "its distance"), (4.0, "4 times its distance")):
        for name in ("value", "gradient"):
            claims.append(Claim(f"Error of {name}s where CDV > 8 SV, the lamp at {words}", None,
                                100.0 * tables[far][name][at], "% of rms"))  # fmt: skip
    gain = tables[1.0]["value"][at] / tables[4.0]["value"][at]
    claims.append(Claim("Values' error: the lamp at its distance over 4 times that", "far light",
                        gain, "times", bool(gain > 1.0)))  # fmt: skip
    return claims
