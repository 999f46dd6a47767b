"""Principal curvatures and directions of a mesh, at its vertices.

The shape operator is `S = -dn` (conventions): a sphere with outward normals has curvature -1/R.

Two estimates. `fitted_curvatures` lays a polynomial through the vertices within two edges of each
vertex, and needs no normals. `curvatures_from_normals` asks how given normals change along the
edges of each face.
"""

from __future__ import annotations

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from firstorder.errors import check_shape
from firstorder.numerics._vectors import cross, dot, norm, orthonormal_frame, unit
from firstorder.space.meshes.triangle_mesh import Mesh, vertex_normals, vertex_rings


class Curvatures(eqx.Module):
    """Normals, principal curvatures and their directions at the vertices of a mesh.

    Attributes:
        normal: unit normals.
        kappa: principal curvatures, the larger one first; negative on a hill [1/m].
        directions: unit tangents along them, shape (v, 2, 3). Where both curvatures are equal any
            two at right angles are right, and these are two of them.
    """

    normal: Float[Array, "v 3"]
    kappa: Float[Array, "v 2"]
    directions: Float[Array, "v 2 3"]

    @property
    def mean(self) -> Float[Array, " v"]:
        """Half the sum of the principal curvatures [1/m]."""
        return 0.5 * jnp.sum(self.kappa, -1)

    @property
    def gauss(self) -> Float[Array, " v"]:
        """Product of the principal curvatures [1/m^2]."""
        return self.kappa[:, 0] * self.kappa[:, 1]


def fitted_curvatures(mesh: Mesh, degree: int = 4) -> Curvatures:
    r"""Curvatures of the polynomial that comes closest to the vertices around each vertex.

    In the frame of a first guess of the normal, `z = sum_{1 <= i + j <= degree} c_ij x^i y^j` by
    least squares over all vertices within two edges; then normal and shape operator of that graph:
    with `p, q, r, s, t` its first and second derivatives at the vertex,
    `I = [[1 + p^2, p q], [p q, 1 + q^2]]`, `II = [[r, s], [s, t]] / sqrt(1 + p^2 + q^2)`,
    and S = I^-1 II, a hill having negative curvature.

    Valid when: the surface is smooth over two edges. The error falls as `h^(degree - 1)` with the
    edges' length h on any mesh, and for even degrees on a point-symmetric one too; as h^2 is
    measured for 3 and between h^3 and h^4 for 4. A vertex with too few neighbours for the degree
    gets a lower one; with fewer than five, zero.

    Args:
        mesh: any; differentiable in its vertices (not where two curvatures are equal, where the
            derivative of each is set to that of their mean).
        degree: 2, 3 or 4.

    Raises:
        ValueError: for another degree.

    Reference: F. Cazals, M. Pouget, "Estimating differential quantities using polynomial fitting
    of osculating jets", CAGD 22(2), 2005: the idea and the orders; the derivation is our own.

    Example:
        >>> import numpy as np
        >>> from firstorder.space.meshes.triangle_mesh import mesh
        >>> x, y = np.mgrid[-2:3, -2:3] / 10.0
        >>> k = np.arange(25).reshape(5, 5)
        >>> a, b = k[:-1, :-1].ravel(), k[1:, :-1].ravel()
        >>> c, d = k[1:, 1:].ravel(), k[:-1, 1:].ravel()
        >>> valley = mesh(
        ...     np.stack([x, y, x**2], -1).reshape(-1, 3),
        ...     np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]),
        ... )
        >>> print(np.round(fitted_curvatures(valley).kappa[12], 6) + 0.0)
        [2. 0.]
    """
    if degree not in (2, 3, 4):
        raise ValueError(f"Argument `degree` must be 2, 3 or 4, but is {degree}.")
    return _fit(mesh, jnp.asarray(vertex_rings(mesh)), degree)


