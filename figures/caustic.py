"""Caustics of a glass disc and of a lens: exact irradiance against counted photons.

Ours: index 1.5. A disc of radius 0.5 m over a floor, in parallel light of 1 W/m from above; a lens
of two arcs (radius 0.6 m, 0.8 m wide) in the light of a point of 1 W/rad, 1.6 m above it. The floor
lies where it cuts both branches of the caustic: the irradiance is infinite at two folds. Light that
is reflected inside (a few percent) takes other paths and is left out on both sides of the
comparison.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland import Arcs, Circles, Scene, Segments, thing
from firstorder.flatland.refraction import Beam, Lens, PointSource, follow, through

INDEX = 1.5


def disc() -> Lens:
    floor = thing(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
    glass = thing(Circles((0.0, 0.62), 0.5), name="glass", ior=INDEX)
    return Lens(Scene.of(floor, glass), Beam((0.0, 1.9), np.pi), through(1), 0, -0.4999, 0.4999)


def lens() -> Lens:
    radius, half, up = 0.6, 0.4, 0.75
    angle = np.arcsin(half / radius)
    drop = radius * np.cos(angle)
    floor = thing(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
    top = thing(Arcs((0.0, up - drop), radius, angle, -2.0 * angle), name="top", ior=INDEX)
    low = thing(Arcs((0.0, up + drop), radius, np.pi + angle, -2.0 * angle), name="low", ior=INDEX)
    scene = Scene.of(floor, top, low)
    light = PointSource((0.0, up + 1.6))
    wide = 0.999 * np.arctan(half / 1.6)
    return Lens(scene, light, through(1, 2), 0, np.pi - wide, np.pi + wide)


@eqx.filter_jit
def along_floor(lens: Lens, s):
    return lens.irradiance(s)


@eqx.filter_jit
def folds_of(lens: Lens):
    return lens.folds()


@eqx.filter_jit
def traced(lens: Lens, q):
    return jax.vmap(lens.arrive)(q)


@eqx.filter_jit
def caustic(lens: Lens, q):
    return jax.vmap(lens.envelope)(q)


def draw(quick: bool) -> Drawing:
    places, photons = (161, 40_000) if quick else (641, 1_000_000)
    figure, axes = plotting.panels(2, 2, 4.2, 3.0)
    arrays, claims = {}, []
    rng = np.random.default_rng(3)
    for column, (name, made) in enumerate((("disc", disc()), ("lens", lens()))):
        q = np.linspace(made.low, made.high, 401)
        edge, t = caustic(made, jnp.asarray(q))
        _, folds, real = folds_of(made)
        folds = 2.0 * np.asarray(folds)[np.asarray(real)] - 1.0
        x, bins = np.linspace(-0.6, 0.6, places), np.linspace(-0.6, 0.6, 61)
        inner = bins[:-1, None] + (bins[1] - bins[0]) * (np.arange(8) + 0.5) / 8
        # At once: compiling it takes longer than all that it computes.
        both = along_floor(made, jnp.asarray(0.5 * np.append(x, inner) + 0.5))
        E, mean = np.asarray(both[:places]), np.asarray(both[places:]).reshape(inner.shape).mean(1)
        shot = traced(made, jnp.asarray(rng.uniform(made.low, made.high, photons)))
        share = np.where(shot.ok, shot.share, 0.0)
        counts, _ = np.histogram(2.0 * np.asarray(shot.s) - 1.0, bins, weights=share)
        squares, _ = np.histogram(2.0 * np.asarray(shot.s) - 1.0, bins, weights=share**2)
        scale = (made.high - made.low) / photons / (bins[1] - bins[0])
        counted, sigma = scale * counts, scale * np.sqrt(squares)
        _draw_rays(
            axes[0, column], made, f"{'ab'[column]}) {name}", np.asarray(edge), np.asarray(t)
        )
        _draw_light(axes[1, column], x, E, folds, bins, counted, "cd"[column])
        claims += _claims(name, made, folds, bins, mean, counted, sigma)
        arrays |= {f"{name}_x": x, f"{name}_E": E, f"{name}_folds": folds,
                   f"{name}_counted": counted, f"{name}_caustic": np.asarray(edge)}  # fmt: skip
    return Drawing(figure, arrays, claims, size=f"{places} receivers, {photons} photons", seed=3)


def _draw_rays(ax, made: Lens, title, edge, t):
    plotting.draw_scene(ax, made.scene, normals=False, receivers=("floor",))
    for q in np.linspace(made.low, made.high, 33):
        points = [np.asarray(made.light.ray(jnp.asarray(q))[0])]
        for k in range(1, 3):
            points.append(np.asarray(_stop(made, k, q)))
        points.append(np.asarray(made.arrive(q).position))
        ax.plot(*np.stack(points).T, color="#c2410c", linestyle="-", linewidth=0.4)
    shown = (t > 0.0) & (edge[:, 1] > -0.05) & (np.abs(edge[:, 0]) < 0.8)
    ax.plot(*edge[shown].T, ".", color="#2563eb", markersize=1.8, linestyle="none")
    ax.set_xlim(-1.05, 1.05)
    ax.set_ylim(-0.1, 2.0)
    ax.set_title(title + ": rays, caustic (blue)", loc="left")


@eqx.filter_jit
def _stop(made: Lens, k: int, q):
    return follow(made.scene, made.path[:k], *made.light.ray(jnp.asarray(q))).position


def _draw_light(ax, x, E, folds, bins, counted, letter):
    ax.stairs(counted, bins, color="0.6", fill=True, alpha=0.5, label="photons")
    ax.plot(x, E, color="#b91c1c", linestyle="-", linewidth=1.1, label="exact")
    for fold in folds:
        ax.axvline(fold, color="#2563eb", linestyle=":", linewidth=0.8)
    ax.set_ylim(0.0, 1.6 * counted.max())
    ax.set_title(f"{letter}) irradiance of the floor (W/m)", loc="left")
    ax.set_xlabel("$x$ (m)")
    ax.legend()


def _claims(name, made, folds, bins, mean, counted, sigma) -> list[Claim]:
    away = np.abs(0.5 * (bins[1:] + bins[:-1])[:, None] - folds).min(axis=1) > 1.5 * np.diff(bins)
    lit = away & (counted > 0.0)
    z = (counted - mean)[lit] / sigma[lit]
    gaps = []
    for fold in folds:
        q = folds_of(made)[0]
        points = np.asarray(caustic(made, q)[0])
        gaps.append(np.abs(points - [fold, 0.0]).sum(axis=1).min())
    return [
        Claim(
            f"{name}: photons per bin, in standard deviations from the exact irradiance, rms",
            1.0,
            float(np.sqrt(np.mean(z**2))),
            "",
            bool(np.sqrt(np.mean(z**2)) < 1.4),
        ),
        Claim(
            f"{name}: folds on the floor are points of the caustic (envelope of the rays)",
            0.0,
            float(max(gaps, default=np.inf)) if gaps else "no fold",
            "m",
            bool(gaps) and max(gaps) < 1e-7,
        ),
    ]
