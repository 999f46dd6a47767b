"""The discontinuity mesh of a plane of receivers: its visual events as lines.

A vertex and an edge span a plane, which meets the receivers in a line, and so do two edges of one
plane, both halves of a disc, or an edge and a round body that it touches. Lines of sight through
three edges sweep a quadric, which meets them in a conic, and so do the cone of a vertex and a round
body, and the wall of a cylinder made longer. Planes that touch two round bodies give curves of
higher degree: the outlines of umbra and penumbra. So do lines of sight on which two round outlines
cross an edge, or a third round outline.
"""

from __future__ import annotations

import collections
import dataclasses

import numpy as np
from jaxtyping import ArrayLike, Int

from firstorder._argument_checks import check_count, check_positive
from firstorder.scene._arguments import check_asked_one
from firstorder.space.discontinuities._curves import (
    Curves,
    conics,
    plane_lines,
    vertex_lines,
)
from firstorder.space.discontinuities._edges import edges_of
from firstorder.space.discontinuities._event_table import ORDERS
from firstorder.space.discontinuities._queries import check_concrete
from firstorder.space.discontinuities._round_curves import (
    body_curves,
    edge_tangent_lines,
    endwise_curves,
    round_conics,
    vertex_cones,
    vertex_walls,
)
from firstorder.space.discontinuities._rounds import rounds_of
from firstorder.space.discontinuities._triple_curves import triple_curves
from firstorder.space.receiver import Receiver
from firstorder.space.scene import Scene


@dataclasses.dataclass(frozen=True, eq=False)
class DiscontinuityMesh:
    """Visible visual events on a plane of receivers, as pieces of lines.

    Attributes:
        lines: points of each piece, arrays of shape (k, 3) [m].
        jumps: at those points, how much the lowest derivative across the line that jumps does so:
            sizes, arrays of shape (k,) [W/m^3 for the first derivative, W/m^4 for the second]; of
            outlines that touch c of `c / sqrt(x)` in the second [W/m^3.5].
        kind: of each piece, as for `EventsAlong`, shape (n,).
        order: of that derivative.
    """

    lines: tuple[np.ndarray, ...]
    jumps: tuple[np.ndarray, ...]
    kind: np.ndarray
    order: Int[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.lines)

    def __repr__(self) -> str:
        counts = collections.Counter(self.kind.tolist())
        kinds = "".join(f", {count} of {kind!r}" for kind, count in counts.items())
        return f"DiscontinuityMesh: {len(self)} pieces of lines{kinds}"


def discontinuity_mesh(
    scene: Scene, at: Receiver, *, points: int = 65, reach: ArrayLike
) -> DiscontinuityMesh:
    """The lines on a plane of receivers across which derivatives of irradiance jump.

    Valid for: what `visual_events_along` is valid for. Lines are sampled: they end within a spacing
    of the points, and pieces shorter than that are left out. The outlines of shapes that stand on
    the plane are not among them. Lines on which two round outlines cross a third outline are looked
    for from 32 by 32 places of the square, and followed from there by steps of up to 1/32 of
    `reach`; pieces smaller than these may be missed.

    Args:
        scene: concrete shapes, and a sky of one radiance.
        at: the receiver in the middle of a square of the plane.
        points: along each line.
        reach: from there to the sides of the square, along the receiver's tangents [m].

    Raises:
        ValueError: if the scene is traced, has a plane in which the receivers do not lie, bands or
            a sky of many radiances; if `reach` is not positive or `points` no positive integer.

    Reference: J12 §5; R07 §7.

    Example:
        >>> from firstorder.space import Receiver, Scene, primitive, rectangle
        >>> from firstorder.space.discontinuities import discontinuity_mesh
        >>> lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
        >>> plate = rectangle((0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0))
        >>> scene = Scene.of(primitive(lamp, emission=1.0), primitive(plate))
        >>> mesh = discontinuity_mesh(scene, Receiver.at((0.0, 0.0, 0.0)), reach=2.0)
        >>> len(mesh), set(mesh.kind.tolist())  # each edge of one with two edges of the other
        (8, {'two edges in a plane'})
    """
    check_asked_one(scene, Scene, at, Receiver)
    check_concrete(scene, at)
    check_positive("reach", reach)
    check_count("points", points)
    edges, rounds, width = edges_of(scene, at), rounds_of(scene), float(np.asarray(reach))
    curves = [
        plane_lines(scene, edges, rounds, at, width, points),
        vertex_lines(scene, edges, at, width, points),
        *conics(scene, edges, at, width, points),
        edge_tangent_lines(scene, edges, rounds, at, width, points),
        endwise_curves(scene, edges, rounds, at, width, points),
        *body_curves(scene, edges, rounds, at, width, points),
        vertex_walls(scene, edges, rounds, at, width, points),
        vertex_cones(scene, edges, rounds, at, width, points),
        round_conics(scene, edges, rounds, at, width, points),
        triple_curves(scene, edges, rounds, at, width, points),
    ]
    return _mesh(curves)


def _mesh(curves: list[Curves]) -> DiscontinuityMesh:
    """The pieces along which something is seen."""
    lines, jumps, kinds = [], [], []
    for kind, all_places, all_sizes in curves:
        for places, sizes in zip(all_places, all_sizes, strict=True):
            shown = np.concatenate([[False], sizes > 0.0, [False]])
            ends = np.flatnonzero(shown[1:] != shown[:-1])
            for first, last in zip(ends[::2], ends[1::2], strict=True):
                if last - first > 1:
                    lines.append(places[first:last])
                    jumps.append(sizes[first:last])
                    kinds.append(kind)
    order = np.array([ORDERS[kind] for kind in kinds], int)
    return DiscontinuityMesh(tuple(lines), tuple(jumps), np.array(kinds), order)
