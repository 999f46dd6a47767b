"""Shapes by the names that people use, each as a module of one row."""

from __future__ import annotations

import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_coordinates,
    check_finite,
    check_positive,
    is_concrete,
    nan_unless,
)
from firstorder.numerics._compiled import compiled
from firstorder.numerics._host import hosted
from firstorder.numerics._select import either
from firstorder.numerics._vectors import cross, dot, frame_along, near_one, norm, unit
from firstorder.space.meshes.triangle_mesh import Mesh
from firstorder.space.shapes.kinds import (
    Boxes,
    Cylinders,
    Discs,
    Ellipsoids,
    Planes,
    Rectangles,
    Triangles,
)
from firstorder.typing import as_float

MOST_FACES = 128  # a mesh of more comes with a warning of the time that irradiance takes
TIP = 1e-3  # a side that is so much shorter than another one lies across from the tip of a needle


def sphere(center: Any, radius: ArrayLike) -> Ellipsoids:
    """A sphere.

    Args:
        center: shape (3,) [m].
        radius: a positive number [m].

    Raises:
        ValueError: if the radius is not positive.

    Example:
        >>> from firstorder.space import sphere
        >>> sphere((0.0, 0.0, 2.0), 0.5).count
        1
    """
    check_positive("radius", radius)
    _, r = hosted(as_float(radius))
    return Ellipsoids(center, nan_unless(r > 0.0, r) * np.eye(3, dtype=jnp.result_type(r)))


def ellipsoid(center: Any, axes: Any) -> Ellipsoids:
    """An ellipsoid from its three semi-axes, the columns of `axes` [m].

    Args:
        center: shape (3,) [m].
        axes: shape (3, 3) [m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import ellipsoid
        >>> ellipsoid((0.0, 0.0, 2.0), jnp.diag(jnp.array([1.0, 2.0, 0.5]))).count
        1
    """
    return Ellipsoids(center, axes)


def box(low: Any, high: Any) -> Boxes:
    """A box along the axes between two corners [m].

    Raises:
        ValueError: if `high` is not above `low` in every coordinate.

    Example:
        >>> from firstorder.space import box
        >>> box((0.0, 0.0, 0.0), (1.0, 2.0, 4.0)).center.tolist()
        [[0.5, 1.0, 2.0]]
    """
    xp, low, high = hosted(as_float(low), as_float(high))
    check_coordinates("low", low)
    check_coordinates("high", high)
    if is_concrete((low, high)) and not np.all(np.asarray(high) > np.asarray(low)):
        raise ValueError("Argument `high` must be above `low` in every coordinate, but is not.")
    half = 0.5 * (high - low)
    half = nan_unless(half > 0.0, half)
    return Boxes(0.5 * (low + high), xp.diag(half))


def cylinder(base: Any, top: Any, radius: ArrayLike) -> Cylinders:
    """A round cylinder with caps from the middle of its base to that of its top [m].

    Args:
        base: shape (3,) [m].
        top: shape (3,) [m].
        radius: a positive number [m].

    Raises:
        ValueError: if the radius or the length is not positive.

    Example:
        >>> from firstorder.space import cylinder
        >>> cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 0.5).center.tolist()
        [[0.0, 0.0, 1.0]]
    """
    check_positive("radius", radius)
    _, base, top, r = hosted(as_float(base), as_float(top), as_float(radius))
    check_coordinates("base", base)
    check_coordinates("top", top)
    r = nan_unless(r > 0.0, r)
    half = 0.5 * (top - base)
    _check_long("top", half)
    xp, r, half, around = hosted(r, half, frame_along(half))
    axes = xp.stack([r * around[:, 0], r * around[:, 1], half], -1)
    return Cylinders(base + half, axes)


def disc(center: Any, normal: Any, radius: ArrayLike) -> Discs:
    """A round disc whose front looks along `normal` [m].

    Args:
        center: shape (3,) [m].
        normal: of any length but zero, shape (3,).
        radius: a positive number [m].

    Raises:
        ValueError: if the radius is not positive or the normal has no length.

    Example:
        >>> from firstorder.space import disc
        >>> disc((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), 0.5).count
        1
    """
    check_positive("radius", radius)
    normal = as_float(normal)
    _check_long("normal", normal)
    xp, r, around = hosted(as_float(radius), frame_along(normal))
    r = nan_unless(r > 0.0, r)
    return Discs(center, xp.stack([r * around[:, 0], r * around[:, 1], around[:, 2]], -1))


