import json
import os
import struct
import sys
import tracemalloc

import jax
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from firstorder.io import Embree, read_mesh
from firstorder.io._mesh_files import most_coordinate
from firstorder.io.meshes import read_mesh_uv
from firstorder.space.meshes.triangle_mesh import mesh
from firstorder.space.silhouettes.face_tracers import BruteForceTracer

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"


@pytest.mark.smoke
def test_a_polygon_of_an_obj_file_becomes_triangles(tmp_path):
    (tmp_path / "square.OBJ").write_text(SQUARE)
    found = read_mesh(tmp_path / "square.OBJ")
    assert (found.count, len(found.edges)) == (2, 5)
    np.testing.assert_allclose(found.area, 1.0)


@pytest.mark.parametrize("name", ["ball.obj", "ball.ply", "ball.glb", "ball.gltf"])
def test_every_format_comes_back_closed_and_as_large(tmp_path, name):
    ball = trimesh.creation.icosphere(2)
    if name.endswith("gltf"):
        for key, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(ball)).items():
            (tmp_path / key.replace("model.gltf", name)).write_bytes(data)
    else:
        ball.export(tmp_path / name)
    found = read_mesh(tmp_path / name)
    assert (found.count, found.closed) == (320, True)
    np.testing.assert_allclose(found.area, ball.area, rtol=1e-6)  # files are in single precision
    volume = np.sum(np.linalg.det(np.asarray(found.corners))) / 6.0
    np.testing.assert_allclose(volume, ball.volume, rtol=1e-6)  # ... and faces outwards


def test_parts_are_placed_and_joined_and_seams_are_closed(tmp_path):
    scene = trimesh.Scene()
    box = trimesh.creation.box()
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([3.0, 0, 0]))
    scene.add_geometry(box, transform=trimesh.transformations.scale_matrix(2.0))
    scene.export(tmp_path / "two.glb")
    found = read_mesh(tmp_path / "two.glb")
    np.testing.assert_allclose(found.area, 6.0 + 24.0, rtol=1e-6)
    np.testing.assert_allclose(np.max(found.vertices, 0), [3.5, 1.0, 1.0], rtol=1e-6)
    # vertices that differ in their texture or normal only
    (tmp_path / "seam.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.5\n"
        "f 1/1 2/2 3/3\nf 1/4 3/1 4/2\n"
    )
    seam = read_mesh(tmp_path / "seam.obj")
    assert (len(seam.vertices), len(seam.edges)) == (4, 5)


HALF = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
TWO = """mtllib two.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 0.75
usemtl red\nf 1/1 2/2 3/3\nusemtl blue\n{}
"""


def test_u_and_v_of_several_materials_are_those_of_the_file(tmp_path):
    """As they were written, by the corners' places; nothing where one part has none."""
    (tmp_path / "two.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    (tmp_path / "two.obj").write_text(TWO.format("f 1/1 3/3 4/4"))
    found, uv = read_mesh_uv(tmp_path / "two.obj")
    told = {(0.0, 0.0): (0.0, 0.0), (1.0, 0.0): (1.0, 0.0), (1.0, 1.0): (1.0, 1.0)}
    told[0.0, 1.0] = (0.25, 0.75)
    assert found.count == 2
    expected = [
        [told[tuple(x)] for x in face[:, :2].tolist()] for face in np.asarray(found.corners)
    ]
    np.testing.assert_array_equal(uv, expected)

    (tmp_path / "some.obj").write_text(TWO.format("f 1 3 4"))
    found, uv = read_mesh_uv(tmp_path / "some.obj")
    assert (found.count, uv) == (2, None)


def test_u_and_v_of_placed_parts_are_those_of_the_file(tmp_path):
    scene, square = trimesh.Scene(), np.append(HALF, np.zeros((3, 1)), 1)
    for k, colour in enumerate(((255, 0, 0, 255), (0, 0, 255, 255))):
        skin = trimesh.visual.TextureVisuals(
            HALF * (k + 1) / 2, trimesh.visual.material.PBRMaterial(baseColorFactor=colour)
        )
        part = trimesh.Trimesh(square, [[0, 1, 2]], visual=skin, process=False)
        scene.add_geometry(
            part, transform=trimesh.transformations.translation_matrix([2 * k, 0, 0])
        )
    scene.export(tmp_path / "two.glb")
    found, uv = read_mesh_uv(tmp_path / "two.glb")
    x = np.asarray(found.corners)
    for face, here in zip(x, uv, strict=True):
        k = int(face[:, 0].min() / 2)
        np.testing.assert_allclose(
            here, (face[:, :2] - [2 * k, 0]) * (k + 1) / 2, rtol=0.0, atol=1e-6
        )
    assert sorted(x[:, :, 0].min(1)) == [0.0, 2.0]


def test_a_part_of_gltf_without_a_material_has_its_u_and_v_too(tmp_path):
    skin = trimesh.visual.TextureVisuals(HALF)
    part = trimesh.Trimesh(np.append(HALF, np.zeros((3, 1)), 1), [[0, 1, 2]], visual=skin)
    for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(part)).items():
        (tmp_path / name).write_bytes(data)
    tree = json.loads((tmp_path / "model.gltf").read_text())
    del tree["materials"], tree["meshes"][0]["primitives"][0]["material"]
    (tmp_path / "model.gltf").write_text(json.dumps(tree))
    found, uv = read_mesh_uv(tmp_path / "model.gltf")
    np.testing.assert_allclose(uv, np.asarray(found.corners)[..., :2], rtol=0.0, atol=1e-6)


