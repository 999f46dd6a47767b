"""D05 Fig. 1: spectra of the light field at several places of a scene in space, along one path.

The paper shows its 3D scene without numbers. Ours goes on from that of Fig. 6 (3D): a round light
(Gaussian, 0.15 m and 0.3 in slopes), balls of radius 0.12 m a metre away, a metre more to a glossy
ball of radius 2 m that the central ray meets at 40 degrees (lobe of 0.08 rad), and half a metre on.
On the left the scene, rendered: the glossy ball has a lobe of 0.08 rad there too, and reflects a
little diffusely, so that shadows on it can be seen; numbers are those of the places.
Upper row: n^4 rays traced against the balls and off the curved, glossy surface (a paraboloid with
the ball's curvature), windowed, transformed with padding, and averaged over rings of spatial and of
angular frequency. Lower row: the prediction of the same path in four coordinates, its last steps by
`GlossyPatch`, D05's §5.2 with the cosine that it leaves out. Aliasing is there, as in the paper's.

What is drawn passes opaque balls. Moments are compared past soft ones, jittered anew in every
lay-out: behind a sharp rim the second moment of a spectrum has no value (`d05.shared.space`). Their
window is narrower, so that rays stand 0.08 m apart and resolve the balls.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from figures.d05.shared import picture, receiver, space
from figures.d05.shared.readings import ALIKE, alike, less, more
from figures.spread import spread
from figures.style import Drawing
from figures.verdicts import Measurement, Statement
from firstorder.imaging.camera import pinhole

RADIUS, ASLANT, SIGMA, ON = 2.0, math.radians(40.0), 0.08, 0.5
SHAPE = -np.eye(2) / RADIUS
PERIOD = 0.4
NUMBER = dict(boxstyle="circle,pad=0.15", facecolor="white", edgecolor="0.3", linewidth=0.6)
TITLES = (
    "1 at the light",
    "2 before the blockers",
    "3 behind them",
    "4 at the ball",
    "5 off the ball",
    "6 further on",
)


def draw(quick: bool) -> Drawing:
    n, tried, nodes = (12, 12, 3) if quick else (24, 20, 5)
    balls = space.Balls.jittered(PERIOD)
    series = balls.series(24 if quick else 44)
    wide = space.Window(0.35, 0.3, n)
    steps = [receiver.step(p, series) for p in _places(balls, wide, nodes)]
    narrow = space.Window(0.25, 0.2, tried, 1.0)
    scanned = receiver.layouts(
        functools.partial(_places, window=narrow, nodes=nodes), PERIOD, quick
    )
    figure = Figure(figsize=(18.6, 4.7), layout="constrained")
    grid = figure.add_gridspec(2, 8)
    axes = np.array([[figure.add_subplot(grid[i, 2 + k]) for k in range(6)] for i in (0, 1)])
    receiver.draw_steps(axes, steps)
    _draw_scene(figure.add_subplot(grid[:, :2]), balls, quick)
    arrays = {}
    for k, step in enumerate(steps, start=1):
        arrays |= {f"measured_{k}": step.rings[0], f"predicted_{k}": step.rings[1]}
        arrays |= {f"Omega_x_{k}": step.axes[0], f"Omega_v_{k}": step.axes[1]}
    claims = [*receiver.agreement(steps, scanned), *_effects(scanned), *_cosine(scanned)]
    size = f"{n}^4 rays a step, {tried}^4 in each lay-out"
    return Drawing(figure, arrays, claims, size=size, seed=7)


def _places(balls, window: space.Window, nodes: int) -> list[receiver.Place]:
    """Light, balls, glossy ball, and on."""
    p = [space.source()]
    p.append(space.travelled(p[0], space.FIRST))
    p.append((p[1][0].blocked(), p[1][1].blocked()))
    p.append(space.turned(space.travelled(p[2], space.SECOND)))
    p.append(space.glossy(p[3], jnp.asarray(SHAPE), ASLANT, SIGMA))
    p.append(_on(p[3], SHAPE))
    off = functools.partial(space.Glossed, balls, RADIUS, ASLANT, SIGMA, nodes)
    lights = (
        space.Light(None, 0.0),
        space.Light(None, space.FIRST),
        space.Light(balls, space.FIRST),
        space.Light(balls, space.FIRST + space.SECOND, arriving=True),
        off(),
        off(on=ON),
    )
    windows = [dataclasses.replace(window, x=0.4, v=0.5)] + [window] * 5
    rows = zip(TITLES, windows, lights, p, strict=True)
    return [receiver.Place(*row, behind=k > 1) for k, row in enumerate(rows)]


def _draw_scene(ax, balls, quick: bool) -> None:
    """Light, balls and glossy ball, with the central ray and the places along it."""
    normal = np.array([-np.sin(ASLANT), 0.0, np.cos(ASLANT)])
    middle = -RADIUS * normal

    def shade(points, way):
        n = (points - middle) / RADIUS
        mirrored = way - 2.0 * np.sum(way * n, 1)[:, None] * n
        diffuse = picture.source_light(points, n, balls, 14) + picture.faint_light(n)
        lobe = jnp.asarray(mirrored), SIGMA
        return 0.25 / np.pi * diffuse + 0.3 * picture.source_light(points, n, balls, 14, lobe)

    camera = pinhole((-2.2, -7.5, 1.9), (0.2, 0.0, 0.8), gamma=4.6)
    ball = picture.sphere(middle, RADIUS)
    shape = (180, 180) if quick else (560, 560)
    view = picture.View(camera, ball, shade, picture.GLOSSY, 1.3, shape)
    picture.show(ax, view, balls, "the scene, and the places of the spectra")
    off = np.array([-np.sin(2.0 * ASLANT), 0.0, np.cos(2.0 * ASLANT)])
    picture.draw_path(ax, view, [(0.0, 0.0, 0.0), 1.6 * ON * off])
    top = space.FIRST + space.SECOND
    for k, point in enumerate(((0, 0, top), (0, 0, top - 0.8), (0, 0, 0.8), (0, 0, 0.16),
                               0.12 * off, ON * off), start=1):  # fmt: skip
        picture.name(ax, view, point, str(k), ha="center", bbox=NUMBER)


def _on(pairs, shape, theta0=ASLANT) -> space.Pairs:
    """From the ball's plane off it and on."""
    return space.travelled(space.glossy(pairs, jnp.asarray(shape), theta0, SIGMA), ON)