def rectangle(center: Any, u: Any, v: Any) -> Rectangles:
    """A rectangle, or parallelogram, from its centre and two half-edges; its front is u x v [m].

    The front is the side from which it shines, and towards which `u x v` points by the right-hand
    rule: exchange u and v, or say `primitive(..., facing=point)`, to turn it round.

    Returns:
        The rectangle; of traced half-edges that are parallel one that nothing meets.

    Raises:
        ValueError: if the half-edges are parallel.

    Example:
        >>> from firstorder.space import rectangle
        >>> lamp = rectangle((0.5, 0.5, 1.0), (0.0, 0.2, 0.0), (0.2, 0.0, 0.0))  # looks down
        >>> lamp.axes[0, :, 2].tolist()
        [0.0, 0.0, -1.0]
    """
    return Rectangles(center, _spanned(u, v))


def triangle(a: Any, b: Any, c: Any) -> Triangles:
    """A triangle; seen from its front the corners follow each other counter-clockwise [m].

    Args:
        a: a corner, shape (3,) [m].
        b: the next one, likewise [m].
        c: the last one, likewise [m].

    Returns:
        The triangle; of traced corners on a line one that nothing meets.

    Raises:
        ValueError: if the corners lie on a line.

    Example:
        >>> from firstorder.space import triangle
        >>> triangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)).count
        1
    """
    a, b, c = as_float(a), as_float(b), as_float(c)
    for name, corner in (("a", a), ("b", b), ("c", c)):
        check_coordinates(name, corner)
    a, b, c = _from_no_tip(a, b, c)
    return Triangles(a, _spanned(b - a, c - a))


def plane(point: Any, normal: Any) -> Planes:
    """A plane through a point, whose front looks along `normal`.

    Args:
        point: any of it, shape (3,) [m].
        normal: of any length but zero, shape (3,).

    Raises:
        ValueError: if the normal has no length.

    Example:
        >>> from firstorder.space import plane
        >>> plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)).count
        1
    """
    point, normal = as_float(point), as_float(normal)
    check_coordinates("point", point)
    _check_long("normal", normal)
    return Planes(point, frame_along(normal))


def polygon(vertices: Any) -> Triangles:
    """A plane polygon, convex or not, as triangles.

    Cut by ears on the host: the vertices must be concrete to find the ears, but a polygon whose
    vertices are traced is cut as a fan, which is right for a convex one.

    Args:
        vertices: shape (k, 3), counter-clockwise as seen from the front [m].

    Raises:
        ValueError: if there are fewer than three, or they do not lie in a plane.

    Example:
        >>> from firstorder.space import polygon
        >>> polygon([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]).count
        2
    """
    v = as_float(vertices)
    if v.ndim != 2 or v.shape[0] < 3 or v.shape[1] != 3:
        raise ValueError(f"Argument `vertices` must have shape (k >= 3, 3), but has {v.shape}.")
    check_finite("vertices", v)
    k = v.shape[0]
    corners = _ears(np.asarray(v)) if is_concrete(v) else [(0, i, i + 1) for i in range(1, k - 1)]
    index = np.array(corners)
    a, b, c = _from_no_tip(v[index[:, 0]], v[index[:, 1]], v[index[:, 2]])
    return Triangles(a, jax.vmap(_with_normal)(b - a, c - a))


def triangles(mesh: Mesh) -> Triangles:
    """The faces of a mesh as shapes of a scene: lamps and blockers, exact with their derivatives.

    Meant for some dozens of faces. Irradiance asks every piece of an edge about every face, so time
    grows with their cube: a gradient behind eighty faces takes a quarter of a second, behind 160
    two seconds. For larger meshes, which come with a warning, there are
    `space.silhouettes.visible_mesh_silhouettes` and scene files with a mesh.

    Args:
        mesh: of `io.read_mesh`, or of `space.meshes.mesh`; its vertices may be traced.

    Returns:
        A triangle for each face, in their order; faces without an area are left out, and of traced
        ones nothing is met.

    Raises:
        ValueError: if no face has an area.

    Example:
        >>> from firstorder.space import triangles
        >>> from firstorder.space.meshes import mesh
        >>> triangles(mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])).count
        1
    """
    count = mesh.corners.shape[0]
    if count > MOST_FACES:
        warnings.warn(
            f"Argument `mesh` has {count} faces: irradiance behind them takes some "
            f"{4.0 * (count / 200) ** 3:.2g} s at each place. See visible_mesh_silhouettes, or "
            "render the mesh.",
            stacklevel=2,
        )
    a, b, c = _from_no_tip(*(mesh.corners[:, k] for k in range(3)))
    axes = jax.vmap(_with_normal)(b - a, c - a)
    if is_concrete(axes):
        some = np.any(np.asarray(axes)[..., 2] != 0.0, axis=1)
        if not np.any(some):
            raise ValueError("Argument `mesh` must have a face with an area, but has none.")
        a, axes = a[some], axes[some]
    return Triangles(a, axes)


