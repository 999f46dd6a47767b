"""The numbers of every picture, as dictionaries that `pictures.js` draws.

A panel is a function of what was prepared for a board.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from firstorder.caching import (
    Cache,
    Candidates,
    circular_regions,
    fill,
    radius_for,
    random_orders,
)
from firstorder.conventions import direction

from . import paths, programs
from .asked import EMPTY, Asked
from .board import Board
from .handles import handles, probe_frame

CELLS, FINER = 32, 15  # of a gap whose light varies; of a cell in which it jumps
DECADES = 4.0  # of the spectrum
FAR = 3.0  # where a ray that meets nothing ends, in widths of the window
REACH = 0.02, 0.25  # shortest and longest reach of a record, in lengths of the receiver
RECORDS = 64  # a cache holds so many rows; those too far away to answer fill it up
SIGNIFICANT = 6


# --- the scene -----------------------------------------------------------------------------------


def scene_panel(board: Board) -> dict[str, Any]:
    """Outlines, handles and the probe; nothing of it is compiled."""
    parts = [
        {
            "kind": part.kind,
            "name": part.name,
            "line": listed(part.outline()),
            "body": part.kind in ("circle", "ellipse", "curve"),
            "shines": part.shines,
            "reflects": part.reflects,
            "receives": k == board.receiver,
        }
        for k, part in enumerate(board.parts)
    ]
    place, n = probe_frame(board)
    return {
        "parts": parts,
        "handles": {name: listed(p) for name, p in handles(board).items()},
        "window": list(board.window),
        "probe": {"place": listed(place), "n": float(n), "tilt": board.tilt},
        "tolerance": board.tolerance,
    }


# --- what the probe sees -------------------------------------------------------------------------


def view_panel(asked: Asked) -> dict[str, Any]:
    """The gaps between edges that the probe sees, as fans of rays."""
    board = asked.board
    seen = asked.looked(np.array([board.probe]), board.tilt)
    a, b = seen["angles"][0, :-1], seen["angles"][0, 1:]
    there = np.flatnonzero(b - a > EMPTY)
    share = np.array([1e-6, 0.25, 0.5, 0.75, 1.0 - 1e-6])
    theta = a[there, None] + (b - a)[there, None] * share
    along = direction(seen["n"][0] + theta).reshape(-1, 2)
    origins = np.broadcast_to(seen["place"][0], along.shape)
    t = asked.traced(origins, along, np.full(len(along), board.receiver))["t"]
    far = FAR * (board.window[1] - board.window[0])
    ends = origins + np.minimum(t, far)[:, None] * along
    gaps = [
        {
            "from": rounded(a[k]),
            "to": rounded(b[k]),
            "seen": int(seen["seen"][0, k]),
            "L": rounded(seen["L"][0, k]),
            "ends": listed(points),
        }
        for k, points in zip(there, ends.reshape(len(there), -1, 2), strict=True)
    ]
    return {"gaps": [] if seen["inside"][0] else gaps, "inside": bool(seen["inside"][0])}


# --- E, E', E'' ----------------------------------------------------------------------------------


def curve_panel(asked: Asked) -> dict[str, Any]:
    """E and its derivatives along the receiver, with both sides of every jump.

    Returns:
        `x`, `E`, `E1`, `E2`, null within bodies; `jump`, true for a row after which the view
        changes: what is on its two sides is not to be joined; `probe`: the same at the probe, by
        its own tilted tangent.
    """
    found, part = asked.lit, asked.receiver
    return {
        "x": listed(part.arc_length(found.s)),
        **{key: listed(found.E[:, k]) for k, key in enumerate(("E", "E1", "E2"))},
        "jump": found.jump.tolist(),
        "length": float(part.arc_length(np.array(1.0))),
        "probe": {
            "x": float(part.arc_length(np.array(asked.board.probe))),
            "values": listed(found.probe),
        },
    }


# --- the light field -----------------------------------------------------------------------------


def field_panel(asked: Asked) -> dict[str, Any]:
    """The light field along the receiver: strips between edges of one column each.

    Edges of shapes are exact. What a mirror shows, and a sky, is asked for by rays: `CELLS` in each
    gap, and `FINER` more where it jumps between two of them.

    Returns:
        `strips`: rows (column, from, to, shape, L), with shape -1 for nothing; `inside`: columns
        within bodies; `mirrored`: places and the irradiance of the mirrors' strips.
    """
    board, seen = asked.board, asked.steps
    i, k = np.nonzero((np.diff(seen["angles"], axis=1) > EMPTY) & ~seen["inside"][:, None])
    numbers = seen["seen"][i, k]
    low, high = seen["angles"][i, k], seen["angles"][i, k + 1]
    mirrors = np.array([part.reflects for part in board.shapes] + [board.environment is not None])
    varies = mirrors[numbers]  # -1 is the last: the sky
    strips = np.stack([i, low, high, numbers, seen["L"][i, k]], -1)
    part = asked.receiver
    found = {"length": float(part.arc_length(np.array(1.0))), "steps": asked.count}
    E = np.zeros(asked.count)
    if varies.any():
        finer = _varying(asked, strips[varies])
        strips = np.concatenate([strips[~varies], finer])
        by_mirror = finer[finer[:, 3] >= 0]
        each = by_mirror[:, 4] * (np.sin(by_mirror[:, 2]) - np.sin(by_mirror[:, 1]))
        E = np.bincount(by_mirror[:, 0].astype(int), weights=each, minlength=asked.count)
    E[seen["inside"]] = np.nan
    x = part.arc_length(asked.grid)
    some = any(part.reflects for part in board.shapes)
    return found | {
        "strips": listed(strips),
        "inside": np.flatnonzero(seen["inside"]).tolist(),
        "mirrored": {"x": listed(x), "E": listed(E)} if some else {"x": [], "E": []},
    }


def _varying(asked: Asked, strips: Float[np.ndarray, "m 5"]) -> Float[np.ndarray, "f 5"]:
    """Strips of sky or mirror, cut into cells and where what the mirror shows changes."""
    columns = strips[:, 0].astype(int)

    def sent(row, theta):
        """Radiance along rays of strips, and what jumps where it does."""
        at, origins = asked.steps["n"][columns[row]], asked.steps["place"][columns[row]]
        return _bounced(asked, origins, direction(at + theta))

    width = (strips[:, 2] - strips[:, 1])[:, None]
    ends = strips[:, 1:2] + width * np.arange(CELLS + 1) / CELLS
    middle = 0.5 * (ends[:, 1:] + ends[:, :-1])
    row = np.repeat(np.arange(len(strips)), CELLS)
    L, source = (a.reshape(len(strips), CELLS) for a in sent(row, middle.ravel()))
    # Between the middles of two cells that differ the edge is looked for.
    r, c = np.nonzero(source[:, 1:] != source[:, :-1])
    if len(r):
        share = np.arange(1, FINER + 1) / (FINER + 1)
        inner = middle[r, c][:, None] + width[r] / CELLS * share
        _, other = sent(np.repeat(r, FINER), inner.ravel())
        past = other.reshape(inner.shape) != source[r, c][:, None]
        first = np.where(past.any(1), np.argmax(past, 1), FINER)
        ends[r, c + 1] = middle[r, c] + (first + 0.5) / (FINER + 1) * width[r, 0] / CELLS
    columns = np.repeat(strips[:, 0], CELLS)
    cells = [columns, ends[:, :-1].ravel(), ends[:, 1:].ravel(), strips[row, 3], L.ravel()]
    # Neighbours alike are one strip.
    cells = np.stack(cells, -1)
    alike = (cells[1:, 4] == cells[:-1, 4]) & (row[1:] == row[:-1])
    starts = np.flatnonzero(np.append(True, ~alike))
    merged = cells[starts]
    merged[:, 2] = cells[np.append(starts[1:], len(cells)) - 1, 2]
    return merged


def _bounced(asked: Asked, origins: np.ndarray, along: np.ndarray):
    """Radiance of the sky or by way of one mirror, and what jumps where it does: -1 for any sky."""
    first = asked.traced(origins, along, np.full(len(along), asked.board.receiver))
    met = first["mirror"] > 0.0
    start = origins + np.where(met, first["t"], 0.0)[:, None] * along
    normal = np.where(met[:, None], first["normal"], 0.0)
    turned = along - 2.0 * np.sum(along * normal, -1, keepdims=True) * normal
    second = asked.traced(start, turned, np.where(met, first["hit"], -1))
    L = np.where(met, first["mirror"] * second["L"], np.where(first["hit"] < 0, first["L"], 0.0))
    sky = (np.where(met, second["hit"], -1) < 0) & (asked.board.environment is not None)
    return L, np.where(sky, -1.0, L)


# --- the shadow's spectrum -----------------------------------------------------------------------


def spectrum_panel(asked: Asked) -> dict[str, Any]:
    """The power spectrum of the shadow light field of the first lamp, and the blockers' wedge."""
    board = asked.board
    lamps = [k for k, p in enumerate(board.shapes) if p.shines and k != board.receiver]
    if not lamps:
        return {"words": "There is no lamp with a length."}
    found = {
        name: np.asarray(a)
        for name, a in programs.shadow(asked.world, asked.index, jnp.asarray(lamps[0])).items()
    }
    if found["d1"] <= 0.0:
        return {"words": "The lamp is behind the receiver."}
    amplitude = np.sqrt(found["energy"])
    top = float(amplitude.max()) or 1.0
    shade = 1.0 + np.log10(np.maximum(amplitude / top, 10.0**-DECADES)) / DECADES
    wedge = bool(np.isfinite(found["d2_min"]))
    return {
        "cells": listed(shade),
        "Omega": listed(found["Omega"] / found["width"]),
        "decades": DECADES,
        "d1": rounded(found["d1"]),
        "depths": listed([found["d2_min"], found["d2_max"]]) if wedge else None,
        "slopes": listed(found["slopes"]) if wedge else None,
        "outside": rounded(found["outside"]) if wedge else None,
    }