@functools.partial(jax.jit, static_argnames="degree")
def _fit(mesh: Mesh, table: Int[Array, "v k"], degree: int) -> Curvatures:
    """Least squares at all vertices at once."""
    there = table >= 0
    count = jnp.sum(there, -1)
    guess = orthonormal_frame(_not_zero(vertex_normals(mesh)))
    away = jnp.where(there[..., None], mesh.vertices[table] - mesh.vertices[:, None], 0.0)
    h = jnp.sqrt(jnp.maximum(jnp.sum(away**2, (1, 2)) / jnp.maximum(count, 1), 1e-30))
    x, y, z = (dot(away, guess[:, None, :, k]) / h[:, None] for k in range(3))
    powers = [(i, n - i) for n in range(1, degree + 1) for i in range(n, -1, -1)]
    # Columns of a degree that the neighbours cannot tell are left out, one vertex at a time.
    needs = np.array([sum(a + b <= i + j for a, b in powers) for i, j in powers])
    kept = count[:, None] >= needs
    rows = jnp.where(kept[:, None], jnp.stack([x**i * y**j for i, j in powers], -1), 0.0)
    square = jnp.einsum("vki,vkj->vij", rows, rows)
    right = jnp.einsum("vki,vk->vi", rows, z)
    # Neighbours on a conic leave a coefficient open: the least one is taken.
    slight = 64.0 * jnp.finfo(x.dtype).eps * jnp.maximum(count, 1)[:, None]
    square = square + jnp.where(kept, slight, 1.0)[:, None] * jnp.eye(len(powers), dtype=x.dtype)
    c = jnp.linalg.solve(square, right[..., None])[..., 0]
    return _of_graph(guess, c[:, 0], c[:, 1], 2.0 * c[:, 2] / h, c[:, 3] / h, 2.0 * c[:, 4] / h)


def _of_graph(guess: Array, p: Array, q: Array, r: Array, s: Array, t: Array) -> Curvatures:
    """The shape operator of z(x, y) at a vertex, from its derivatives."""
    g = jnp.sqrt(1.0 + p * p + q * q)
    # An orthonormal frame of the tangent plane in which S is symmetric: x forward, and across.
    f = jnp.sqrt(1.0 + p * p)
    forward = (guess[..., 0] + p[:, None] * guess[..., 2]) / f[:, None]
    normal = (guess[..., 2] - p[:, None] * guess[..., 0] - q[:, None] * guess[..., 1]) / g[:, None]
    across = cross(normal, forward)
    # That frame in (x, y): (1, 0) / f and (-p q, f^2) / (f g).
    ax, bx, by = 1.0 / f, -p * q / (f * g), f / g
    aa = ax * ax * r / g
    ab = ax * (bx * r + by * s) / g
    bb = (bx * bx * r + 2.0 * bx * by * s + by * by * t) / g
    return _principal(normal, forward, across, aa, ab, bb)


def curvatures_from_normals(mesh: Mesh, normals: Float[Array, "v 3"] | None = None) -> Curvatures:
    r"""Curvatures from how normals at the vertices change along the edges of each face.

    On a face with tangents u, v, each of its three edges e asks of the symmetric matrix S that
    `S (e.u, e.v) = -(dn.u, dn.v)`: six equations for three numbers, by least squares. A vertex gets
    the mean of its faces' S, each turned from the face's plane into the vertex's by the shortest
    rotation, weighted by the part of the face that is nearest to the vertex.

    Valid when: the normals are good. With normals of the surface itself the error falls as h^2 on a
    regular mesh and as h on an irregular one; with `vertex_normals` of an irregular mesh of
    anything but a sphere it does not fall at all (`fitted_curvatures` does).

    Args:
        mesh: any; differentiable in vertices and normals.
        normals: unit vectors; `vertex_normals`, if left out.

    Raises:
        ValueError: if there is not one normal for each vertex.

    Reference: S. Rusinkiewicz, "Estimating curvatures and their derivatives on triangle meshes",
    3DPVT 2004, §2; the derivation is our own.
    """
    n = vertex_normals(mesh) if normals is None else normals
    check_shape("normals", n, mesh.vertices.shape)
    return _from_normals(mesh, n)


@jax.jit
def _from_normals(mesh: Mesh, n: Float[Array, "v 3"]) -> Curvatures:
    corners, around = mesh.corners, n[mesh.faces]
    edges = [corners[:, (k + 2) % 3] - corners[:, (k + 1) % 3] for k in range(3)]
    turns = [around[:, (k + 1) % 3] - around[:, (k + 2) % 3] for k in range(3)]  # -dn
    axes = orthonormal_frame(_not_zero(unit(mesh.area_vectors)))
    u, w, up = (axes[..., k] for k in range(3))
    S = _least_squares([(dot(e, u), dot(e, w)) for e in edges],
                       [(dot(d, u), dot(d, w)) for d in turns])  # fmt: skip
    weights = _nearest_areas(edges)
    total = jnp.zeros((*mesh.vertices.shape, 3), corners.dtype)
    whole = jnp.zeros(mesh.vertices.shape[0], corners.dtype)
    for k in range(3):
        a, b = _laid(u, up, around[:, k]), _laid(w, up, around[:, k])
        part = _tensor(a, b, *S) * weights[k][:, None, None]
        total = total.at[mesh.faces[:, k]].add(part)
        whole = whole.at[mesh.faces[:, k]].add(weights[k])
    total = total / jnp.where(whole > 0.0, whole, 1.0)[:, None, None]
    axes = orthonormal_frame(_not_zero(n))
    a, b = axes[..., 0], axes[..., 1]
    Sa, Sb = (jnp.sum(total * x[:, None], -1) for x in (a, b))
    return _principal(n, a, b, dot(a, Sa), dot(a, Sb), dot(b, Sb))


