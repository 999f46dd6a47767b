"""Tables of visual events in space."""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder._display import in_print

TOUCH = "outlines that touch"
ORDERS = {
    "contact": 0,
    "two edges in a plane": 1,
    TOUCH: 2,
    "vertex and edge": 2,
    "three edges": 2,
}
KINDS = tuple(ORDERS)


@dataclasses.dataclass(frozen=True, eq=False)
class EventsAlong:
    """Visual events on a line of receivers, one row for each, in order of x.

    Attributes:
        x: distance from the first receiver [m].
        position: of the receiver [m].
        kind: of each, one of `KINDS`, shape (n,).
        order: of the lowest derivative of irradiance along the line that jumps in general, 0 for
            its value; where outlines touch the second has no bound on one side.
        direction: of the line of sight, a unit vector; of a contact that of the line itself.
        near, far: distances along it to the nearest and the farthest of the edges [m].
        visible: whether the receiver sees the edges line up. Of events that it does not see, which
            are given only if asked for, all jumps are zero.
        jump_E1: of dE/dx, towards larger x, where a closed form is known (0 elsewhere) [W/m^3].
        jump_E2: of the second derivative, likewise; where dE/dx jumps too [W/m^4].
        root_before, root_after: c of `c / sqrt(|x - x_event|)`, by which the second derivative
            grows towards an event from either side: where outlines touch, one of the two, and where
            lines of walls end in a plane of edges [W/m^3.5].
    """

    x: Float[np.ndarray, " n"]
    position: Float[np.ndarray, "n 3"]
    kind: np.ndarray
    order: Int[np.ndarray, " n"]
    direction: Float[np.ndarray, "n 3"]
    near: Float[np.ndarray, " n"]
    far: Float[np.ndarray, " n"]
    visible: Bool[np.ndarray, " n"]
    jump_E1: Float[np.ndarray, " n"]
    jump_E2: Float[np.ndarray, " n"]
    root_before: Float[np.ndarray, " n"]
    root_after: Float[np.ndarray, " n"]

    __repr__ = in_print

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows) -> EventsAlong:
        """Some of the rows."""
        parts = {f.name: getattr(self, f.name)[rows] for f in dataclasses.fields(self)}
        return EventsAlong(**parts)


def joined(tables: list[EventsAlong]) -> EventsAlong:
    """Several tables as one, in order of x."""
    columns = {
        f.name: np.concatenate([getattr(t, f.name) for t in tables])
        for f in dataclasses.fields(EventsAlong)
    }
    return EventsAlong(**columns).take(np.argsort(columns["x"], kind="stable"))