# --- the cache -----------------------------------------------------------------------------------


def record_panel(asked: Asked) -> dict[str, Any]:
    """Records that a cache would keep along the receiver, and what it answers.

    Radii from E'' for the largest error within reach, `tolerance` of the largest E; candidates are
    visited in one random order. Of E' jumps the records know nothing, as J12's do not.
    """
    grid, length = (asked.receiver.arc_length(s) for s in (asked.grid, np.array(1.0)))
    E = asked.lit.E[asked.lit.on_grid].T
    known = np.all(np.isfinite(E), 0)
    top = float(np.max(np.abs(E[0][known]), initial=0.0))
    if top == 0.0:
        return {"words": "No light arrives: there is nothing to keep."}
    E = np.where(known, E, 0.0)
    # One size of cache for any number of records: another size would be another program.
    spare = 1e3 * length * np.arange(1, RECORDS + 1)
    table = Candidates.on_line(np.append(grid, spare), np.pad(E.T, ((0, RECORDS), (0, 0))))
    E2 = np.asarray(table.hessian).ravel()
    radius = radius_for(E2, asked.board.tolerance * top, definition="largest")
    region = circular_regions(radius, REACH[0] * length, REACH[1] * length)
    visits = random_orders(asked.count, 1)[0]
    chosen = fill(table, region, visits[known[visits]], RECORDS)
    rows = np.flatnonzero(chosen)
    chosen[asked.count : asked.count + RECORDS - len(rows)] = True
    cache = Cache.of(table, region, chosen)
    answer = np.asarray(cache(grid[:, None]).value)
    error = np.where(known, answer - E[0], np.nan)
    return {
        "x": listed(grid[rows]),
        "E": listed(E[0, rows]),
        "reach": listed(np.asarray(region.radius)[rows]),
        "grid": listed(grid),
        "answer": listed(np.where(known, answer, np.nan)),
        "rms": rounded(np.sqrt(np.nanmean(error**2))),
        "worst": rounded(np.nanmax(np.abs(error))),
    }


