"""Procedural triangle meshes that stand in for models that cannot be had.

Bumpy spheres, bars and displaced ground; more in `models.knots`, `models.blobs` and
`models.plants`. All are made on the host, in double precision, from numbers and seeds alone: the
same call gives the same bits. Pieces that enclose something are closed, and their faces look
outwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_integer,
    check_not_negative,
    check_positive,
    check_shape,
)
from firstorder.space.meshes.triangle_mesh import NO_FACE, Mesh, mesh
from firstorder.typing import as_float

Height = Callable[[np.ndarray], np.ndarray]

# --- placing and joining -------------------------------------------------------------------------


def join_meshes(parts: Sequence[Mesh]) -> tuple[Mesh, Int[np.ndarray, " f"]]:
    """One mesh of several, and the number of the mesh from which each face comes.

    Args:
        parts: at least one; their vertices stay apart, even at the same place.

    Raises:
        ValueError: if there are none.

    Example:
        >>> from firstorder.models import bar_lattice, join_meshes, place_mesh
        >>> both, part = join_meshes([bar_lattice((1, 1)), place_mesh(bar_lattice((1, 1)), shift=(0,
        ...     0, 1))])
        >>> both.closed, part.tolist().count(1) == both.count // 2
        (True, True)
    """
    parts = list(parts)
    if not parts:
        raise ValueError("Argument `parts` must hold a mesh, but is empty.")
    vertex = np.cumsum([0, *(len(p.vertices) for p in parts)])
    face = np.cumsum([0, *(p.count for p in parts)])
    faces, edges, sides = [], [], []
    for k, p in enumerate(parts):
        faces.append(p.faces + vertex[k])
        edges.append(p.edges + vertex[k])
        sides.append(np.where(p.sides == NO_FACE, NO_FACE, p.sides + face[k]))
    numbers = (np.concatenate(a).astype(np.int32) for a in (faces, edges, sides))
    vertices = np.concatenate([np.asarray(p.vertices) for p in parts])
    return Mesh(as_float(vertices), *numbers), np.repeat(np.arange(len(parts)), np.diff(face))


def place_mesh(
    piece: Mesh, shift: Any = (0.0, 0.0, 0.0), turn: Any = None, scale: float | int = 1.0
) -> Mesh:
    """A mesh scaled, then turned, then shifted.

    Args:
        piece: the mesh.
        shift: [m], shape (3,).
        turn: a rotation, shape (3, 3), such as `rotation_about` gives; None for none.
        scale: of lengths, positive.

    Raises:
        ValueError: if `turn` is no rotation, or `shift` has not three coordinates.

    Example:
        >>> from firstorder.models import bar_lattice, place_mesh
        >>> place_mesh(bar_lattice((1, 1)), scale=2.0).area.item() == 4.0 * bar_lattice((1,
        ...     1)).area.item()
        True
    """
    check_positive("scale", scale)
    check_finite("shift", shift)
    check_shape("shift", np.asarray(shift), (3,))
    R = np.eye(3) if turn is None else np.asarray(turn, float)
    if R.shape != (3, 3) or not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0:
        raise ValueError("Argument `turn` must be a rotation of shape (3, 3), but is not.")
    return piece.at(scale * np.asarray(piece.vertices) @ R.T + np.asarray(shift, float))


def rotation_about(axis: Any, angle: float | int) -> Float[np.ndarray, "3 3"]:
    """The rotation about an axis, counter-clockwise as seen from where it points.

    Args:
        axis: of any length but zero, shape (3,).
        angle: [rad].

    Raises:
        ValueError: if the axis has no length.

    Example:
        >>> import math
        >>> from firstorder.models import rotation_about
        >>> (rotation_about((0, 0, 1), math.pi / 2) @ (1, 0, 0)).round(12).tolist()
        [0.0, 1.0, 0.0]
    """
    axis = np.asarray(axis, float)
    check_positive("axis", np.linalg.norm(axis))
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K


def ripples(
    amplitude: float | int, wavelength: float | int, seed: int = 0, waves: int = 24
) -> Height:
    """A smooth random height, to displace surfaces by: the sum of plane waves of all directions.

    Args:
        amplitude: root mean square over all of space [m].
        wavelength: the middle one; they reach from 2/3 to 4/3 of it [m].
        seed: of directions, wavelengths and phases.
        waves: how many.

    Returns:
        From places, shape (n, 2) or (n, 3), to heights [m].

    Raises:
        ValueError: if the amplitude is negative, or the wavelength or `waves` is not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.models import ripples
        >>> places = np.random.default_rng(0).uniform(0, 100, (20000, 2))
        >>> round(ripples(0.1, 1.0)(places).std().item(), 2)
        0.1
    """
    check_not_negative("amplitude", amplitude)
    check_positive("wavelength", wavelength)
    check_count("waves", waves)
    rng = np.random.default_rng(seed)
    turns = rng.normal(size=(waves, 3))
    long = wavelength * rng.uniform(2.0 / 3.0, 4.0 / 3.0, waves)
    phase = rng.uniform(0.0, 2.0 * math.pi, waves)

    def height(places: np.ndarray) -> np.ndarray:
        way = turns[:, : places.shape[1]]
        k = way * (2.0 * math.pi / (long * np.linalg.norm(way, axis=1)))[:, None]
        total = np.zeros(len(places))
        for one, at in zip(k, phase, strict=True):  # one at a time: places may be many
            total += np.sin(places @ one + at)
        return amplitude * math.sqrt(2.0 / waves) * total

    return height


# --- surfaces over a sphere and over a plane -----------------------------------------------------


def bumpy_sphere(
    radius: float | int = 1.0, height: Height | None = None, levels: int = 5, seed: int = 0
) -> Mesh:
    """A sphere whose points are moved in and out: an icosahedron cut `levels` times.

    Args:
        radius: before it is moved [m].
        height: from unit vectors, shape (n, 3), to how far they are moved, in radii, above -1; by
            default `ripples` of 0.05 radii and wavelength 0.5.
        levels: 20 times 4^levels faces.
        seed: of the default bumps.

    Raises:
        ValueError: if `height` moves a point through the middle.

    Example:
        >>> from firstorder.models import bumpy_sphere
        >>> bumpy_sphere(levels=2).count
        320
    """
    check_positive("radius", radius)
    check_integer("levels", levels)
    check_not_negative("levels", levels)
    v, f = _icosphere(levels)
    moved = _heights(ripples(0.05, 0.5, seed) if height is None else height, v)
    if not np.all(moved > -1.0):  # a NaN is not
        raise ValueError(
            f"Argument `height` must be above -1 everywhere, but its least is {moved.min()}."
        )
    return mesh(radius * (1.0 + moved)[:, None] * v, f)


def _heights(height: Height, places: np.ndarray) -> np.ndarray:
    """A height at each place."""
    found = np.asarray(height(places), float)
    if found.shape != (len(places),):
        raise ValueError(
            f"Argument `height` must give one number for each of {len(places)} places, but gives "
            f"the shape {found.shape}."
        )
    return found


def _icosphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors and faces, turned outwards."""
    g = 0.5 + 0.5 * math.sqrt(5.0)
    v = np.array(
        [
            (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
            (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1),
        ]
    ) / math.hypot(1.0, g)  # fmt: skip
    f = np.array(
        [
            (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11),
            (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
            (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
            (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
        ]
    )  # fmt: skip
    for _ in range(levels):
        ends = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), 1)
        names, which = np.unique(ends @ [len(v), 1], return_inverse=True)
        middle = v[names // len(v)] + v[names % len(v)]
        ab, bc, ca = which.reshape(3, -1) + len(v)
        v = np.concatenate([v, middle / np.linalg.norm(middle, axis=1)[:, None]])
        a, b, c = f.T
        fours = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        f = np.concatenate([np.stack(t, -1) for t in fours])
    return v, f


def displaced_ground(
    half: float | int = 1.0, height: Height | None = None, cells: int = 64, center: Any = (0.0, 0.0)
) -> Mesh:
    """A square lattice, moved up and down; it looks up and is open.

    Args:
        half: of its side [m].
        height: from places, shape (n, 2), to heights [m]; None for a flat one.
        cells: along a side, of two faces each.
        center: of the square [m], shape (2,).

    Raises:
        ValueError: if `height` is not finite somewhere, or `center` has not two coordinates.

    Example:
        >>> from firstorder.models import displaced_ground
        >>> flat = displaced_ground(2.0, cells=8)
        >>> flat.count, flat.area.item()
        (128, 16.0)
    """
    check_positive("half", half)
    check_count("cells", cells)
    check_shape("center", np.asarray(center, float), (2,))
    x = np.linspace(-half, half, cells + 1)
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2) + np.asarray(center, float)
    z = np.zeros(len(p)) if height is None else _heights(height, p)
    check_finite("height", z)
    n = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    return mesh(
        np.column_stack([p, z]), quad_triangles(n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:])
    )


def quad_triangles(a: Any, b: Any, c: Any, d: Any) -> Int[np.ndarray, "f 3"]:
    """Two triangles for each quadrangle, whose corners follow each other counter-clockwise.

    Args:
        a: numbers of the first corners, shape (n,).
        b: of the second ones, likewise.
        c: of the third ones, likewise.
        d: of the last ones, likewise.

    Returns:
        Corners of triangles, shape (2 n, 3).

    Example:
        >>> from firstorder.models import quad_triangles
        >>> quad_triangles(0, 1, 2, 3).tolist()
        [[0, 1, 2], [0, 2, 3]]
    """
    a, b, c, d = (np.ravel(n) for n in (a, b, c, d))
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])


