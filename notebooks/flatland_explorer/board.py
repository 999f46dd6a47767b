"""A flatland scene as a table of parts: what is moved, saved, and turned into a `Scene`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from firstorder.conventions import direction
from firstorder.flatland import (
    Arcs,
    Circles,
    Curves,
    Ellipses,
    PointLights,
    Scene,
    Segments,
    primitive,
)

KINDS = {
    "segment": (Segments, ("start", "end")),
    "arc": (Arcs, ("center", "radius", "start", "sweep")),
    "circle": (Circles, ("center", "radius")),
    "ellipse": (Ellipses, ("center", "semi", "tilt")),
    "curve": (Curves, ("cosines", "sines")),
}
POINT = "point"  # a light without size, which is no shape
MATERIAL = ("emission", "albedo", "mirror", "specular", "exponent", "ior")
OUTLINE = 48  # chords of what is round


@dataclasses.dataclass(frozen=True)
class Part:
    """One shape with its material, or a point light.

    Attributes:
        kind: key of `KINDS`, or `POINT`.
        numbers: its geometry by the names of the library's class; position and intensity of a
            point light.
        name: as in a scene.
        material: what differs from zero, by the names of `primitive`; emission and albedo are
            pairs (front, back).
    """

    kind: str
    numbers: Mapping[str, Any]
    name: str = ""
    material: Mapping[str, Any] = dataclasses.field(default_factory=dict)

    def with_numbers(self, **numbers: Any) -> Part:
        """The part with other numbers, as plain tuples and floats."""
        changed = {key: plain(value) for key, value in numbers.items()}
        return dataclasses.replace(self, numbers={**self.numbers, **changed})

    @property
    def shines(self) -> bool:
        """Whether it is a lamp."""
        return self.kind == POINT or any(self.material.get("emission", (0.0, 0.0)))

    @property
    def reflects(self) -> bool:
        """Whether it is a mirror."""
        return self.material.get("mirror", 0.0) > 0.0

    def motion(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points at parameters of it, and their velocities, (m, 2) each; by NumPy alone."""
        at = {key: np.asarray(value, float) for key, value in self.numbers.items()}
        turn, s = -2.0 * np.pi, np.asarray(s, float)
        if self.kind == "segment":
            way = at["end"] - at["start"]
            return at["start"] + s[:, None] * way, np.broadcast_to(way, (len(s), 2))
        if self.kind == "arc":
            angle, r = at["start"] + s * at["sweep"], at["radius"]
            return at["center"] + r * direction(angle), r * at["sweep"] * _left(angle)
        if self.kind == "circle":
            r = at["radius"]
            return at["center"] + r * direction(turn * s), r * turn * _left(turn * s)
        if self.kind == "ellipse":
            c, t = np.cos(at["tilt"]), np.sin(at["tilt"])
            turned = np.array([[c, t], [-t, c]])
            points, ways = direction(turn * s) * at["semi"], turn * _left(turn * s) * at["semi"]
            return at["center"] + points @ turned, ways @ turned
        k = np.arange(len(at["cosines"]))
        wave, rate = -turn * s[:, None] * k, -turn * k
        points = np.cos(wave) @ at["cosines"] + np.sin(wave) @ at["sines"]
        ways = (-rate * np.sin(wave)) @ at["cosines"] + (rate * np.cos(wave)) @ at["sines"]
        return points, ways

    def outline(self, chords: int = OUTLINE) -> np.ndarray:
        """Points along it in the order of its travel, (m, 2) [m]."""
        if self.kind == POINT:
            return np.asarray(self.numbers["position"], float)[None]
        return self.motion(np.linspace(0.0, 1.0, 2 if self.kind == "segment" else chords + 1))[0]

    def arc_length(self, s: np.ndarray) -> np.ndarray:
        """Arc length from its start to parameters of it [m]; of what is neither straight nor an
        arc by chords, to 1e-6 of its length.
        """
        if self.kind == "segment":
            return s * float(np.hypot(*np.diff(self.outline(), axis=0)[0]))
        if self.kind in ("arc", "circle"):
            turned = abs(self.numbers.get("sweep", 2.0 * np.pi))
            return s * self.numbers["radius"] * turned
        line = self.outline(4096)
        ends = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
        return np.interp(s, np.linspace(0.0, 1.0, len(line)), ends)

    @property
    def middle(self) -> np.ndarray:
        """The point that stands for its place."""
        if self.kind == "segment":
            return 0.5 * (np.asarray(self.numbers["start"]) + np.asarray(self.numbers["end"]))
        if self.kind == "arc":
            return self.motion(np.array([0.5]))[0][0]
        if self.kind == "curve":
            return np.asarray(self.numbers["cosines"], float)[0]
        return np.asarray(self.numbers["position" if self.kind == POINT else "center"], float)


