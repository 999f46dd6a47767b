"""Handles: where a part is taken hold of, and the board after one was moved.

A handle is named by its part and its role: `"2.end"`, `"2.body"`; the probe's are `"probe.place"`
and `"probe.normal"`. All functions are pure: a board goes in, and another one comes out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from firstorder.conventions import direction

from .board import (
    FLATTEST,
    LAMP,
    MIRROR,
    POINT,
    Board,
    Part,
    angle_from,
    bent,
    sorted_board,
)

STEM = 0.09  # length of a handle's stem, as a share of the window's width
SHORTEST = 1e-3  # a shape does not become smaller, as a share of the window's width


def stem(board: Board) -> float:
    """Length of a normal that can be dragged [m]."""
    return STEM * (board.window[1] - board.window[0])


def handles(board: Board) -> dict[str, tuple[float, float]]:
    """The place of every handle by its name [m]."""
    found = {}
    for k, part in enumerate(board.parts):
        for role, place in _ROLES[part.kind](part, stem(board)).items():
            found[f"{k}.{role}"] = tuple(float(v) for v in place)
        found[f"{k}.body"] = tuple(float(v) for v in part.middle)
    place, n = probe_frame(board)
    tip = place + 1.6 * stem(board) * direction(np.asarray(n + board.tilt))
    found["probe.place"] = tuple(float(v) for v in place)
    found["probe.normal"] = tuple(float(v) for v in tip)
    return found


def move(board: Board, handle: str, to: Any) -> Board:
    """The board after a handle was moved to a place; everything else stays as it is.

    Args:
        board: as it was.
        handle: its name.
        to: its new place [m]; one that cannot be (a segment without length) is replaced by the
            nearest that can.

    Raises:
        ValueError: if there is no such handle, or the place is no number.
    """
    to = np.asarray(to, float)
    if handle not in handles(board):
        raise ValueError(f"There is no handle {handle!r} here.")
    if to.shape != (2,) or not np.all(np.isfinite(to)):
        raise ValueError(f"The handle {handle!r} must be moved to two numbers, but not to {to}.")
    owner, role = handle.split(".")
    if owner == "probe":
        return _probe_moved(board, role, to)
    index = int(owner)
    part, size = board.parts[index], board.window[1] - board.window[0]
    if role == "body":
        return board.replaced(index, shifted(part, to - part.middle))
    return board.replaced(index, _MOVES[part.kind](part, role, to, SHORTEST * size))


def grabbed(board: Board, at: Any, reach: float) -> str | None:
    """The handle that a press at a place takes: the nearest within reach, or else a body.

    `pictures.js` has the same rule for the mouse; the tests hold them together.

    Args:
        board: as it is.
        at: the place [m].
        reach: how far from a handle or a body counts [m].
    """
    at = np.asarray(at, float)
    points = {n: p for n, p in handles(board).items() if not n.endswith(".body")}
    away = {name: float(np.hypot(*(at - np.asarray(p)))) for name, p in points.items()}
    name = min(away, key=away.__getitem__)
    if away[name] <= reach:
        return name
    bodies = {f"{k}.body": distance(part.outline(), at) for k, part in enumerate(board.parts)}
    name = min(bodies, key=bodies.__getitem__)
    return name if bodies[name] <= reach else None


def distance(outline: np.ndarray, at: np.ndarray) -> float:
    """Distance of a place from a line of chords [m]."""
    if len(outline) == 1:
        return float(np.hypot(*(at - outline[0])))
    a, e = outline[:-1], np.diff(outline, axis=0)
    t = np.clip(np.sum((at - a) * e, -1) / np.maximum(np.sum(e * e, -1), 1e-30), 0.0, 1.0)
    return float(np.min(np.hypot(*(a + t[:, None] * e - at).T)))


# --- parts come and go ---------------------------------------------------------------------------


def added(board: Board, what: str) -> Board:
    """The board with one more lamp, strip, disc, mirror or point, above the window's middle."""
    a, b, c, d = board.window
    x, y, w = 0.5 * (a + b), c + 0.6 * (d - c), 0.12 * (b - a)
    new = {
        "lamp": Part("segment", {"start": (x + w, y), "end": (x - w, y)}, "lamp", LAMP),
        "strip": Part("segment", {"start": (x - w, y), "end": (x + w, y)}, "strip"),
        "disc": Part("circle", {"center": (x, y), "radius": 0.5 * w}, "disc"),
        "mirror": Part("arc", bent((x + w, y), (x - w, y), (x, y + 0.3 * w)), "mirror", MIRROR),
        "point": Part(POINT, {"position": (x, y), "intensity": 1.0}),
    }
    if what not in new:
        raise ValueError(f"A part must be one of {', '.join(new)}, but is {what!r}.")
    return sorted_board(board, [*board.parts, new[what]], board.parts[board.receiver])


def removed(board: Board, index: int) -> Board:
    """The board without a part; the receiver stays."""
    if index == board.receiver:
        raise ValueError("The receiver stays: choose another receiver first.")
    if not 0 <= index < len(board.parts):
        raise ValueError(f"There is no part {index} here.")
    rest = [part for k, part in enumerate(board.parts) if k != index]
    return sorted_board(board, rest, board.parts[board.receiver])


def received_by(board: Board, index: int) -> Board:
    """The board with another receiver."""
    if not 0 <= index < len(board.shapes):
        raise ValueError("Only a shape can be the receiver.")
    return dataclasses.replace(board, receiver=index, probe=0.5, tilt=0.0)


# --- the probe -----------------------------------------------------------------------------------