# --- bars ----------------------------------------------------------------------------------------


def bar_lattice(
    holes: tuple[int, int] = (8, 8),
    half: tuple[float, float] = (1.0, 1.0),
    width: float | int = 0.05,
    thickness: float | int = 0.02,
) -> Mesh:
    """A plate with a lattice of holes: bars that cross each other; it lies across z, and is closed.

    Args:
        holes: along x and y; without any along one of them, slats that nothing crosses; (0, 0) for
            a plain plate.
        half: of the plate's sides [m].
        width: of the bars [m].
        thickness: from z = -thickness/2 to thickness/2 [m].

    Raises:
        ValueError: if the bars leave no holes.

    Example:
        >>> from firstorder.models import bar_lattice
        >>> plate = bar_lattice((3, 2))
        >>> plate.closed, len(plate.vertices) - len(plate.edges) + plate.count  # 2 - 2 * 6 holes
        (True, -10)
    """
    check_positive("thickness", thickness)
    lines = []
    for n, side in zip(holes, half, strict=True):
        check_positive("half", side)
        check_integer("holes", n)
        check_not_negative("holes", n)
        if n and not 0.0 < (n + 1) * width < 2.0 * side:
            raise ValueError(f"Argument `width` must leave room for {n} holes, but is {width}.")
        begins = np.linspace(-side, side - width, n + 1)
        lines.append(np.sort(np.r_[begins, begins + width]) if n else np.array([-side, side]))
    open_ = [np.arange(len(a) - 1) % 2 == bool(n) for a, n in zip(lines, holes, strict=True)]
    full = ~np.logical_and.outer(*open_) if any(holes) else np.ones((1, 1), bool)
    return _extruded(*lines, full, thickness)