BROKEN = "a.{}: the file is damaged or is no mesh."


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("a.stl", b"", "a.stl: a mesh must be an .obj, .ply, .gltf or .glb file."),
        ("a.obj", b"v 0 0 0\n", "a.obj: the file"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 nan 1\nf 1 2 3\n", "a.obj: "),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 9\n", "a.obj: "),
        ("a.ply", b"ply\nformat ascii 1.0\n", BROKEN.format("ply")),
        ("a.glb", b"glTF\2\0\0\0", BROKEN.format("glb")),
        ("a.gltf", b"{}", "a.gltf: the file"),
    ],
)
def test_what_is_no_mesh_is_one_sentence(tmp_path, name, data, sentence):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ValueError, match=name) as caught:
        read_mesh(tmp_path / name)
    words = str(caught.value)
    assert words.startswith(sentence)
    assert words.endswith(".")
    assert "\n" not in words


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_text_is_read_in_utf_8_or_else_in_latin_1(tmp_path, encoding):
    """Its first line is a vertex: a byte order mark before it is no part of it."""
    (tmp_path / "a.obj").write_bytes(f"{SQUARE}o café\n# à côté\n".encode(encoding))
    np.testing.assert_allclose(read_mesh(tmp_path / "a.obj").area, 1.0)
    ball = trimesh.creation.icosahedron()
    for text in ("ascii", "binary"):
        written = ball.export(file_type="ply", encoding=text)
        assert isinstance(written, bytes)
        head, end, rest = written.partition(b"end_header")
        comment = "comment café\n".encode(encoding.removesuffix("-sig"))
        (tmp_path / "a.ply").write_bytes(head + comment + end + rest)
        np.testing.assert_allclose(read_mesh(tmp_path / "a.ply").area, ball.area, rtol=1e-6)


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ("vt 0 nan", "a texture coordinate must be finite, but is nan."),
        ("vt 1e400 0", "a texture coordinate must be finite, but is inf."),
        ("v nan 0 0", "a coordinate of a vertex must be finite, but is nan."),
        ("v 1e400 0 0", "a coordinate of a vertex must be finite, but is inf."),
        ("v -1e308 0 0", r"a coordinate of a vertex must lie within .* of 0, but is -1e\+308."),
        ("vt 0 1e308", r"a texture coordinate must lie within .* of 0, but is 1e\+308."),
    ],
)
def test_what_is_not_finite_or_too_far_away_is_one_sentence(tmp_path, lines, sentence):
    """The last vertex, or the last (u, v), of a triangle."""
    first = "v 0 0 0\nv 1 0 0\n" + (lines if lines[1] == " " else "v 0 1 0")
    second = "vt 0 0\nvt 1 0\n" + (lines if lines[1] == "t" else "vt 0 1")
    (tmp_path / "a.obj").write_text(f"{first}\n{second}\nf 1/1 2/2 3/3\n")
    with pytest.raises(ValueError, match=rf"^a\.obj: {sentence}$"):
        read_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("bits", [32, 64])
