"""Every sampled form of J12 §5 against the exact value, on every scene of the paper.

Scenes A-D, Figs. 14 and 15 as in `firstorder.flatland.library._scenes`. In A and B the lamp alone
shines; elsewhere surfaces send what they emit and what they reflect once of the light (point lights
themselves do not count, as rays cannot meet them; in Fig. 15 the block throws no shadow on what is
reflected, so that the radiance is smooth along each wall).
Receivers lie on the floor, clear of visual events. Errors are RMS over random keys, relative to the
larger of the derivative and E.

What stops falling: the arc-length form wherever a shadow edge moves (B, D, Fig. 15), at its own
integral (dotted); and the stratified Hessian where the edge is a curved limb or uncovers a
background that varies (D, Fig. 15), at the sum over edges as fixed points (dashed). That is why the
claim about scene D does not hold. The stratified form with both terms put back
(`corrected_estimate`) goes on falling; it is followed to 10^4 strata, and where flat lights of one
radiance are all there is (A, B) it is exact. The gradient by strata falls on every scene: its bias
vanishes with the width.

Quick size: scene D up to 10^4 strata, without the form by points on curves.
"""

from __future__ import annotations

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.checks.tolerance import fitted_order
from firstorder.flatland import Derivatives, Receiver, irradiance, nearest, occluded, view
from firstorder.flatland.estimators._irradiance_forms import (
    arc_length_estimate,
    arc_length_sum,
    stratified_estimate,
)
from firstorder.flatland.estimators.corrected import corrected_estimate
from firstorder.flatland.estimators.strata import (
    Strata,
    gap_quadrature,
    hemicircle_strata,
    trace_strata,
)
from firstorder.flatland.library import _scenes as scenes
from firstorder.numerics._batching import host_blocks
from firstorder.scene._primitives import BACK, FRONT

PLACES = {"A": 0.35, "B": 0.35, "C": 0.3, "D": 0.31, "14": 0.5, "15": 0.23}
CHUNK, MENDED_MOST, SEED = 10_000, 10_000, 5
FORMS = ("arc length", "on curves", "strata", "mended")


@functools.cache
def scene(name):
    make = {"14": scenes.fig14, "15": scenes.fig15}
    return make[name]() if name in make else getattr(scenes, f"scene_{name.lower()}")()


@functools.cache
def radiance(name):
    """What surfaces send: emission, and one bounce of direct light; None for emission alone."""
    if name in "AB":
        return None
    here = scene(name)
    direct = _points(here) if name in "CD" else _lamp(here)

    def sent(index, s, front, along):
        side = jnp.where(front, FRONT, BACK)
        L = here.material.emission[index, side]
        return L + 0.5 * here.material.albedo[index, side] * direct(index, s)

    return sent


def _points(here):
    """Irradiance of fronts by the point light, in closed form."""
    position, intensity = here.points.position[0], here.points.intensity[0]

    def direct(index, s):
        frame = here.frame(index, s)
        way = position - frame.position
        up = way @ frame.normal
        dark = occluded(here, frame.position[None], position[None], index)[0]
        return jnp.where((up > 0.0) & ~dark, intensity * up / (way @ way), 0.0)

    return direct


def _lamp(here):
    """Irradiance of fronts by the line light alone, in closed form: no shadows, no kinks."""
    (lamp,) = here.named("lamp")
    ends = [here.motion(jnp.array(lamp), jnp.array(s))[0] for s in (0.0, 1.0)]

    def direct(index, s):
        frame = here.frame(index, s)
        ways = [end - frame.position for end in ends]
        sees = (ways[0] @ frame.normal > 1e-9) & (ways[1] @ frame.normal > 1e-9)
        safe = [jnp.where(sees, w, frame.normal) for w in ways]
        sines = [w @ frame.tangent / jnp.sqrt(w @ w) for w in safe]
        return jnp.where(sees, jnp.abs(sines[0] - sines[1]), 0.0)

    return direct


def receiver(name) -> Receiver:
    (floor,) = scene(name).named("floor")
    return Receiver((PLACES[name], 0.0), 0.0, floor)