def _extruded(x: np.ndarray, y: np.ndarray, full: np.ndarray, thickness: float) -> Mesh:
    """Cells of a lattice of lines, those that are full, as thick as that; walls between."""
    n = np.arange(len(x) * len(y)).reshape(len(x), len(y))
    low, high = n, n + n.size
    p = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    v = np.concatenate([np.column_stack([p, np.full(len(p), s * thickness)]) for s in (-0.5, 0.5)])
    i, j = np.nonzero(full)
    faces = [
        quad_triangles(high[i, j], high[i + 1, j], high[i + 1, j + 1], high[i, j + 1]),
        quad_triangles(low[i, j], low[i, j + 1], low[i + 1, j + 1], low[i + 1, j]),
    ]
    room = np.pad(full, 1)
    for (a, b), (di, dj) in (  # a wall from corner a to b where the neighbour that way is empty
        (((0, 0), (1, 0)), (0, -1)),
        (((1, 0), (1, 1)), (1, 0)),
        (((1, 1), (0, 1)), (0, 1)),
        (((0, 1), (0, 0)), (-1, 0)),
    ):
        wall = ~room[i + 1 + di, j + 1 + dj]
        k, m = i[wall], j[wall]
        begin, end = (k + a[0], m + a[1]), (k + b[0], m + b[1])
        faces.append(quad_triangles(low[begin], low[end], high[end], high[begin]))
    return mesh(*_without_loose(v, np.concatenate(faces)))


def _without_loose(v: np.ndarray, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mesh without vertices that no face names."""
    names, which = np.unique(f, return_inverse=True)
    return v[names], which.reshape(f.shape)
