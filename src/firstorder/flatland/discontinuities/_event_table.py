"""Tables of visual events and of the jumps that they make."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from firstorder._display import in_print
from firstorder.flatland.discontinuities._critical_lines import LineEnds

KINDS = ("shadow", "two points", "point and tangent", "two tangents", "edge-on", "horizon", "dusk")


class IrradianceJumps(NamedTuple):
    """Jumps of a receiver's irradiance and of its derivatives, in order of s.

    Attributes:
        s: parameter on the receiver's shape.
        jump_E: of E, towards larger s [W/m].
        jump_E1: of dE/dx, x the arc length [W/m^2].
        jump_E2: of the second derivative, where a closed form is known (0 elsewhere) [W/m^3].
    """

    s: Float[np.ndarray, " n"]
    jump_E: Float[np.ndarray, " n"]
    jump_E1: Float[np.ndarray, " n"]
    jump_E2: Float[np.ndarray, " n"]

    __repr__ = in_print


@dataclasses.dataclass(frozen=True, eq=False)
class VisualEvents:
    """A table of visual events, one row for each. Two tables are equal if all their rows are.

    Attributes:
        receiver, s, front: the receiver's shape, the parameter on it, and which of its sides.
        kind: of each, one of `KINDS`, shape (n,).
        near, far: the two edges; of a horizon and of dusk the near one is the receiver itself.
        visible: of each, shape (n,), whether nothing stands between the receiver and the far edge.
            Of hidden ones, which `visual_events` gives only if asked to, all jumps are zero.
        jump_E, jump_E1, jump_E2: as in `IrradianceJumps`.
    """

    receiver: Int[np.ndarray, " n"]
    s: Float[np.ndarray, " n"]
    front: np.ndarray
    kind: np.ndarray
    near: LineEnds
    far: LineEnds
    visible: np.ndarray
    jump_E: Float[np.ndarray, " n"]
    jump_E1: Float[np.ndarray, " n"]
    jump_E2: Float[np.ndarray, " n"]

    __repr__ = in_print

    def __len__(self) -> int:
        return len(self.s)

    # By content, so that programs over solutions of one scene in other colours are one.
    def __eq__(self, other: object) -> bool:
        return isinstance(other, VisualEvents) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def _content(self) -> tuple:
        ends = [vars(part) for part in (self.near, self.far)]
        columns = [v for part in (vars(self), *ends) for v in part.values()]
        arrays = [v for v in columns if isinstance(v, np.ndarray)]
        return tuple((a.shape, a.dtype.str, a.tobytes()) for a in arrays)

    def take(self, rows) -> VisualEvents:
        """Some of the rows."""
        parts = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        return VisualEvents(
            **{k: v.take(rows) if isinstance(v, LineEnds) else v[rows] for k, v in parts.items()}
        )


def joined(tables: list[VisualEvents]) -> VisualEvents:
    """Several tables, one after the other."""
    fields = [f.name for f in dataclasses.fields(VisualEvents)]
    columns = {name: [getattr(t, name) for t in tables] for name in fields}
    return VisualEvents(
        **{
            k: LineEnds.stack(v) if isinstance(v[0], LineEnds) else np.concatenate(v)
            for k, v in columns.items()
        }
    )