def test_a_mesh_as_large_as_allowed_has_an_area(tmp_path, bits):
    """And one of twice that size is refused, in each precision."""
    with jax.enable_x64(bits == 64):
        far = most_coordinate()
        corners = far * np.array([[-1, -1, -1], [1, 1, 1], [-1, 1, -1], [1, -1, -1]])
        lines = "f 1 2 3\nf 2 3 4\nf 1 3 4\nf 1 2 4\n"
        (tmp_path / "a.obj").write_text(
            "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in corners.tolist()) + lines
        )
        found = read_mesh(tmp_path / "a.obj")
        sides = np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) / far**2
        assert found.vertices.dtype == f"float{bits}"
        assert found.area > 0.5 * sides * float(far) ** 2
        assert np.isfinite(found.area)
        (tmp_path / "b.obj").write_text(f"v {2 * far!r} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        with pytest.raises(ValueError, match=r"b\.obj: a coordinate of a vertex must lie within"):
            read_mesh(tmp_path / "b.obj")


def gltf(**changes):
    """A triangle whose three vertices are zeros without bytes, changed."""
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3}],
        "bufferViews": [],
    }
    return json.dumps(tree | changes)


def zeros(count):
    return [{"componentType": 5126, "type": "VEC3", "count": count}]


MANY = [{"attributes": {"POSITION": 0}}] * 50


@pytest.mark.parametrize(
    ("tree", "sentence"),
    [
        (
            gltf(accessors=zeros(10**9)),
            "3000000000 numbers without bytes behind them are more than 1048576.",
        ),
        (
            gltf(accessors=zeros(3 * 10**5) * 2),
            "1800000 numbers without bytes behind them are more than 1048576.",
        ),
        (
            gltf(accessors=[zeros(5 * 10**7)[0] | {"bufferView": 0}]),
            "arrays of 150000000 numbers are not read here: at most 134217728.",
        ),
        (
            gltf(accessors=[zeros(3)[0] | {"componentType": 5122, "normalized": True}]),
            "an array whose integers are `normalized` is not read here.",
        ),
        (gltf(accessors=zeros(-3)), "the file is damaged or is no mesh."),
        (gltf(accessors=zeros(3.0)), "the file is damaged or is no mesh."),
        (
            gltf(accessors=zeros(3 * 10**5), meshes=[{"primitives": MANY * 4}]),
            "20000000 triangles are not read here: at most 16777216.",
        ),
        (
            gltf(
                accessors=zeros(3 * 10**5),
                meshes=[{"primitives": MANY}],
                nodes=[{"mesh": 0, "children": [1]}] + 3 * [{"mesh": 0}],
            ),
            "20000000 triangles are not read here: at most 16777216.",
        ),
        (gltf(buffers=[{"uri": "../b.bin"}]), "the file names another that does not lie beside"),
        (
            gltf(buffers=[{"uri": "no.bin"}]),
            r"no\.bin, which it names: the file cannot be opened \(no such file or directory\).",
        ),
        (
            gltf(buffers=[{"uri": "pipe.bin"}]),
            r"pipe\.bin, which it names: the file cannot be opened \(is a pipe\).",
        ),
        (gltf(buffers=[{"uri": "a\nb\0"}]), "the file is damaged or is no mesh."),
        (gltf(), "`faces` must hold a triangle, but holds none."),
    ],
    ids=lambda value: "" if value.startswith("{") else value,
)
def test_what_a_gltf_file_promises_is_looked_at_first(tmp_path, tree, sentence):
    (tmp_path / "x").mkdir()
    os.mkfifo(tmp_path / "x" / "pipe.bin")
    (tmp_path / "b.bin").write_bytes(b"")
    for name, data in (("a.gltf", tree.encode()), ("a.glb", glb(tree.encode()))):
        (tmp_path / "x" / name).write_bytes(data)
        tracemalloc.start()
        try:
            with pytest.raises(ValueError, match=rf"^{name}: {sentence}"):
                read_mesh(tmp_path / "x" / name)
            most = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert most < 2e6


