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

from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_most
from firstorder import plotting
from firstorder.flatland import Arcs, Circles, Scene, Segments, primitive
from firstorder.flatland.refraction import Beam, Caustic, PointSource, through_body, trace_path

INDEX = 1.5
NEAR = 0.12  # half of what is shown of the floor [m]
RAYS = 33  # that are drawn
RUNS = 20  # into which photons are split


def disc() -> Caustic:
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
    glass = primitive(Circles((0.0, 0.62), 0.5), name="glass", ior=INDEX)
    return Caustic(
        Scene.of(floor, glass), Beam((0.0, 1.9), np.pi), through_body(1), 0, -0.4999, 0.4999
    )


def lens() -> Caustic:
    radius, half, up = 0.6, 0.4, 0.75
    angle = np.arcsin(half / radius)
    drop = radius * np.cos(angle)
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
    top = primitive(Arcs((0.0, up - drop), radius, angle, -2.0 * angle), name="top", ior=INDEX)
    low = primitive(
        Arcs((0.0, up + drop), radius, np.pi + angle, -2.0 * angle), name="low", ior=INDEX
    )
    scene = Scene.of(floor, top, low)
    light = PointSource((0.0, up + 1.6))
    wide = 0.999 * np.arctan(half / 1.6)
    return Caustic(scene, light, through_body(1, 2), 0, np.pi - wide, np.pi + wide)


@eqx.filter_jit
def exact(lens: Caustic, s):
    """Irradiance along the floor, rays and places of the folds, and which of these are real."""
    return lens.irradiance(s), *lens.folds()


@eqx.filter_jit
def traced(lens: Caustic, q):
    """Where rays end."""
    return jax.vmap(lens.arrive)(q)


@eqx.filter_jit
def bends(lens: Caustic, q):
    """Where rays start, and where they go in and out: (3, n, 2)."""

    def until(k, q):
        return trace_path(lens.scene, lens.path[:k], *lens.light.ray(q)).position

    return jnp.stack([jax.vmap(lambda q, k=k: until(k, q))(q) for k in range(3)])


@eqx.filter_jit
def caustic(lens: Caustic, q):
    """Points of the caustic, and how far along the rays."""
    return jax.vmap(lens.envelope)(q)


def draw(quick: bool) -> Drawing:
    places, photons = (161, 40_000) if quick else (641, 1_000_000)
    figure, axes = plotting.panels(2, 2, 4.2, 3.0)
    arrays, claims = {}, []
    rng = np.random.default_rng(3)
    for column, (name, made) in enumerate((("disc", disc()), ("lens", lens()))):
        x = np.sort(np.append(np.linspace(-0.6, 0.6, places), np.linspace(-NEAR, NEAR, places)))
        bins = np.linspace(-0.6, 0.6, 61)
        narrow = np.linspace(-NEAR, NEAR, 31 if quick else 193)  # finer than the caustic, to see it
        inner = bins[:-1, None] + (bins[1] - bins[0]) * (np.arange(8) + 0.5) / 8
        # At once: compiling it takes longer than all that it computes.
        both, turned, folds, real = map(
            np.asarray, exact(made, jnp.asarray(0.5 * np.append(x, inner) + 0.5))
        )
        folds = 2.0 * folds[real] - 1.0
        E, mean = both[: len(x)], both[len(x) :].reshape(inner.shape).mean(1)
        q = np.append(np.linspace(made.low, made.high, 401), turned)
        edge, t = map(np.asarray, caustic(made, jnp.asarray(q)))
        edge, t, at_folds = edge[:401], t[:401], edge[401:]
        fan = np.linspace(made.low, made.high, RAYS)
        thrown = np.append(fan, rng.uniform(made.low, made.high, photons))
        ends = jax.tree.map(np.asarray, traced(made, jnp.asarray(thrown)))
        shot = jax.tree.map(lambda a: a[RAYS:], ends)
        share = np.where(shot.ok, shot.share, 0.0)
        counts, _ = np.histogram(2.0 * shot.s - 1.0, bins, weights=share)
        scale = (made.high - made.low) / photons / (bins[1] - bins[0])
        counted = scale * counts
        fine, _ = np.histogram(2.0 * shot.s - 1.0, narrow, weights=share)
        fine = fine * (made.high - made.low) / photons / (narrow[1] - narrow[0])
        lines = np.append(bends(made, jnp.asarray(fan)), ends.position[None, :RAYS], axis=0)
        runs = _runs(2.0 * shot.s - 1.0, share, bins, made.high - made.low)
        _draw_rays(axes[0, column], made, f"{'ab'[column]}) {name}", lines, edge, t)
        _draw_light(axes[1, column], x, E, folds, narrow, fine, "cd"[column])
        claims += _claims(name, folds, at_folds, bins, mean, runs, RUNS * scale)
        arrays |= {f"{name}_x": x, f"{name}_E": E, f"{name}_folds": folds,
                   f"{name}_counted": counted, f"{name}_narrow": fine,
                   f"{name}_caustic": edge}  # fmt: skip
    return Drawing(figure, arrays, claims, size=f"{places} receivers, {photons} photons", seed=3)


