"""A board with its scene, and what several pictures share: what falls on the receiver, and where.

The compiled programs beneath have fixed sizes: a part that is dragged compiles nothing, one more
part does.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from . import programs
from .board import Board, Part

JUMPS = 32  # places at which the view changes that are told apart
ROUNDS, PARTS = 9, 6  # by which such a place is narrowed: to 6^-9 of a step, 1e-7
EMPTY = 1e-13  # gaps narrower than this are of rounding [rad]
RAYS = 6144  # traced at a time


@dataclasses.dataclass
class Asked:
    """A board with its scene, and what several panels share.

    Attributes:
        board: as it is.
        count: places along the receiver.
    """

    board: Board
    count: int = 192

    @cached_property
    def world(self) -> programs.Movable:
        """The scene for the compiled programs."""
        return programs.movable(self.board.scene(), self.board.bodies())

    @property
    def index(self) -> jax.Array:
        """Number of the receiver."""
        return jnp.asarray(self.board.receiver)

    @property
    def grid(self) -> np.ndarray:
        """Parameters of the places along the receiver: the middles of equal steps."""
        return (np.arange(self.count) + 0.5) / self.count

    @property
    def receiver(self) -> Part:
        """The shape along which light is asked for."""
        return self.board.parts[self.board.receiver]

    @cached_property
    def steps(self) -> dict[str, np.ndarray]:
        """Views of those places."""
        return self.looked(self.grid)

    @cached_property
    def lit(self) -> Lit:
        """Curve of the light on the receiver."""
        return lit(self)

    def looked(self, s: np.ndarray, tilt: float = 0.0) -> dict[str, np.ndarray]:
        """Views of any places of the receiver, `count` at a time: one program does for all."""
        found = []
        for k in range(0, len(s), self.count):
            rows = np.resize(s[k : k + self.count], self.count)
            seen = programs.looked(self.world, self.index, rows, np.full(self.count, tilt))
            found.append({n: np.asarray(a)[: len(s) - k] for n, a in seen.items()})
        return {name: np.concatenate([part[name] for part in found]) for name in found[0]}

    def traced(self, origins: np.ndarray, along: np.ndarray, on: np.ndarray) -> dict:
        """First hits of rays, `RAYS` at a time."""
        found = []
        for k in range(0, len(origins), RAYS):
            rows = np.resize(np.arange(k, min(k + RAYS, len(origins))), RAYS)
            met = programs.ray_ends(self.world.scene, origins[rows], along[rows], on[rows])
            found.append({n: np.asarray(a)[: len(origins) - k] for n, a in met.items()})
        return {name: np.concatenate([part[name] for part in found]) for name in found[0]}


# --- E, E', E'' ----------------------------------------------------------------------------------


class Lit(NamedTuple):
    """E and its derivatives along the receiver.

    Attributes:
        s: parameters, in order: `Asked.grid`, and both sides of every place where the view changes.
        E: E, E' and E'' (m, 3); NaN within bodies.
        jump: whether a row is the last before such a place.
        on_grid: the rows of the grid's places.
        probe: the same three at the probe, by its tilted tangent.
    """

    s: Float[np.ndarray, " m"]
    E: Float[np.ndarray, "m 3"]
    jump: Bool[np.ndarray, " m"]
    on_grid: Int[np.ndarray, " n"]
    probe: Float[np.ndarray, "3"]


def lit(asked: Asked) -> Lit:
    """E and its derivatives along the receiver, with both sides of every jump."""
    board, grid = asked.board, asked.grid
    low, high = changes(asked)
    spare = np.full(2 * (JUMPS - len(low)), 0.5)  # one size of program
    s = np.concatenate([grid, low, high, spare, [board.probe]])
    tilt = np.append(np.zeros(len(s) - 1), board.tilt)
    straight = asked.receiver.kind == "segment"
    E = np.array(programs.lighting(asked.world, asked.index, s, tilt, straight))
    kept = len(grid) + 2 * len(low)
    inside = asked.looked(np.append(s[len(grid) : kept], board.probe))["inside"]
    E[np.concatenate([asked.steps["inside"], inside[:-1]]).nonzero()] = np.nan
    probe = np.where(inside[-1], np.nan, E[-1])
    order = np.argsort(s[:kept], kind="stable")
    jump = np.zeros(kept, bool)
    jump[len(grid) : len(grid) + len(low)] = True
    on_grid = np.flatnonzero(order < len(grid))
    return Lit(s[order], E[order], jump[order], on_grid, probe)


def changes(asked: Asked) -> tuple[np.ndarray, np.ndarray]:
    """Parameters just before and just after the first change of the view in each step that has one.

    The view is the order of the shapes that are seen, with the point lights, and whether the place
    lies in a body. Of more than `JUMPS` changes the first are told.
    """
    grid = asked.grid
    found = _order_of_view(asked.steps)
    cells = np.flatnonzero(np.any(found[1:] != found[:-1], -1))[:JUMPS]
    if not len(cells):
        return np.zeros(0), np.zeros(0)
    low, high, before = grid[cells], grid[cells + 1], found[cells]
    share = np.arange(1, PARTS) / PARTS
    for _ in range(ROUNDS):
        inner = low[:, None] + (high - low)[:, None] * share
        views = _order_of_view(asked.looked(inner.ravel())).reshape(*inner.shape, -1)
        other = np.any(views != before[:, None], -1)
        first = np.where(other.any(1), np.argmax(other, 1), PARTS - 1)
        ends = np.concatenate([low[:, None], inner, high[:, None]], 1)
        rows = np.arange(len(low))
        low, high = ends[rows, first], ends[rows, first + 1]
    return low, high


def _order_of_view(seen: dict[str, np.ndarray]) -> Int[np.ndarray, "m k"]:
    """Numbers of the shapes that each place sees, in their order, each run of one number once."""
    numbers = np.array(seen["seen"])
    wide = np.diff(seen["angles"], axis=1) > EMPTY
    last = np.full(len(numbers), -2)
    for k in range(numbers.shape[1]):
        fresh = wide[:, k] & (numbers[:, k] != last)
        last = np.where(wide[:, k], numbers[:, k], last)
        numbers[:, k] = np.where(fresh, numbers[:, k], -9)
    front = np.argsort(numbers == -9, axis=1, kind="stable")
    packed = np.take_along_axis(numbers, front, 1)
    flags: Bool[np.ndarray, "m f"] = np.concatenate([seen["inside"][:, None], seen["lit"]], 1)
    return np.concatenate([packed, flags.astype(packed.dtype)], 1)
