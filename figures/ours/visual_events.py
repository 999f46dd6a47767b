"""Visual events: E, E' and E'' under a finite light, and where derivatives jump.

Ours: a floor from -2 to 2 m, a lamp, a grey segment and a disc. Lines are critical lines that reach
the floor. Predicted jumps are closed forms of the two edges; measured ones are the exact
derivatives, by automatic differentiation, 1e-7 of the floor to either side. The last panel shows
what an error metric misses: the total error of a linear extrapolation to the right of x = 0.13 m,
as measured, as the pointwise Hessian predicts (J12 §6), and with the jumps added. The claims ask
records along the whole floor which of the two estimates is nearer to the truth past an event.
Neighbours on a floor answer alike, so that this is asked of lay-outs: plate and disc are moved by
up to 0.15 m along the floor and 0.1 m up or down, each on its own.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.checks.tolerance import normwise
from firstorder.flatland import Circles, Scene, Segments, irradiance, primitive, receiver
from firstorder.flatland.discontinuities.events import extrapolation_error, visual_events

RECORD, REACH, SEED = 0.13, 0.6, 0


def stage(plate=(0.0, 0.0), disc=(0.0, 0.0)) -> Scene:
    """The scene, its blockers moved [m]."""
    plate, disc = jnp.asarray(plate), jnp.asarray(disc)
    left, right, middle = jnp.array([(-0.35, 0.55), (0.05, 0.6), (0.55, 0.62)])
    return Scene.of(
        primitive(Segments((-2.0, 0.0), (2.0, 0.0)), name="floor"),
        primitive(Segments((0.7, 1.1), (-0.2, 1.3)), name="lamp", emission=1.0),
        primitive(Segments(left + plate, right + plate), name="plate", emission=(0.3, 0.0)),
        primitive(Circles(middle + disc, 0.13), name="disc", emission=0.2),
    )


def jets(scene: Scene, x) -> np.ndarray:
    """E, E' and E'' on the floor, shape (3, n)."""
    return np.asarray(_jets(scene, jnp.asarray(x))).T


@eqx.filter_jit
def _jets(scene: Scene, x):

    def E(x):
        return irradiance(scene, receiver(scene, 0, 0.25 * x + 0.5))

    def first(x):
        return jax.jvp(E, (x,), (jnp.ones_like(x),))

    def both(x):
        (value, slope), (_, bend) = jax.jvp(first, (x,), (jnp.ones_like(x),))
        return jnp.stack([value, slope, bend])

    return jax.vmap(both)(x)


def events_on(scene: Scene):
    """Events at which E' jumps on the floor, and where they are."""
    table = visual_events(scene)
    table = table.take((table.receiver == 0) & table.front & (table.jump_E1 != 0.0))
    return table, 4.0 * table.s - 2.0


def draw(quick: bool) -> Drawing:
    scene = stage()
    table, at = events_on(scene)
    # Not at round numbers: on an event a derivative is a one-sided one, or their sum.
    x = np.linspace(-1.9791, 1.9803, 397 if quick else 1585)
    reach = np.linspace(0.02, REACH, 59)
    shift = 4e-7
    all_ = jets(scene, np.concatenate([x, at + shift, at - shift, [RECORD]]))
    curve, above, below, record = np.split(all_, np.cumsum([len(x), len(at), len(at)]), axis=1)
    measured = above[1] - below[1]
    errors = _errors(x, curve[0], RECORD, record[:, 0], at, table.jump_E1, reach)
    count, places = (3, 6) if quick else (40, 41)
    better = _over_layouts(count, x, np.linspace(-1.3713, 1.1717, places), reach)
    figure, axes = plotting.panels(2, 3, 3.6, 2.7)
    _draw(axes, scene, table, at, x, curve, measured, reach, errors)
    arrays = {"x": x, "jets": curve, "at": at, "predicted": table.jump_E1, "measured": measured}
    error = normwise(measured, table.jump_E1)
    true, plain, aware = errors
    claims = _claims(error, errors, better, f"{count} lay-outs of {places} records", reach)
    return Drawing(
        figure, arrays, claims, {"error": {"reach": reach, "true": true, "hessian": plain,
        "with_jumps": aware}}, f"{len(x)} receivers, {len(at)} events, {count} lay-outs", SEED,
    )  # fmt: skip