# --- the path ------------------------------------------------------------------------------------


def path_panel(asked: Asked) -> dict[str, Any]:
    """The portraits of the light on its way from the lamp to the probe: two ellipses a step.

    Of a Gaussian the second moments of the power spectrum are `S = P / (8 pi^2)`, P its precision:
    `light` is the covariance of L itself, `P^-1`, and `spectrum` is S.
    """
    ray = paths.central_ray(asked.board)
    if ray is None:
        return {"words": "No lamp's ray reaches the probe's front."}
    legs = [*ray.distances, 0.0][:2]
    numbers = np.array([ray.sigma, ray.received, *legs, ray.incidence, ray.kappa])
    S = np.asarray(paths.covariances(numbers, ray.mirrored))
    titles = paths.BY_MIRROR if ray.mirrored else paths.STRAIGHT
    steps = [
        {
            "title": title,
            "light": listed(np.linalg.inv(8.0 * np.pi**2 * S[k])),
            "spectrum": listed(S[k]),
        }
        for k, title in titles.items()
    ]
    return {
        "points": listed(np.array(ray.points)),
        "steps": steps,
        "incidence": rounded(ray.incidence) if ray.mirrored else None,
        "kappa": rounded(ray.kappa) if ray.mirrored else None,
    }


# --- numbers for a page --------------------------------------------------------------------------


def rounded(value: Any) -> float | None:
    """A number to `SIGNIFICANT` digits; None for what is no number."""
    value = float(value)
    return float(f"{value:.{SIGNIFICANT}g}") if np.isfinite(value) else None


def listed(values: Any) -> list:
    """Numbers as lists, to so many digits of the largest; None for what is no number."""
    a = np.asarray(values, float)
    top = float(np.max(np.abs(a[np.isfinite(a)]), initial=0.0))
    digits = SIGNIFICANT - int(np.ceil(np.log10(top))) if top > 0.0 else 0
    a = np.round(a, min(digits, 300))
    if np.all(np.isfinite(a)):
        return a.tolist()
    return np.where(np.isfinite(a), a.astype(object), None).tolist()