@compiled
def _from_no_tip(
    a: Float[Array, "*n 3"], b: Float[Array, "*n 3"], c: Float[Array, "*n 3"]
) -> tuple[Float[Array, "*n 3"], Float[Array, "*n 3"], Float[Array, "*n 3"]]:
    """Corners of triangles in their order; of needles not from the tip on.

    Edges that leave a tip point almost one way: of coordinates along both the sum is rounding.
    """
    short, long = c - b, b - a
    tip = (dot(short, short) < TIP**2 * dot(long, long))[..., None]
    return either(tip, b, a), either(tip, c, b), either(tip, a, c)


def _spanned(u: Any, v: Any) -> Float[Array, "3 3"]:
    u, v = as_float(u), as_float(v)
    check_coordinates("u", u)
    check_coordinates("v", v)
    axes = _with_normal(u, v)
    if is_concrete((u, v)):
        check_finite("u", u)
        check_finite("v", v)
        if not np.any(np.asarray(axes)[:, 2]):
            raise ValueError("Arguments `u` and `v` must not be parallel, but are.")
    return axes


@compiled
def _with_normal(u: Array, v: Array) -> Float[Array, "3 3"]:
    """Two vectors and the unit normal of both as columns; of parallel ones the first alone.

    Parallel is what spans no more than rounding: even of a vector with itself a compiler's product
    need not be zero. Columns on a line have zeros for an inverse (`inverse_and_det`), and no ray
    and no eye finds the shape.
    """
    near = near_one(jnp.stack([u, v]))
    normal = cross(*near)
    spans = norm(normal) > 4.0 * jnp.finfo(normal.dtype).eps * jnp.prod(norm(near))
    v, normal = (jnp.where(spans, a, 0.0) for a in (v, normal))
    return jnp.stack([u, v, unit(normal)], -1)


def _check_long(name: str, a: Array | np.ndarray) -> None:
    check_coordinates(name, a)
    check_finite(name, a)
    if is_concrete(a) and not np.any(np.asarray(a) != 0.0):
        raise ValueError(f"Argument `{name}` must have a length, but is the zero vector.")


def _ears(v: np.ndarray) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon: cuts one convex corner that holds no other after another."""
    v = v - v[0]
    v = v / (np.max(np.abs(v)) or 1.0)
    normal = np.sum(np.cross(v, np.roll(v, -1, 0)), 0)
    size = np.linalg.norm(normal)
    if not size > 0.0:
        raise ValueError("Argument `vertices` must enclose an area, but does not.")
    normal = normal / size
    height = v @ normal
    if np.max(np.abs(height)) > np.sqrt(np.finfo(v.dtype).eps) * np.sqrt(size):
        raise ValueError("Argument `vertices` must lie in a plane, but does not.")

    def turn(i, j, k):
        return float(np.dot(np.cross(v[j] - v[i], v[k] - v[j]), normal))

    if _crosses_itself(v, normal):
        raise ValueError("Argument `vertices` must be a polygon without crossings, but is not.")

    def is_ear(left, at):
        i, j, k = left[at - 1], left[at], left[(at + 1) % len(left)]
        if turn(i, j, k) <= 0.0:
            return False
        others = (m for m in left if m not in (i, j, k))
        return not any(min(turn(i, j, m), turn(j, k, m), turn(k, i, m)) >= 0.0 for m in others)

    left, found = list(range(len(v))), []
    while len(left) > 3:
        ear = next((at for at in range(len(left)) if is_ear(left, at)), None)
        if ear is None:
            raise ValueError("Argument `vertices` must not repeat a vertex, but does.")
        found.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        left.pop(ear)
    found.append((left[0], left[1], left[2]))
    return found


def _crosses_itself(v: np.ndarray, normal: np.ndarray) -> bool:
    """Whether two edges that are no neighbours cross."""
    after, k = np.roll(v, -1, 0), len(v)

    def side(a, b, c):
        return np.cross(b - a, c - a) @ normal

    def crosses(i, j):
        a, b, c, d = v[i], after[i], v[j], after[j]
        return (side(a, b, c) * side(a, b, d) < 0.0) and (side(c, d, a) * side(c, d, b) < 0.0)

    return any(crosses(i, j) for i in range(k) for j in range(i + 2, k) if (i, j) != (0, k - 1))