@dataclasses.dataclass(frozen=True)
class Board:
    """Scene that is edited: its parts in the order of their numbers, and who receives.

    Attributes:
        parts: shapes sorted as a `Scene` numbers them; point lights last.
        receiver: number of the shape along which light is asked for.
        probe: parameter on it of the point that looks around.
        tilt: angle of that point's normal from the receiver's [rad].
        tolerance: error that the cache accepts of a record, in shares of the mean of E.
        window: what is seen: left, right, bottom, top [m].
        environment: distant light, as in a scene.
    """

    parts: tuple[Part, ...]
    receiver: int = 0
    probe: float = 0.5
    tilt: float = 0.0
    tolerance: float = 0.01
    window: tuple[float, float, float, float] = (-1.5, 1.5, -0.2, 1.6)
    environment: Any = None

    @property
    def shapes(self) -> tuple[Part, ...]:
        """The parts that are shapes."""
        return tuple(part for part in self.parts if part.kind != POINT)

    def replaced(self, index: int, part: Part) -> Board:
        """The board with another part in one place."""
        parts = (*self.parts[:index], part, *self.parts[index + 1 :])
        return dataclasses.replace(self, parts=parts)

    def scene(self) -> Scene:
        """The scene of the library."""
        things = [primitive(_shape(p), name=p.name, **p.material) for p in self.shapes]
        lights = [part.numbers for part in self.parts if part.kind == POINT]
        points = None
        if lights:
            points = PointLights(
                np.array([n["position"] for n in lights]),
                np.array([n["intensity"] for n in lights]),
            )
        return Scene.of(*things, points=points, environment=self.environment)

    def bodies(self) -> np.ndarray:
        """1 for each shape that bounds a body: what is closed, and segments in a clockwise ring."""
        mask = np.array([part.kind in ("circle", "ellipse", "curve") for part in self.shapes])
        ring: list[int] = []
        for k, part in enumerate(self.shapes):
            if part.kind != "segment":
                break
            joined = ring and tuple(self.shapes[ring[-1]].numbers["end"]) == tuple(
                part.numbers["start"]
            )
            ring = [*ring, k] if joined else [k]
            if tuple(part.numbers["end"]) == tuple(self.shapes[ring[0]].numbers["start"]):
                corners = np.array([self.shapes[i].numbers["start"] for i in ring])
                (x, y), (u, v) = corners.T, np.roll(corners, -1, 0).T
                mask[ring] = np.sum(x * v - u * y) < 0.0
                ring = []
        return mask.astype(float)


def board_of(scene: Scene, receiver: int | None = None) -> Board:
    """The board of a scene; its receiver is the shape named floor or receiver, or else the first."""
    parts, index = [], 0
    for group in scene.groups:
        kind = next(k for k, (cls, _) in KINDS.items() if isinstance(group, cls))
        for i in range(group.count):
            numbers = {key: plain(getattr(group, key)[i]) for key in KINDS[kind][1]}
            if isinstance(group, Curves):
                numbers["samples"] = group.samples
            parts.append(Part(kind, numbers, scene.names[index], _material(scene, index)))
            index += 1
    at, strength = scene.points.position, scene.points.intensity
    for p, w in zip(at, strength, strict=True):
        parts.append(Part(POINT, {"position": plain(p), "intensity": plain(w)}))
    if receiver is None:
        named = [k for k, n in enumerate(scene.names) if n in ("floor", "receiver")]
        receiver = next(iter(named), 0)
    return fitted(Board(tuple(parts), receiver, environment=scene.environment))