def _arriving() -> space.Pairs:
    """Pairs of the light that is blocked and arrives at the ball."""
    p = space.travelled(space.source(), space.FIRST)
    return space.turned(space.travelled((p[0].blocked(), p[1].blocked()), space.SECOND))


def _printed(theta0=ASLANT) -> np.ndarray:
    """A shape for which `glossy` shears by k across the plane of incidence, not by k cos."""
    return SHAPE @ np.diag([1.0, 1.0 / np.cos(theta0)])


def _cosine(scanned) -> list[Statement | Measurement]:
    """The last step with the shear as D05 prints it: k, not k cos, across the plane."""
    off = []
    for seed, steps in enumerate(scanned):
        last = steps[5]
        series = space.Balls.jittered(PERIOD, seed, soft=True).series(
            16 if len(scanned) < 20 else 44
        )
        power = space.predicted(_on(_arriving(), _printed()), last.place.window, series)
        moments = space.moments(power, *last.place.window.frequencies)
        off.append(space.moments_apart(last.moments[0][1:], moments[1:]))
    right = spread([space.moments_apart(*(m[1:] for m in s[5].moments)) for s in scanned])
    printed = spread(off)
    words = "6 further on: second moments over (y, w), across the plane of incidence, curvature"
    given = dict(unit="of the deviations", scanned=receiver.said(scanned))
    return [
        Statement(f"{words} shearing by k, differ", receiver.AGREE, printed[0],
                  alike(receiver.AGREE), "D05 §5.2", error=printed[1],
                  reason="A normal that leans across the plane of incidence turns the mirrored ray "
                  "by 2 k y cos(theta), not 2 k y: what is printed holds at normal incidence only.",
                  **given),
        Statement(f"{words} shearing by k cos, differ", None, right[0], alike(receiver.AGREE),
                  "D05 §5.2", error=right[1], **given),
        Measurement("... incidence from which the printed moments are a tenth off", _first_off(),
                    "degrees"),
    ]  # fmt: skip


def _first_off() -> float:
    """The least incidence, in degrees, at which the two predictions without blockers differ."""
    light = space.travelled(space.source(), space.FIRST + space.SECOND)
    window = space.Window(0.35, 0.3, 16, 1.0)
    angles, found = np.arange(0.0, 61.0, 5.0), []
    for a in np.deg2rad(angles):
        true, printed = (
            space.moments(space.predicted(_on(light, S, a), window), *window.frequencies)[1:]
            for S in (SHAPE, _printed(a))
        )
        found.append(space.moments_apart(true, printed))
    return float(np.interp(ALIKE, found, angles))


def _effects(scanned) -> list[Statement]:
    """What the paper's caption says, by rays."""
    behind = receiver.growth(scanned, 0, 2, 1)
    arrived = receiver.growth(scanned, 1, 3, 2)
    off = receiver.growth(scanned, 1, 4, 3)
    rows = (
        ("Blockers result in higher spatial frequency: root mean square, times", "higher",
         behind, more("higher"), "D05 Fig. 1"),
        ("Transport in free space transfers it to the angular domain: angular frequency, times",
         "transfers", arrived, more("transfers"), "D05 Fig. 1"),
        ("The glossy ball lets through less of the angular frequencies, times", "low-pass", off,
         less("low-pass"), "D05 §4.2"),
    )  # fmt: skip
    return [
        Statement(words, paper, mean, rule, source, "", error, receiver.said(scanned))
        for words, paper, (mean, error), rule, source in rows
    ]