def probe_frame(board: Board) -> tuple[np.ndarray, float]:
    """Place of the probe and the angle of the receiver's normal there."""
    points, ways = board.parts[board.receiver].motion(np.array([board.probe]))
    return points[0], float(np.arctan2(ways[0, 1], ways[0, 0]))


def _probe_moved(board: Board, role: str, to: np.ndarray) -> Board:
    place, n = probe_frame(board)
    if role == "normal":
        tilt = float(np.clip(angle_from(n, to - place), -1.4, 1.4))
        return dataclasses.replace(board, tilt=tilt)
    line = board.parts[board.receiver].outline()
    a, e = line[:-1], np.diff(line, axis=0)
    t = np.clip(np.sum((to - a) * e, -1) / np.maximum(np.sum(e * e, -1), 1e-30), 0.0, 1.0)
    k = int(np.argmin(np.hypot(*(a + t[:, None] * e - to).T)))
    s = float(np.clip((k + t[k]) / len(a), 1e-3, 1.0 - 1e-3))
    return dataclasses.replace(board, probe=s)


# --- one part ------------------------------------------------------------------------------------


def shifted(part: Part, by: np.ndarray) -> Part:
    """The part, moved as a whole."""
    n = part.numbers
    if part.kind == "segment":
        return part.with_numbers(start=n["start"] + by, end=n["end"] + by)
    if part.kind == "curve":
        cosines = np.array(n["cosines"], float)
        cosines[0] += by
        return part.with_numbers(cosines=cosines)
    key = "position" if part.kind == POINT else "center"
    return part.with_numbers(**{key: n[key] + by})


def _segment_roles(part: Part, reach: float) -> dict[str, np.ndarray]:
    a, b = (np.asarray(part.numbers[key], float) for key in ("start", "end"))
    e = (b - a) / np.hypot(*(b - a))
    tip = 0.5 * (a + b) + reach * np.array([-e[1], e[0]])
    return {"start": a, "end": b, "normal": tip}


def _segment_moved(part: Part, role: str, to: np.ndarray, least: float) -> Part:
    a, b = (np.asarray(part.numbers[key], float) for key in ("start", "end"))
    if role == "normal":
        middle, half = part.middle, 0.5 * float(np.hypot(*(b - a)))
        w = to - middle
        if np.hypot(*w) == 0.0:
            return part
        e = half * np.array([w[1], -w[0]]) / np.hypot(*w)
        return part.with_numbers(start=middle - e, end=middle + e)
    fixed = b if role == "start" else a
    away = to - fixed
    if np.hypot(*away) < least:
        way = (a - b if role == "start" else b - a) / np.hypot(*(b - a))
        to = fixed + least * way
    return part.with_numbers(**{role: to})


def _arc_ends(part: Part) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    start, middle, end = part.outline(2)
    return start, end, middle


def _arc_roles(part: Part, reach: float) -> dict[str, np.ndarray]:
    start, end, middle = _arc_ends(part)
    return {"start": start, "end": end, "bend": middle}


def _arc_moved(part: Part, role: str, to: np.ndarray, least: float) -> Part:
    """An end keeps the bend's share of the chord; the bend keeps both ends."""
    start, end, middle = _arc_ends(part)
    if role == "bend":
        return part.with_numbers(**bent(start, end, to))
    chord = end - start
    left = np.array([-chord[1], chord[0]]) / (chord @ chord)
    share = float((middle - 0.5 * (start + end)) @ left)
    fixed = end if role == "start" else start
    if np.hypot(*(to - fixed)) < least:
        to = fixed + least * (chord if role == "end" else -chord) / np.hypot(*chord)
    start, end = (to, end) if role == "start" else (start, to)
    chord = end - start
    height = np.copysign(max(abs(share), FLATTEST), share)
    through = 0.5 * (start + end) + height * np.array([-chord[1], chord[0]])
    return part.with_numbers(**bent(start, end, through))


def _circle_moved(part: Part, role: str, to: np.ndarray, least: float) -> Part:
    center = np.asarray(part.numbers["center"], float)
    return part.with_numbers(radius=max(float(np.hypot(*(to - center))), least))


def _ellipse_roles(part: Part, reach: float) -> dict[str, np.ndarray]:
    n = part.numbers
    c, t = np.cos(n["tilt"]), np.sin(n["tilt"])
    center = np.asarray(n["center"], float)
    x, y = n["semi"][0] * np.array([c, t]), n["semi"][1] * np.array([-t, c])
    return {"first": center + x, "second": center + y}


def _ellipse_moved(part: Part, role: str, to: np.ndarray, least: float) -> Part:
    w = to - np.asarray(part.numbers["center"], float)
    size, (a, b) = max(float(np.hypot(*w)), least), part.numbers["semi"]
    if role == "first":
        return part.with_numbers(semi=(size, b), tilt=np.arctan2(w[1], w[0]))
    return part.with_numbers(semi=(a, size), tilt=np.arctan2(-w[0], w[1]))


def _none(part: Part, reach: float) -> dict[str, np.ndarray]:
    return {}


_ROLES: dict[str, Callable[[Part, float], dict[str, np.ndarray]]] = {
    "segment": _segment_roles,
    "arc": _arc_roles,
    "circle": lambda part, reach: {
        "rim": np.asarray(part.numbers["center"], float) + np.array([part.numbers["radius"], 0.0])
    },
    "ellipse": _ellipse_roles,
    "curve": _none,
    POINT: _none,
}
_MOVES: dict[str, Callable[[Part, str, np.ndarray, float], Part]] = {
    "segment": _segment_moved,
    "arc": _arc_moved,
    "circle": _circle_moved,
    "ellipse": _ellipse_moved,
}