def fitted(board: Board) -> Board:
    """The board with a window that holds everything, and a margin."""
    everything = np.concatenate([part.outline() for part in board.parts])
    low, high = everything.min(0), everything.max(0)
    margin = 0.12 * max(float(np.max(high - low)), 0.1)
    (a, c), (b, d) = low - margin, high + margin
    return dataclasses.replace(board, window=tuple(float(v) for v in (a, b, c, d)))


def sorted_board(board: Board, parts: list[Part], receiver: Part) -> Board:
    """The board of these parts, in the order of a scene's numbers."""
    order = [*KINDS, POINT]
    parts = sorted(parts, key=lambda part: order.index(part.kind))
    number = next((k for k, part in enumerate(parts) if part is receiver), 0)
    return dataclasses.replace(board, parts=tuple(parts), receiver=number)


def first_board() -> Board:
    """A lamp above a floor; a strip and a disc between them, and a bent mirror beside."""
    return sorted_board(
        Board(parts=(), probe=0.42, window=(-1.45, 1.75, -0.22, 1.58)),
        [
            floor := Part("segment", {"start": (-1.0, 0.0), "end": (1.0, 0.0)}, "floor"),
            Part("segment", {"start": (0.3, 1.3), "end": (-0.7, 1.3)}, "lamp", LAMP),
            Part("segment", {"start": (0.0, 0.62), "end": (0.35, 0.7)}, "strip"),
            Part("circle", {"center": (-0.45, 0.5), "radius": 0.13}, "disc"),
            Part("arc", bent((1.35, 0.3), (1.2, 1.2), (1.36, 0.78)), "mirror", MIRROR),
        ],
        floor,
    )


LAMP = {"emission": (1.0, 0.0)}
MIRROR = {"mirror": 0.9}
FLATTEST = 4e-3  # the least sagitta of an arc, as a share of its chord: it stays an arc


def bent(start: Any, end: Any, through: Any) -> dict[str, Any]:
    """Numbers of the arc from one point to another that passes a third one's height.

    The height is taken over the chord's middle, so that the arc stays symmetric; half a circle and
    the flattest arc are its limits.
    """
    p, q, r = (np.asarray(v, float) for v in (start, end, through))
    chord = q - p
    length = float(np.hypot(*chord)) or 1e-9
    left = np.array([-chord[1], chord[0]]) / length
    sagitta = float((r - 0.5 * (p + q)) @ left)
    least = FLATTEST * length
    sagitta = float(np.copysign(np.clip(abs(sagitta), least, 0.5 * length), sagitta))
    radius = (0.25 * length**2 + sagitta**2) / (2.0 * abs(sagitta))
    center = 0.5 * (p + q) + (sagitta - np.copysign(radius, sagitta)) * left
    begin = np.arctan2(-(p - center)[0], (p - center)[1])
    # Bulging to the left of its travel an arc runs clockwise.
    sweep = -np.copysign(4.0 * np.arctan2(abs(sagitta), 0.5 * length), sagitta)
    return {
        "center": plain(center),
        "radius": float(radius),
        "start": float(begin),
        "sweep": float(sweep),
    }


def angle_from(n: float, way: np.ndarray) -> float:
    """Angle of a vector from a normal at angle n, between -pi and pi."""
    angle = np.arctan2(-way[0], way[1]) - n
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def _left(angle: np.ndarray) -> np.ndarray:
    """The derivative of `direction`: the unit vector a quarter of a turn further."""
    return direction(angle + 0.5 * np.pi)


def plain(value: Any) -> Any:
    """A number as a float, a vector as a tuple, a matrix as a tuple of tuples."""
    array = np.asarray(value, float)
    return float(array) if not array.ndim else tuple(plain(row) for row in array)


def _shape(part: Part) -> Any:
    cls, keys = KINDS[part.kind]
    given = {key: np.asarray(part.numbers[key], float) for key in keys}
    if part.kind == "curve":
        given["samples"] = part.numbers["samples"]
    return cls(**given)


def _material(scene: Scene, index: int) -> dict[str, Any]:
    given = {key: plain(getattr(scene.material, key)[index]) for key in MATERIAL}
    return {key: value for key, value in given.items() if np.any(np.asarray(value) != 0.0)}