def glb(tree):
    tree += b" " * (-len(tree) % 4)
    return b"glTF" + struct.pack("<III", 2, 20 + len(tree), len(tree)) + b"JSON" + tree


def test_materials_and_pictures_beside_a_mesh_do_no_harm(tmp_path):
    """A pipe in the place of the materials; a picture that would unpack to a large one."""
    os.mkfifo(tmp_path / "two.mtl")
    (tmp_path / "two.obj").write_text(TWO.format("f 1/1 3/3 4/4"))
    assert read_mesh_uv(tmp_path / "two.obj")[1] is not None
    tree = json.loads(gltf())
    (tmp_path / "b.bin").write_bytes(np.eye(3, dtype="<f4").tobytes())
    os.mkfifo(tmp_path / "b.png")
    tree["accessors"][0]["bufferView"] = 0
    tree["bufferViews"] = [{"buffer": 0, "byteLength": 36}]
    tree["buffers"] = [{"uri": "b.bin", "byteLength": 36}]
    tree |= {"images": [{"uri": "b.png"}], "textures": [{"source": 0}]}
    tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    tree["meshes"][0]["primitives"][0]["material"] = 0
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    np.testing.assert_allclose(read_mesh(tmp_path / "a.gltf").area, np.sqrt(0.75))


@pytest.mark.parametrize("package", ["trimesh", "embreex.rtcore_scene"])
def test_without_the_packages_the_sentence_names_the_extra(tmp_path, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    (tmp_path / "a.obj").write_text(SQUARE)
    plain = mesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(ModuleNotFoundError) as caught:
        Embree(plain) if "embree" in package else read_mesh(tmp_path / "a.obj")
    what = "Embree" if "embree" in package else "a.obj"
    assert str(caught.value) == (
        f"{what}: meshes need the package {package.split('.')[0]}, which comes with the extra "
        '`mesh`: pip install "firstorder[mesh]".'
    )


PLY = trimesh.creation.icosahedron().export(file_type="ply", encoding="ascii")


@given(st.data())
def test_mutilated_files_never_crash_the_reader(tmp_path_factory, data):
    at, cut = data.draw(st.integers(0, len(PLY))), data.draw(st.integers(0, 30))
    source = PLY[:at] + data.draw(st.binary(max_size=6)) + PLY[at + cut :]
    file = tmp_path_factory.mktemp("ply") / "f.ply"
    file.write_bytes(source)
    try:
        words = f"f.ply: {read_mesh(file).count}"
    except ValueError as error:
        words = str(error)
    assert words.startswith("f.ply: ")
    assert "\n" not in words


# --- rays ----------------------------------------------------------------------------------------


def bumpy(count=400, seed=0):
    """Random triangles, many across each other, far from the origin."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-1.0, 1.0, (count, 1, 3))
    corners = middle + 0.2 * rng.normal(size=(count, 3, 3)) + np.array([1e3, -2e3, 5e2])
    return mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def rays(m, count, seed=1):
    rng = np.random.default_rng(seed)
    low, high = np.min(m.vertices, 0), np.max(m.vertices, 0)
    return rng.uniform(low, high, (count, 3)), rng.normal(size=(count, 3))


def brute(m, o, d):
    """Nearest hits by the plane of each face, and areas: another test than the tracer's."""
    corners = np.asarray(m.corners)
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    n = np.cross(u, v)
    t = np.sum(n * (a - o[:, None]), -1) / (d @ n.T)
    q = o[:, None] + t[..., None] * d[:, None] - a
    square = np.sum(n * n, -1)
    y, z = np.sum(np.cross(q, v) * n, -1) / square, np.sum(np.cross(u, q) * n, -1) / square
    t = np.where((y >= 0) & (z >= 0) & (y + z <= 1) & (t > 0), t, np.inf)
    k = np.argmin(t, 1)
    return np.where(np.isfinite(t.min(1)), k, -1), t.min(1)


def test_hits_are_those_of_all_faces_in_double_precision():
    m = bumpy()
    o, d = rays(m, 2000)
    hits, (face, t) = Embree(m).nearest(o, d), brute(m, o, d)
    assert 0.2 < np.mean(face >= 0) < 1.0
    # the very last faces at which single and double disagree are asked again in double
    np.testing.assert_array_equal(hits.face, face)
    some = face >= 0
    # o - corner at 2e3 m is known to 2e3 eps; beyond that, double to the last digits
    np.testing.assert_allclose(hits.t[some], t[some], rtol=0.0, atol=1e-9)
    point = np.einsum("rk,rkd->rd", hits.weights, np.asarray(m.corners)[hits.face])
    np.testing.assert_allclose((o + hits.t[:, None] * d)[some], point[some], rtol=0.0, atol=1e-9)
    assert np.all(hits.weights >= 0.0)
    np.testing.assert_array_equal(hits.weights[~some], 0.0)
    assert np.all(np.isinf(hits.t[~some]))


@pytest.mark.parametrize("sizes", [1e3, 1e5])
def test_hits_of_rays_from_afar_are_as_exact(sizes):
    m = bumpy()
    ends, d = rays(m, 2000)
    d = d / np.linalg.norm(d, axis=1, keepdims=True)
    o = ends - sizes * m.size * d
    (face, t), tracer = brute(m, o, d), Embree(m)
    hits = tracer.nearest(o, d)
    assert np.mean(face >= 0) > 0.2
    np.testing.assert_array_equal(hits.face, face)
    np.testing.assert_allclose(hits.t, t, rtol=1e-14)
    np.testing.assert_array_equal(tracer.occluded(o, ends), t < sizes * m.size)


def test_occlusion_is_a_hit_before_the_other_end_and_not_at_the_ends():
    m = bumpy()
    o, d = rays(m, 1000)
    face, t = brute(m, o, d)
    tracer = Embree(m)
    some = face >= 0
    ends = o + t[:, None] * d
    assert not np.any(tracer.occluded(o[some], ends[some]))
    assert np.all(tracer.occluded(o[some], (ends + 1e-3 * d)[some]))
    # from the surface outwards, a ray does not meet where it starts
    again = tracer.nearest(ends[some], d[some])
    assert np.all(again.face != face[some])


def test_in_single_precision_what_lies_behind_the_end_hides_nothing():
    m = bumpy()
    o, d = rays(m, 1000)
    face, t = brute(m, o, d)
    some = face >= 0
    o, way = o[some], t[some, None] * d[some]
    tracer = Embree(m)
    assert not np.any(tracer.between(o, o + 0.9 * way))
    assert np.all(tracer.between(o, o + way + 0.01 * d[some]))


def test_a_fan_of_places_or_directions_is_hidden_where_a_face_comes_before():
    m = bumpy()
    o, d = rays(m, 60)
    ends, ways = o[:20], d[:20]
    tracer = Embree(m)
    start, end = np.repeat(o[20:], 20, 0), np.tile(ends, (40, 1))
    _, t = brute(m, start, end - start)
    clear = abs(t - 1.0) > 1e-3  # single precision tells no closer
    hidden, share = tracer.fan_occluded(o[20:], ends), tracer.first_share(start, end)
    assert hidden.shape == (40, 20)
    assert tracer.fan_occluded(o[20:], ends[:0]).shape == (40, 0)
    assert tracer.fan_occluded(o[:0], ends).shape == (0, 20)
    assert 0.2 < np.mean(hidden) < 0.8
    np.testing.assert_array_equal(hidden.ravel()[clear], (t < 1.0)[clear])
    np.testing.assert_allclose(share[t < 0.99], t[t < 0.99], rtol=0.0, atol=1e-3)
    assert np.all(np.isinf(share[t > 1.01]))
    _, t = brute(m, start, np.tile(ways, (40, 1)))
    np.testing.assert_array_equal(tracer.fan_occluded(o[20:], ways, np.inf).ravel(), np.isfinite(t))
    share = tracer.first_share(start, np.tile(ways, (40, 1)), np.inf)
    np.testing.assert_allclose(share, t, rtol=0.0, atol=1e-3)


def test_rays_from_an_eye_meet_the_nearest_face():
    m = bumpy()
    eye, (_, d) = np.mean(m.vertices, 0), rays(m, 2000)
    (t, seen), (face, true) = Embree(m).seen_from(eye, d), brute(m, eye[None] + 0.0 * d, d)
    assert np.mean(seen == face) > 0.999  # the others pass an edge
    np.testing.assert_allclose(t[seen == face], true[seen == face], rtol=0.0, atol=1e-9)
    assert np.all(t > 0.0)


@pytest.mark.parametrize("far", [1e2, 1e4, 1e6])
def test_rays_from_an_eye_far_away_meet_what_they_do_from_near(far):
    corners = [[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]]
    p = np.random.default_rng(0).uniform(-1.0, 1.0, (4000, 2))
    eye = far * np.array([0.3, 0.2, 1.0])
    ways = np.insert(p, 2, 0.0, axis=1) - eye
    t, face = Embree(mesh(corners, [[0, 1, 2], [0, 2, 3]])).seen_from(eye, ways)
    inside = np.max(np.abs(p), 1) < 0.5
    clear = np.abs(np.max(np.abs(p), 1) - 0.5) > 1e-6
    np.testing.assert_array_equal((face >= 0)[clear], inside[clear])
    np.testing.assert_allclose(t[face >= 0], 1.0, rtol=1e-12)


def test_a_face_that_passes_the_eye_more_closely_than_single_precision_tells_is_not_behind_it():
    """Of rays nearly along it some meet it in single precision that lead away from it in double."""
    rng = np.random.default_rng(0)
    n, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    face = np.array([[3.0, 2.0, 0.0], [-2.0, -3.0, 0.0], [-2.0, 2.0, 0.0]])
    m = mesh(np.concatenate([face, face + np.array([0.0, 0.0, 1.0])]) @ n, [[0, 1, 2], [3, 4, 5]])
    angle, tilt = rng.uniform(0.0, 2.0 * np.pi, 400), 1e-8 * rng.normal(size=400)
    d = np.stack([np.cos(angle), np.sin(angle), tilt], 1) @ n
    tracer = Embree(m)
    odd = 0
    for height in 1e-8 * rng.normal(size=10):
        t, seen = tracer.seen_from((0.1, -0.1, height) @ n, d)
        assert np.all(t > 0.0)
        np.testing.assert_array_equal(np.isinf(t), seen < 0)
        meets = np.isfinite(t) & (seen == 0)
        np.testing.assert_allclose(t[meets], (-height / tilt)[meets], rtol=1e-6)
        odd += meets.sum()
    assert odd > 20


def test_rays_through_edges_and_corners_of_a_closed_mesh_do_not_slip_through():
    ball = trimesh.creation.icosphere(2)
    m = mesh(ball.vertices, ball.faces)
    target = np.concatenate([ball.vertices, ball.vertices[m.edges].mean(1)])
    hits = Embree(m).nearest(np.zeros_like(target), target)
    assert np.all(hits.face >= 0)
    np.testing.assert_allclose(hits.t, 1.0, rtol=1e-14)
    np.testing.assert_array_equal(
        BruteForceTracer(m).first_face(
            np.zeros(3), target, 0.0, np.inf, np.full((len(target), 1), -1)
        )
        < 0,
        False,
    )


def test_a_ray_without_direction_is_one_sentence():
    with pytest.raises(ValueError, match="Argument `directions` must be finite and not zero"):
        Embree(bumpy(3)).nearest(np.zeros((1, 3)), np.zeros((1, 3)))


@pytest.mark.parametrize(("origins", "directions"), [((2, 3), (1, 3)), ((1, 2), (1, 2))])
def test_rays_of_unlike_shapes_are_one_sentence(origins, directions):
    one = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(ValueError, match=r"^Rays must be as many rows of three numbers on"):
        Embree(one).nearest(np.zeros(origins), np.ones(directions))
