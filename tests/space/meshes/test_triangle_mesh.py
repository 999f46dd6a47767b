import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space.meshes.triangle_mesh import mesh, vertex_normals
from tests.precision import as_dtype

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
CORNERS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def icosphere(times):
    """Vertices and faces of a sphere of radius 1: an icosahedron whose faces are cut in four."""
    g = 0.5 + 0.5 * np.sqrt(5.0)
    v = [(s * a, t * b, 0.0) for s in (-1, 1) for t in (-1, 1) for a, b in ((1.0, g),)]
    v = np.array([np.roll(p, k) for p in v for k in range(3)])
    v /= np.linalg.norm(v[0])
    f = [
        (i, j, k)
        for i in range(12) for j in range(i) for k in range(j)
        if max(np.sum((v[a] - v[b]) ** 2) for a, b in ((i, j), (j, k), (k, i))) < 1.2
    ]  # fmt: skip
    f = np.array([t if np.linalg.det(v[list(t)]) > 0.0 else t[::-1] for t in f])
    for _ in range(times):
        pairs = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), 1)
        names, which = np.unique(pairs, axis=0, return_inverse=True)
        ab, bc, ca = which.reshape(3, -1) + len(v)
        middle = v[names].sum(1)
        v = np.concatenate([v, middle / np.linalg.norm(middle, axis=1)[:, None]])
        a, b, c = f.T
        f = np.concatenate([np.stack(t, -1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc),
                                                      (ab, bc, ca))])  # fmt: skip
    return v, f


@pytest.mark.smoke
def test_edges_know_the_faces_on_either_side():
    solid = mesh(CORNERS, TETRAHEDRON)
    assert (solid.count, len(solid.edges), solid.closed) == (4, 6, True)
    for (a, b), (left, right) in zip(solid.edges, solid.sides, strict=True):
        forward = [(f[k], f[(k + 1) % 3]) for f in solid.faces[[left]] for k in range(3)]
        backward = [(f[(k + 1) % 3], f[k]) for f in solid.faces[[right]] for k in range(3)]
        assert (a, b) in forward
        assert (a, b) in backward
    np.testing.assert_allclose(solid.area, 1.5 + 0.5 * np.sqrt(3.0), rtol=1e-14)
    assert solid.size == pytest.approx(np.sqrt(3.0), rel=1e-14)


def test_a_sphere_obeys_euler_and_its_area_converges():
    areas = []
    for times in (0, 1, 2):
        v, f = icosphere(times)
        ball = mesh(v, f)
        assert ball.closed
        assert len(v) - len(ball.edges) + ball.count == 2
        areas.append(4.0 * np.pi - float(np.asarray(ball.area)))
    assert 3.0 < areas[1] / areas[2] < 4.5  # order 1 in the number of faces


def test_boundaries_folds_and_faces_that_disagree():
    # two faces that run alike along their edge; and three faces at one edge
    quarrel = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0]], [[0, 1, 2], [0, 1, 3]])
    assert np.sum(quarrel.sides == -1) == 6
    book = mesh([*CORNERS, [1, 1, 1]], [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert np.sum(book.sides == -1) == 7
    for m in (quarrel, book):
        assert np.all(m.sides[:, 0] >= 0)
        used = m.sides[m.sides >= 0]
        assert np.all(np.bincount(used, minlength=m.count) == 3)  # every side of every face once


def test_triangles_without_common_vertices_are_one_surface():
    corners = np.array(CORNERS, float)
    corners[0, 0] = -0.0
    apart = corners[TETRAHEDRON].reshape(-1, 3)
    apart[0, 0] = 0.0
    solid = mesh(apart, np.arange(12).reshape(-1, 3))
    assert (solid.closed, len(solid.edges)) == (True, 6)
    ends = np.sort(apart[solid.edges] @ [1.0, 2.0, 4.0], axis=1)
    known = corners[mesh(CORNERS, TETRAHEDRON).edges] @ [1.0, 2.0, 4.0]
    assert {tuple(e) for e in ends} == {tuple(e) for e in np.sort(known, axis=1)}
    half = mesh(np.delete(apart, np.s_[:3], axis=0), np.arange(9).reshape(-1, 3))
    assert np.sum(half.sides == -1) == 3


def test_faces_without_corners_are_left_out_and_degenerate_ones_have_no_area():
    m = mesh([*CORNERS, [2, 0, 0]], [[0, 1, 2], [1, 1, 2], [0, 1, 4]])
    assert m.count == 2
    np.testing.assert_array_equal(m.area_vectors, [[0, 0, 1], [0, 0, 0]])
    assert np.all(np.isfinite(vertex_normals(m)))


def globe(rows, columns):
    """A sphere as programs write it: quads cut in two, with a vertex for every corner of the map.

    Every pole is a row of vertices in one place, and the seam has two columns.
    """
    theta, phi = np.arange(rows + 1) * np.pi / rows, np.arange(columns + 1) * 2 * np.pi / columns
    sine, phi = np.sin(theta)[:, None], phi % (2.0 * np.pi)
    v = np.stack(
        np.broadcast_arrays(sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)[:, None])
    )
    v[:2, [0, -1]] = 0.0
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b, c, d = a + columns + 1, a + columns + 2, a + 1
    return v.reshape(3, -1).T, np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])