def _draw_rays(ax, made: Caustic, title, lines, edge, t):
    plotting.draw_scene(ax, made.scene, normals=False, receivers=("floor",))
    ax.plot(*lines.transpose(2, 0, 1), color="#c2410c", linestyle="-", linewidth=0.4)
    shown = (t > 0.0) & (edge[:, 1] > -0.05) & (np.abs(edge[:, 0]) < 0.8)
    ax.plot(*edge[shown].T, ".", color="#2563eb", markersize=1.8, linestyle="none")
    ax.set_xlim(-1.05, 1.05)
    ax.set_ylim(-0.1, 2.0)
    ax.set_title(title + ": rays, caustic (blue)", loc="left")


def _draw_light(ax, x, E, folds, bins, counted, letter):
    ax.stairs(counted, bins, color="0.6", fill=True, alpha=0.5, label="photons")
    ax.plot(x, E, color="#b91c1c", linestyle="-", linewidth=1.1, label="exact")
    for fold in folds:
        ax.axvline(fold, color="#2563eb", linestyle=":", linewidth=0.8)
    ax.set_xlim(-NEAR, NEAR)
    ax.set_ylim(0.0, 4.0 * np.interp(0.0, x, E))
    ax.set_title(f"{letter}) irradiance of the floor (W/m)", loc="left")
    ax.set_xlabel("$x$ (m)")
    ax.legend()


def _runs(place, share, bins, wide) -> np.ndarray:
    """Irradiance of the bins by the photons of each of twenty runs, and its deviation."""
    width, found = bins[1] - bins[0], []
    for x, w in zip(np.array_split(place, RUNS), np.array_split(share, RUNS), strict=True):
        counts, squares = (np.histogram(x, bins, weights=w**p)[0] for p in (1, 2))
        found.append(np.stack([counts, np.sqrt(squares)]) * wide / len(x) / width)
    return np.array(found)


def _claims(name, folds, at_folds, bins, mean, runs, one: float) -> list[Statement]:
    away = np.abs(0.5 * (bins[1:] + bins[:-1])[:, None] - folds).min(axis=1) > 1.5 * np.diff(bins)
    counted, sigma = np.moveaxis(runs, 1, 0)
    # Of all runs together: a run's own is small where by chance it has few photons. A bin that no
    # photon meets is judged as if one had.
    sigma = np.sqrt(np.mean(sigma**2, 0))
    sigma = np.where(sigma > 0.0, sigma, one)
    lit = away & ((mean > 0.0) | np.any(counted > 0.0, 0))
    z = np.sqrt(np.mean(((counted - mean) / sigma)[:, lit] ** 2, axis=1))
    gap = max(np.abs(at_folds - [fold, 0.0]).sum(axis=1).min() for fold in folds)
    return [
        Statement(f"{name}: photons per bin, in standard deviations from the exact irradiance, "
                  "root mean square", None, float(np.mean(z)),
                  at_most(1.4, "chance alone makes 1"), OURS,
                  error=float(np.std(z, ddof=1) / np.sqrt(RUNS)),
                  scanned=f"{RUNS} runs"),
        Statement(f"{name}: folds on the floor are points of the caustic, the envelope of the "
                  "rays: farthest off", None, gap,
                  at_most(1e-7, "rounding, where the envelope turns"), OURS, "m"),
    ]  # fmt: skip