def shadows(name):
    """Where the light itself breaks: at the ends of the point light's shadows."""
    if name != "D":
        return None
    here = scene(name)
    light = here.points.position[0]

    @jax.jit
    def thrown():
        points, valid = here.silhouettes(light)
        ways = (points - light) / jnp.linalg.norm(points - light, axis=1)[:, None]
        turn = 1e-9 * jnp.stack([-ways[:, 1], ways[:, 0]], -1)
        both = jnp.concatenate([ways - turn, ways + turn])
        hits = nearest(here, jnp.broadcast_to(light, both.shape), both)
        return points, valid, light + hits.t[:, None] * both

    points, valid, met = thrown()
    keep = np.asarray(valid)
    return jnp.concatenate([points[keep], met[np.tile(keep, 2)]])


@functools.cache
def truth(name):
    """E, E' and E'' by differences of fourth order of the exact irradiance."""
    at, cuts, sent = receiver(name), shadows(name), radiance(name)  # made outside of any trace
    here = _without_points(name)
    step = 2e-3

    def E(x):
        moved = Receiver(at.position + jnp.stack([x, 0.0 * x]), at.n, at.on)
        return irradiance(here, moved, radiance=sent, nodes=24, cuts=cuts)

    f = np.asarray(jax.jit(jax.vmap(E))(step * jnp.arange(-3.0, 4.0)))
    first = f @ np.array([-1, 9, -45, 0, 45, -9, 1]) / (60 * step)
    second = f @ np.array([2, -27, 270, -490, 270, -27, 2]) / (180 * step**2)
    return f[3], first, second


def _without_points(name):
    here = scene(name)
    if not here.points.intensity.shape[0]:
        return here
    return eqx.tree_at(lambda s: s.points.intensity, here, 0.0 * here.points.intensity)


@functools.cache
def _look(name):
    return jax.jit(
        lambda angles: trace_strata(
            scene(name),
            receiver(name),
            where=Strata(jnp.pad(angles, (0, 1)), angles, jnp.ones_like(angles)),
            radiance=radiance(name),
        )
    )


def samples(name, where: Strata):
    """Rays into all strata, a chunk at a time, so that each scene is compiled once."""
    whole = host_blocks(
        lambda angles: eqx.tree_at(lambda s: s.strata, _look(name)(angles), None),
        where.angles,
        CHUNK,
    )
    return eqx.tree_at(lambda s: s.strata, whole, where, is_leaf=lambda a: a is None)


@functools.cache
def _mended(name):
    return jax.jit(
        lambda seen, sliding: corrected_estimate(
            scene(name),
            receiver(name),
            samples=seen,
            radiance=radiance(name),
            breaks=24,
            sliding=sliding,
        )
    )


_forms = {"arc length": jax.jit(arc_length_estimate), "strata": jax.jit(stratified_estimate)}


def padded(where: Strata) -> Strata:
    """The same strata as `MENDED_MOST`: a sample beside its own copy makes no difference."""
    copies = MENDED_MOST // where.angles.shape[0]
    inner = jnp.repeat(where.borders[1:], copies)
    borders = jnp.concatenate([where.borders[:1], inner])
    return Strata(
        borders, jnp.repeat(where.angles, copies), jnp.repeat(where.weights, copies) / copies
    )


@functools.cache
def _at_points(name):
    return jax.jit(
        lambda s, w: arc_length_sum(
            scene(name), receiver(name), s=s, weights=w, radiance=radiance(name)
        )
    )


