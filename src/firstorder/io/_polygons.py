r"""Faces of more than three corners, in triangles that cover them once.

A fan from the first corner is right for convex faces, and for some others; where a triangle of it
would face the other way, ears are clipped instead (Meisters 1975: every simple polygon has two).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

MOST_CORNERS = 1024  # of a face that is no fan: ears cost up to the cube of their number

_NO_FANS = re.compile(r"^f(?:(?:[ \t]+[^\s]+){4}|[^\n]*[ \t/](?:-|0[\s/]))", re.MULTILINE)


class BadFace(ValueError):
    """A face that covers no area once, or names no vertex, in words of ours."""


def folded(corners: Float[np.ndarray, "m n 3"]) -> Bool[np.ndarray, " m"]:
    """Whether the fan from the first corner of each face has a triangle that faces the other way.

    Example:
        >>> import numpy as np
        >>> from firstorder.io._polygons import folded
        >>> arrow = np.array([(0, 0, 0), (2, 1, 0), (0, 2, 0), (1, 1, 0)], float)
        >>> folded(np.stack([arrow, np.roll(arrow, 1, 0)])).tolist()
        [True, False]
    """
    spokes = corners[:, 1:] - corners[:, :1]
    areas = np.cross(spokes[:, :-1], spokes[:, 1:])
    normal = np.sum(areas, 1, keepdims=True)
    shares = np.sum(areas * normal, -1)
    return np.any(shares < -1e-9 * np.sum(normal**2, -1), 1)


def ears(corners: Float[np.ndarray, "n 3"]) -> list[tuple[int, int, int]]:
    """Triangles that cover a face once, of the numbers of its corners, turned as it is.

    Raises:
        BadFace: if the face crosses itself, or has more than `MOST_CORNERS` corners.

    Example:
        >>> import numpy as np
        >>> from firstorder.io._polygons import ears
        >>> ears(np.array([(0, 0, 0), (2, 1, 0), (0, 2, 0), (1, 1, 0)], float))
        [(3, 0, 1), (1, 2, 3)]
    """
    if len(corners) > MOST_CORNERS:
        raise BadFace(
            f"a face of {len(corners)} corners is not convex: at most {MOST_CORNERS} are read."
        )
    flat, left, made = _flat(corners), list(range(len(corners))), []
    while len(left) > 3:
        threes = zip(left[-1:] + left[:-1], left, left[1:] + left[:1], strict=True)
        ear = next((three for three in threes if _is_ear(flat, three, left)), None)
        if ear is None:
            break
        made.append(ear)
        left.remove(ear[1])
    if len(left) > 3 or _doubled(*flat[left]) < 0.0:
        raise BadFace(f"a face of {len(corners)} corners crosses itself.")
    return [*made, (left[0], left[1], left[2])]


def _flat(corners: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
    """The face along the axis to which it turns most, counter-clockwise."""
    normal = np.sum(np.cross(corners, np.roll(corners, -1, 0)), 0)
    axis = int(np.argmax(np.abs(normal)))
    flat = np.delete(corners, axis, 1)
    turned = (normal[axis] < 0.0) != (axis == 1)
    return flat[:, ::-1] if turned else flat


def _doubled(a, b, c):
    """Twice the signed area of triangles of the plane."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (
        c[..., 0] - a[..., 0]
    )


def _is_ear(flat: Float[np.ndarray, "n 2"], three: tuple[int, int, int], left: list[int]) -> bool:
    """Whether a corner and its neighbours are a triangle of the face that holds no other corner.

    Corners in the same place do not count: a hole is joined to its face along an edge there and
    back.
    """
    a, b, c = flat[list(three)]
    if _doubled(a, b, c) <= 0.0:
        return False
    others = flat[left]
    others = others[~np.any([np.all(others == corner, -1) for corner in (a, b, c)], 0)]
    within = (_doubled(a, b, others) >= 0.0) & (_doubled(b, c, others) >= 0.0)
    return not np.any(within & (_doubled(c, a, others) >= 0.0))


def triangles(
    faces: Sequence[Int[np.ndarray, " n"]], vertices: Float[np.ndarray, "k 3"]
) -> dict[int, list[tuple[int, int, int]]]:
    """Triangles of those faces that are no fans, by the faces' numbers.

    Args:
        faces: numbers of vertices, three or more each.
        vertices: of all of them.

    Raises:
        BadFace: if such a face crosses itself, or has too many corners.
        IndexError: if there is no such vertex.
    """
    counts = np.array([len(face) for face in faces])
    found = {}
    for count in np.unique(counts[counts > 3]):
        (which,) = np.nonzero(counts == count)
        corners = vertices[np.array([faces[k] for k in which])]
        for k in np.flatnonzero(folded(corners)):
            found[int(which[k])] = ears(corners[k])
    return found


def faces_of(
    face: Int[np.ndarray, " n"], cut: list[tuple[int, int, int]] | None
) -> Int[np.ndarray, "m 3"]:
    """Triangles of one face, of the numbers of its corners; a fan where none are given."""
    fan = [(0, i, i + 1) for i in range(1, len(face) - 1)]
    return np.asarray(face, np.int64)[np.array(cut or fan)]


def fans_only(text: str) -> str:
    r"""The text of an .obj file whose faces are fans, and count vertices from the first.

    What is so already, or is no such text, stays as it is.

    Raises:
        BadFace: if a face crosses itself, has too many corners, or names a vertex before the first.
        ValueError, IndexError: if it is no such text.

    Example:
        >>> from firstorder.io._polygons import fans_only
        >>> fans_only("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1").split("\n")[-1]
        'f 1 2 3'
    """
    text = text.replace("\r\n", "\n").replace("\\\n", "")
    if not _NO_FANS.search(text):
        return text
    lines, places, faces, vertices = text.split("\n"), [], [], []
    counts = {"v": 0, "vt": 0, "vn": 0}
    for k, line in enumerate(lines):
        word, _, rest = line.partition(" ")
        if word in counts:
            counts[word] += 1
        if word == "v":
            vertices.append([float(x) for x in rest.split()[:3]])
        elif word == "f":
            places.append(k)
            faces.append([_counted(corner, counts) for corner in rest.split()])
    numbers = [np.array([int(c.partition("/")[0]) - 1 for c in face]) for face in faces]
    cut = triangles(numbers, np.array(vertices).reshape(-1, 3))
    for number, (k, face) in enumerate(zip(places, faces, strict=True)):
        parts = [[face[i] for i in three] for three in cut.get(number, [range(len(face))])]
        lines[k] = "\n".join("f " + " ".join(part) for part in parts)
    return "\n".join(lines)


def _counted(corner: str, counts: dict[str, int]) -> str:
    """A corner whose numbers count from the first, of one that counts from the last so far."""
    pairs = zip(corner.split("/"), counts.values(), strict=False)
    counted = [str(n + 1 + int(a)) if a.startswith("-") else a for a, n in pairs]
    if int(counted[0]) < 1:
        vertex = corner.partition("/")[0]
        raise BadFace(f"a face names vertex {vertex}, but there are 1 to {counts['v']}.")
    return "/".join(counted)