def test_faces_pinched_at_a_pole_have_no_edges():
    """Edges beside them once counted as boundaries, and as silhouettes within the front."""
    v, f = globe(6, 8)
    ball = mesh(v, f)
    assert ball.closed
    assert ball.count == len(f)
    assert (len(np.unique(ball.edges)), len(ball.edges)) == (5 * 8 + 2, 15 * 8)
    area = np.linalg.norm(ball.area_vectors, axis=1)
    assert np.all(area[ball.sides] > 0.01)
    turned = mesh(v, f[:, ::-1])
    assert turned.closed
    # Between two others, with no boundary near, one counts as little.
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]]
    flat = mesh(corners, [[0, 1, 2], [3, 4, 2], [1, 3, 2]])
    assert sorted(map(tuple, np.sort(flat.sides, 1).tolist())) == [(-1, 0)] * 2 + [(-1, 1)] * 2 + [
        (0, 1)
    ]
    with pytest.raises(ValueError, match="`faces` must hold a triangle, but holds none"):
        mesh(np.zeros((3, 3)), [[0, 1, 2]])


def test_vertex_normals_are_exact_on_a_sphere_and_move_with_the_mesh():
    v, f = icosphere(1)
    squeezed = v + 0.3 * np.random.default_rng(0).uniform(-1, 1, v.shape)
    squeezed /= np.linalg.norm(squeezed, axis=1)[:, None]
    ball = mesh(2.0 * squeezed + 1.0, f)
    # Of the thinnest triangle an angle is known to some hundred roundings.
    np.testing.assert_allclose(vertex_normals(ball), squeezed, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(vertex_normals(ball.at(ball.vertices[:, ::-1])), -squeezed[:, ::-1],
                               rtol=0.0, atol=1e-13)  # fmt: skip


@pytest.mark.parametrize(
    ("vertices", "faces", "sentence"),
    [
        ([[0.0, 1.0]], [[0, 0, 0]], "Argument `vertices` must have shape (v, 3), but has (1, 2)."),
        (np.zeros((0, 3)), [[0, 0, 0]],
         "Argument `vertices` must have shape (v, 3), but has (0, 3)."),
        ([[0.0, 1.0, np.nan]], [[0, 0, 0]], "Argument `vertices` must be finite, but is nan."),
        (CORNERS, [[0.0, 1.0, 2.0]],
         "Argument `faces` must be whole numbers of shape (f, 3), but is float64 (1, 3)."),
        (CORNERS, [[0, 1, 4]], "Argument `faces` must number vertices from 0 to 3, but has 4."),
        (CORNERS, [[0, 1, 1]], "Argument `faces` must hold a triangle, but holds none."),
    ],
)  # fmt: skip
def test_what_is_no_mesh_is_one_sentence(vertices, faces, sentence):
    with pytest.raises(ValueError, match="Argument") as caught:
        mesh(vertices, faces)
    assert str(caught.value) == sentence


def test_single_precision_stays_single():
    m = mesh(np.array(CORNERS, np.float32), TETRAHEDRON)
    assert vertex_normals(m).dtype == jnp.float32


@pytest.mark.parametrize("unit", [1e-10, 1e-9, 1e9])
def test_the_unit_of_length_is_of_no_matter_in_single_precision(unit):
    corners = np.array([(0.1, 0.0, 0.2), (1.2, 0.1, 0.0), (0.2, 0.9, 0.4), (1.1, 1.0, -0.3)])
    faces = [[0, 1, 2], [2, 1, 3]]
    plain, scaled = (as_dtype(mesh(k * corners, faces), "float32") for k in (1.0, unit))
    np.testing.assert_allclose(vertex_normals(scaled), vertex_normals(plain), rtol=1e-4)
    np.testing.assert_allclose(scaled.area / unit / unit, plain.area, rtol=1e-5)


@pytest.mark.parametrize(
    ("precision", "unit"),
    [
        *(("float32", unit) for unit in (1e-30, 1e-20, 1e19, 1e25)),
        *(("float64", unit) for unit in (1e-200, 1e200)),
    ],
)
def test_normals_of_tiny_and_of_vast_meshes_and_their_derivatives_are_those_of_others(
    precision, unit
):
    """Below 1e-19 m in single precision they were NaN, above 1e19 m no unit vectors."""
    corners = np.array([(0.1, 0.0, 0.2), (1.2, 0.1, 0.0), (0.2, 0.9, 0.4), (1.1, 1.0, -0.3)])
    plain, scaled = (
        as_dtype(mesh(k * corners, [[0, 1, 2], [2, 1, 3]]), precision) for k in (1.0, unit)
    )

    def slope(m):
        return jax.grad(lambda v: jnp.sum(vertex_normals(m.at(v))[:, 0]))(m.vertices)

    np.testing.assert_allclose(vertex_normals(scaled), vertex_normals(plain), rtol=1e-5)
    np.testing.assert_allclose(unit * slope(scaled), slope(plain), rtol=0.0, atol=1e-5)
    assert scaled.size == pytest.approx(unit * plain.size)


@pytest.mark.parametrize("shape", [(2, 3), (9, 3), (4, 2)])
def test_a_mesh_moves_by_all_of_its_vertices(shape):
    """JAX reads the last of them in place of those that are not there."""
    square = mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(ValueError, match=r"^Argument `vertices` must have shape \(4, 3\), but has"):
        square.at(np.zeros(shape))


def test_polygons_among_triangles_are_one_sentence():
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    with pytest.raises(ValueError, match=r"^Argument `faces` must be rows of three, but some"):
        mesh(square, [[0, 1, 2], [0, 1, 2, 3]])