def _least_squares(edges: list, turns: list) -> tuple[Array, Array, Array]:
    """S_uu, S_uv, S_vv for each face: the normal equations, solved by hand.

    With a = sum e_u^2, b = sum e_u e_v, c = sum e_v^2 they read
    [[a, b, 0], [b, a + c, b], [0, b, c]] S = (sum e_u d_u, sum e_v d_u + e_u d_v, sum e_v d_v).
    """
    a, b, c = (sum(x) for x in zip(*((p * p, p * q, q * q) for p, q in edges), strict=True))
    pairs = list(zip(edges, turns, strict=True))
    r0 = sum(e[0] * d[0] for e, d in pairs)
    r1 = sum(e[1] * d[0] + e[0] * d[1] for e, d in pairs)
    r2 = sum(e[1] * d[1] for e, d in pairs)
    # The determinant is (a + c) (a c - b^2), twice-positive unless the face has no area.
    least = a * c - b * b
    wide = least > 0.0
    mid = (a * c * r1 - b * c * r0 - a * b * r2) / jnp.where(wide, (a + c) * least, 1.0)
    mid = jnp.where(wide, mid, 0.0)
    # a S_uu = r0 - b S_uv and c S_vv = r2 - b S_uv; an edge lies along neither axis alone.
    return (r0 - b * mid) / _or_one(a), mid, (r2 - b * mid) / _or_one(c)


def _nearest_areas(edges: list) -> list[Array]:
    """The part of each face that is nearest to its corner k; halves and quarters if obtuse."""
    squares = [dot(e, e) for e in edges]
    double = norm(cross(edges[0], edges[1]))
    cots = [-dot(edges[(k + 1) % 3], edges[(k + 2) % 3]) / _or_one(double) for k in range(3)]
    obtuse = (cots[0] < 0.0) | (cots[1] < 0.0) | (cots[2] < 0.0)

    def part(k):
        i, j = (k + 1) % 3, (k + 2) % 3
        voronoi = (squares[i] * cots[i] + squares[j] * cots[j]) / 8.0
        return jnp.where(obtuse, jnp.where(cots[k] < 0.0, 0.25, 0.125) * double, voronoi)

    return [part(k) for k in range(3)]


def _laid(a: Array, up: Array, normal: Array) -> Array:
    """A tangent turned with `up` onto `normal` by the shortest rotation."""
    c = 1.0 + dot(up, normal)
    return a - (dot(a, normal) / jnp.where(c > 1e-6, c, jnp.inf))[:, None] * (up + normal)


def _tensor(a: Array, b: Array, aa: Array, ab: Array, bb: Array) -> Array:
    def outer(x, y):
        return x[:, :, None] * y[:, None]

    mixed = ab[:, None, None] * (outer(a, b) + outer(b, a))
    return aa[:, None, None] * outer(a, a) + mixed + bb[:, None, None] * outer(b, b)


def _principal(normal: Array, a: Array, b: Array, aa: Array, ab: Array, bb: Array) -> Curvatures:
    """Eigenvalues and eigenvectors of [[aa, ab], [ab, bb]] in the tangents a, b."""
    mean, half = 0.5 * (aa + bb), 0.5 * (aa - bb)
    square = half * half + ab * ab
    round_ = square <= 0.0
    apart = jnp.where(round_, 0.0, jnp.sqrt(jnp.where(round_, 1.0, square)))
    # (aa - mean + apart, ab) or (ab, mean - aa + apart): whichever is not the small one.
    first = half >= 0.0
    x = jnp.where(first, half + apart, ab)
    y = jnp.where(first, ab, apart - half)
    x = jnp.where(round_, 1.0, x)
    along = unit(x[:, None] * a + y[:, None] * b)
    kappa = jnp.stack([mean + apart, mean - apart], -1)
    return Curvatures(normal, kappa, jnp.stack([along, cross(normal, along)], 1))


def _or_one(x: Array) -> Array:
    return jnp.where(x > 0.0, x, 1.0)


def _not_zero(normals: Array) -> Array:
    """Up, where a vertex or a face has no normal."""
    up = jnp.zeros_like(normals).at[..., 2].set(1.0)
    return jnp.where((dot(normals, normals) > 0.0)[..., None], normals, up)
