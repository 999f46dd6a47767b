"""Faces of many corners: triangles cover them once, by matplotlib's own test of points."""

import numpy as np
import pytest
from matplotlib.path import Path

from firstorder.io import _polygons as module
from firstorder.io import read_mesh, read_mesh_uv
from firstorder.io._polygons import BadFace, ears, fans_only, folded

HOOK = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)], float)  # area 3
ARROW = np.array([(0, 0, 0), (2, 1, 0), (0, 2, 0), (1, 1, 0)], float)  # area 1
BOW = np.array([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1.5, 0)], float)
# A square of side 3 with a hole of side 1, joined by an edge there and back: area 8.
HOLED = np.array(
    [(0, 0), (3, 0), (3, 3), (0, 3), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)], float
)


def star(count, rng):
    """A face about the origin whose corners lie at any distance from it."""
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    radii = rng.uniform(0.1, 1.0, count)
    return radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], -1)


def spiral(count):
    """A band that winds three times round."""
    angles = np.linspace(0.0, 6.0 * np.pi, count)
    arm = np.stack([np.cos(angles), np.sin(angles)], -1)
    return np.concatenate([(1.0 + angles[:, None]) * arm, ((1.5 + angles[:, None]) * arm)[::-1]])


def in_space(flat, rng):
    """A face of the plane, turned in space."""
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return flat @ axes[:2]


def covers_once(flat, three, rng):
    """Whether as many triangles hold random points as faces do: one inside, none outside."""
    points = rng.uniform(flat.min(0), flat.max(0), (2000, 2))
    held = sum(Path(flat[list(t)]).contains_points(points).astype(int) for t in three)
    return np.array_equal(held, Path(flat).contains_points(points).astype(int))


FACES = {
    "hook": HOOK[:, :2],
    "arrow": ARROW[:, :2],
    "star": star(40, np.random.default_rng(1)),
    "another star": star(9, np.random.default_rng(2)),
    "spiral": spiral(60),
}


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize("turned", [False, True])
def test_triangles_cover_a_face_once(name, turned):
    flat, rng = FACES[name][:: -1 if turned else 1], np.random.default_rng(3)
    three = ears(in_space(flat, rng))
    assert len(three) == len(flat) - 2
    assert covers_once(flat, three, rng)


def test_triangles_turn_as_their_face_does():
    for face in (HOOK, HOOK[::-1]):
        corners = face[np.array(ears(face))]
        z = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
        assert np.all(z > 0.0) if face is HOOK else np.all(z < 0.0)


def test_a_hole_that_is_joined_to_its_face_stays_one():
    corners = HOLED[np.array(ears(np.append(HOLED, np.zeros((10, 1)), 1)))]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    assert np.all(areas >= 0.0)
    np.testing.assert_allclose(np.sum(areas), 8.0, rtol=1e-14)


def test_convex_faces_are_fans():
    angles = 2.0 * np.pi * np.arange(7) / 7
    round_ = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], -1)
    assert not np.any(folded(np.stack([np.roll(round_, k, 0) for k in range(7)])))
    assert np.sum(folded(np.stack([np.roll(HOOK, k, 0) for k in range(6)]))) == 4


def test_what_has_no_inside_is_refused(monkeypatch):
    with pytest.raises(BadFace, match=r"^a face of 4 corners crosses itself\."):
        ears(BOW)
    monkeypatch.setattr(module, "MOST_CORNERS", 5)
    with pytest.raises(BadFace, match="a face of 6 corners is not convex: at most 5 are read"):
        ears(HOOK)


# --- in files ------------------------------------------------------------------------------------


def obj(face, names=None):
    names = names or range(1, len(face) + 1)
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in face)
    return vertices + "f " + " ".join(map(str, names)) + "\n"


def ply(face, extra=""):
    rows = "".join(f"{x} {y} {z}{' 0 0' if extra else ''}\n" for x, y, z in face)
    return (
        f"ply\nformat ascii 1.0\nelement vertex {len(face)}\nproperty float x\nproperty float y\n"
        f"property float z\n{extra}element face 1\nproperty list uchar int vertex_indices\n"
        f"end_header\n{rows}{len(face)} {' '.join(map(str, range(len(face))))}\n"
    )


@pytest.mark.parametrize("kind", ["obj", "ply"])
@pytest.mark.parametrize(("face", "area"), [(HOOK, 3.0), (ARROW, 1.0)], ids=["hook", "arrow"])
def test_the_area_of_a_face_is_its_own_wherever_it_begins(tmp_path, kind, face, area):
    for k in range(len(face)):
        file = tmp_path / f"{k}.{kind}"
        file.write_text({"obj": obj, "ply": ply}[kind](np.roll(face, k, 0)))
        np.testing.assert_allclose(np.sum(read_mesh(file).area), area, rtol=1e-7)


def test_a_face_of_a_ply_file_with_uv_is_refused_where_it_folds(tmp_path):
    file = tmp_path / "a.ply"
    file.write_text(ply(ARROW, "property float s\nproperty float t\n"))
    with pytest.raises(ValueError, match=r"^a\.ply: a face is not convex, and has \(u, v\): cut"):
        read_mesh(file)


def test_corners_keep_their_places_in_a_picture(tmp_path):
    uv = "".join(f"vt {x / 2} {y / 2}\n" for x, y, _ in np.roll(HOOK, 1, 0))
    text = obj(np.roll(HOOK, 1, 0), [f"{k}/{k}" for k in range(1, 7)])
    (tmp_path / "a.obj").write_text(uv + text)
    found, where = read_mesh_uv(tmp_path / "a.obj")
    np.testing.assert_allclose(
        where, np.asarray(found.corners)[..., :2] / 2.0, rtol=0.0, atol=1e-12
    )
    np.testing.assert_allclose(np.sum(found.area), 3.0, rtol=1e-12)


def test_numbers_that_count_back_count_from_their_own_line(tmp_path):
    """Of two triangles one below the other, each names its last three vertices."""
    low, high = (
        np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
        np.array([(0, 0, 1), (2, 0, 1), (0, 2, 1)]),
    )
    (tmp_path / "a.obj").write_text(obj(low, (-3, -2, -1)) + obj(high, (-3, -2, -1)))
    np.testing.assert_allclose(read_mesh(tmp_path / "a.obj").area, 0.5 + 2.0)


@pytest.mark.parametrize("name", [0, -4])
def test_a_vertex_before_the_first_is_refused(tmp_path, name):
    (tmp_path / "a.obj").write_text(obj(HOOK[:3], (name, 2, 3)))
    words = rf"^a\.obj: a face names vertex {name}, but there are 1 to 3\."
    with pytest.raises(ValueError, match=words):
        read_mesh(tmp_path / "a.obj")


def test_other_text_stays_as_it_is():
    for text in (obj(HOOK[:3]), obj(HOOK), ""):
        assert fans_only(text) == text