def _claims(error, errors, better, scanned: str, reach) -> list[Statement | Measurement]:
    true, plain, aware = errors
    far = reach > 0.25  # the first event is 0.13 m away
    off = [np.max(np.abs(np.log(e[far] / true[far]))) for e in (plain, aware)]
    words = "share of records, past an event, whose total error the jumps bring nearer to the truth"
    return [
        Statement("Predicted jumps of E' against measured ones: largest difference", None, error,
                  at_most(1e-4, "the events are met 4e-7 m to either side"), OURS, "normwise"),
        Statement(f"A pointwise Hessian does not know of visual events: {words}", None,
                  float(np.mean(better)), at_least(0.5, "most"), OURS,
                  error=float(np.std(better, ddof=1) / np.sqrt(len(better))),
                  scanned=scanned),
        Measurement("Record of the last panel: the Hessian alone is off by at most",
                    float(np.exp(off[0])), "times"),
        Measurement("... with the jumps", float(np.exp(off[1])), "times"),
    ]  # fmt: skip


def _over_layouts(count: int, x, places, reach) -> np.ndarray:
    """By lay-out: the share of records whose estimate the jumps bring nearer."""
    moves = np.random.default_rng(SEED).uniform(-1.0, 1.0, (count, 2, 2)) * (0.15, 0.1)
    shares = []
    for plate, disc in moves:
        scene = stage(plate, disc)
        table, at = events_on(scene)
        curve, records = np.split(jets(scene, np.append(x, places)), [len(x)], axis=1)
        scanned = [
            (r, _errors(x, curve[0], r, record, at, table.jump_E1, reach))
            for r, record in zip(places, records.T, strict=True)
        ]
        shares.append(np.mean(_nearer(scanned, at, reach)))
    return np.array(shares)


def _nearer(scanned, at, reach) -> np.ndarray:
    """For each record with events within reach: whether jumps bring the estimate nearer there."""
    found = []
    for place, (true, plain, aware) in scanned:
        events = at[(at > place) & (at < place + 0.5 * REACH)]
        if len(events):
            past = reach > events.min() - place
            miss = [np.sum(np.abs(np.log(e[past] / true[past]))) for e in (plain, aware)]
            found.append(miss[1] < miss[0])
    return np.array(found, float)


def _errors(x, E, place, record, at, jumps, reach):
    """Total error to the right of the record within each reach: true, by Hessian, with jumps."""
    d = x[x > place] - place
    gap = np.abs(E[x > place] - (record[0] + record[1] * d))
    d, gap = np.append(0.0, d), np.append(0.0, gap)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (gap[1:] + gap[:-1]) * np.diff(d))])
    true = np.interp(reach, d, total)
    plain = np.abs(record[2]) * reach**3 / 6.0
    extra = [
        np.asarray(extrapolation_error(0.0, j, a - place, reach))
        for a, j in zip(at, jumps, strict=True)
        if a > place
    ]
    return true, plain, plain + np.sum(extra, axis=0)


def _draw(axes, scene, table, at, x, curve, measured, reach, errors):
    stage_axes = axes[0, 0]
    plotting.draw_scene(stage_axes, scene, normals=False, receivers=("floor",))
    for a, far in zip(at, table.far.point, strict=True):
        stage_axes.plot([a, far[0]], [0.0, far[1]], color="0.6", linestyle="-", linewidth=0.6)
    stage_axes.set_title("a) critical lines", loc="left")
    words = ("b) $E$ (W/m)", "c) $E'$ (W/m$^2$)", "d) $E''$ (W/m$^3$)")
    places = (axes[0, 1], axes[0, 2], axes[1, 0])
    for ax, row, title, color in zip(
        places, curve, words, ("#b91c1c", "#15803d", "#1d4ed8"), strict=True
    ):
        for a in at:
            ax.axvline(a, color="0.8", linewidth=0.6, linestyle="-")
        ax.plot(x, row, color=color, linestyle="-", linewidth=1.1)
        ax.set_title(title, loc="left")
        ax.set_xlabel("$x$ (m)")
    top = 1.15 * np.quantile(np.abs(curve[2]), 0.995)
    axes[1, 0].set_ylim(-top, top)
    ax = axes[1, 1]
    most = 1.1 * np.abs(measured).max()
    ax.plot([-most, most], [-most, most], color="0.7", linestyle="-", linewidth=0.8)
    ax.plot(table.jump_E1, measured, "o", color="#c2410c", markersize=4, linestyle="none")
    ax.set_title("e) jumps of $E'$ (W/m$^2$)", loc="left")
    ax.set_xlabel("predicted")
    ax.set_ylabel("measured")
    ax = axes[1, 2]
    for values, name in zip(errors, ("true", "Hessian alone", "with jumps"), strict=True):
        ax.loglog(reach, values, label=name)
    ax.legend()
    ax.set_ylim(1e-6, 1.0)
    ax.xaxis.set_minor_formatter("")
    ax.set_title("f) total error of a record", loc="left")
    ax.set_xlabel("radius (m)")