def on_curves(name, n: int, seed: int) -> Derivatives:
    """The arc-length form by strata of arc length, n points on all shapes; summed by chunks."""
    shapes, each = scene(name).count, max(1, n // scene(name).count)
    s = (np.arange(each) + np.random.default_rng(seed).random((shapes, each))) / each
    chunk = CHUNK // 4
    width = -each % chunk
    s = np.pad(s, ((0, 0), (0, width)), constant_values=0.5)
    w = np.pad(np.full((shapes, each), 1.0 / each), ((0, 0), (0, width)))
    parts = [
        _at_points(name)(s[:, k : k + chunk], w[:, k : k + chunk])
        for k in range(0, s.shape[1], chunk)
    ]
    return jax.tree.map(lambda *a: sum(np.asarray(x) for x in a), *parts)


def measure(name, sizes, keys: int, curves: bool):
    """RMS errors of E' and E'' by form and size, and the errors of the two limits."""
    E, *right = truth(name)
    scale = [max(abs(r), abs(E)) for r in right]

    def error(motion):
        d = motion.translation()
        found = (float(d.first), float(d.second))
        return [(f - r) / s for f, r, s in zip(found, right, scale, strict=True)]

    found: dict[str, list] = {form: [] for form in FORMS}
    for n in map(int, sizes):
        runs: dict[str, list] = {form: [] for form in FORMS}
        for k in range(keys if n <= MENDED_MOST else 1):
            where = hemicircle_strata(n, jax.random.fold_in(jax.random.key(SEED), k))
            few = n <= MENDED_MOST
            seen = samples(name, padded(where) if few else where)
            runs["arc length"].append(error(_arc(seen)))
            runs["strata"].append(error(_strata(seen)))
            if curves:
                runs["on curves"].append(error(on_curves(name, n, k)))
            if few:
                runs["mended"].append(error(_mended(name)(seen, True)))
        for form, r in runs.items():
            if r:
                found[form].append(np.sqrt(np.mean(np.square(r), 0)))
    fixed = _mended(name)(samples(name, padded(hemicircle_strata(MENDED_MOST))), False)
    ends = jax.jit(lambda: view(scene(name), receiver(name)).angles)()
    frozen = _arc(samples(name, gap_quadrature(ends, 24)))  # as `arc_length_exact` does
    limits = {"arc length": np.abs(error(frozen)), "strata": np.abs(error(fixed))}
    return {form: np.array(v) for form, v in found.items() if v}, limits


_arc, _strata = jax.jit(arc_length_estimate), jax.jit(stratified_estimate)


# --- the figure ----------------------------------------------------------------------------------


def draw(quick: bool) -> Drawing:
    names = ("D",) if quick else tuple(PLACES)
    sizes = np.array([100, 1000, 10_000] if quick else [100, 1000, 10_000, 100_000, 1_000_000])
    keys = 2 if quick else 4
    found = {name: measure(name, sizes, keys, not quick) for name in names}
    figure, axes = plotting.panels(2, len(names), 3.6 if quick else 2.4, 2.3)
    arrays = {"strata": sizes}
    for c, name in enumerate(names):
        errors, limits = found[name]
        for order, ax in enumerate(axes[:, c]):
            _panel(ax, sizes, errors, limits, order)
            title = f"Fig. {name}" if name.isdigit() else f"scene {name}"
            ax.set_title(f"{title}, E{(order + 1) * chr(39)}", loc="left")
        for form, e in errors.items():
            arrays[f"{name} {form}"] = e
        arrays |= {f"{name} limit of {form}": e for form, e in limits.items()}
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    plotting.share_labels(axes)
    size = f"{len(names)} scenes, {sizes[0]} to {sizes[-1]} strata, {keys} keys"
    return Drawing(figure, arrays, _claims(sizes, found), size=size, seed=SEED)


def _panel(ax, sizes, errors, limits, order: int):
    for form, e in errors.items():
        ax.loglog(sizes[: len(e)], np.maximum(e[:, order], 1e-16), marker=".", label=form)
    # The gradient by strata has no limit of its own.
    for form, style in (("arc length", ":"), ("strata", "--"))[: order + 1]:
        if limits[form][order] > 1e-3:
            ax.axhline(limits[form][order], color="0.5", ls=style, lw=0.9)
    ax.set(xlabel="strata", ylabel="relative error", ylim=(1e-12, 50.0))


def _claims(sizes, found) -> list[Claim]:
    def order_of(name, form, k):
        e = found[name][0][form]
        return fitted_order(sizes[: len(e)], np.maximum(e[:, k], 1e-12))

    def last(name, form, k):
        return float(found[name][0][form][-1, k])

    slowest = order_of("D", "strata", 0)
    level = [float(found["D"][1]["strata"][1]), last("D", "strata", 1)]
    mended = max(order_of("D", "mended", k) for k in (0, 1))
    frozen = float(found["D"][1]["arc length"][0])
    return [
        Claim(
            "Scene D: order of the error of the gradient by strata (curved limbs)",
            "tracks the truth",
            slowest,
            "order in the number of strata",
            slowest < -0.3,
        ),
        Claim(
            "Scene D: the stratified Hessian tends to the truth",
            "accounts for occlusions",
            level[1],
            "relative error at most strata",
            level[1] < 0.02,
        ),
        Claim(
            "Scene D: limit of the stratified Hessian, derived (fixed edges)",
            None,
            level[0],
            "relative error",
            None,
        ),
        Claim(
            "Scene D: slowest order of the mended form beside it, gradient and Hessian",
            None,
            mended,
            "order in the number of strata",
            mended < -0.7,
        ),
        Claim(
            "Scene D: limit of the arc-length gradient, its own integral",
            "ignores occlusion changes",
            frozen,
            "relative error",
            frozen > 0.1,
        ),
    ]
