"""Parts of mesh files, from files written by hand; limits, at them and one beyond."""

import json
import pathlib
import struct
from types import SimpleNamespace

import jax
import numpy as np
import pytest
import trimesh

from firstorder.io import _mesh_files as files
from firstorder.io._mesh_files import Part, read_parts

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
# An arrow's head: from its first corner a fan would cover more than it.
ARROW = np.array([(0, 0, 0), (2, 1, 0), (0, 2, 0), (1, 1, 0)], float)


def put(folder, name, data):
    (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_parts(folder / name, trimesh)


def area(part):
    a, b, c = np.moveaxis(part.vertices[part.faces], 1, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


# --- what is read --------------------------------------------------------------------------------


def test_an_obj_file_gives_vertices_faces_and_u_v(tmp_path):
    text = "v 0 0 0\nv 2 0 0\nv 0 1 0\nvt 0.1 0.2\nvt 0.3 0.4\nvt 0.5 0.6\nf 1/1 2/2 3/3\n"
    (part,) = put(tmp_path, "A.OBJ", text)
    order = part.faces[0]
    np.testing.assert_array_equal(part.vertices[order], [(0, 0, 0), (2, 0, 0), (0, 1, 0)])
    assert part.uv is not None
    np.testing.assert_array_equal(part.uv[order], [(0.1, 0.2), (0.3, 0.4), (0.5, 0.6)])
    (bare,) = put(tmp_path, "b.obj", "v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    assert bare.uv is None


def ply(corners, faces, name="vertex_indices", comment="", more=""):
    lines = ["ply", "format ascii 1.0", *([f"comment {comment}"] if comment else [])]
    lines += [f"element vertex {len(corners)}", *(f"property float {a}" for a in "xyz")]
    lines += [f"element face {len(faces)}", f"property list uchar int {name}", "end_header"]
    lines += [" ".join(map(str, x)) for x in corners]
    return "\n".join([*lines, *(f"{len(f)} {' '.join(map(str, f))}" for f in faces), more])


@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
@pytest.mark.parametrize(
    ("corners", "faces", "true", "count"),
    [
        (SQUARE, [[0, 1, 2, 3]], 1.0, 2),
        (ARROW, [[0, 1, 2, 3]], 1.0, 2),
        (ARROW, [[0, 1, 2, 3], [0, 3, 2]], 2.0, 3),
        (SQUARE, [[0, 1, 2], [0, 2, 3]], 1.0, 2),
        (SQUARE, [[0, 1, 2]], 0.5, 1),
    ],
)
def test_faces_of_a_ply_file_are_covered_once(tmp_path, name, corners, faces, true, count):
    (part,) = put(tmp_path, "a.ply", ply(corners, faces, name))
    assert area(part) == pytest.approx(true)
    assert len(part.faces) == count
    np.testing.assert_array_equal(part.vertices, corners)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_triangles_of_a_ply_file_are_its_own(tmp_path, encoding):
    one = trimesh.Trimesh(SQUARE, [[1, 2, 3], [0, 1, 3]], process=False)
    (part,) = put(tmp_path, "a.ply", one.export(file_type="ply", encoding=encoding))
    np.testing.assert_array_equal(part.faces, [[1, 2, 3], [0, 1, 3]])


def kept(polygons, data=SQUARE, **more):
    """What trimesh keeps of a .ply file, under the name of the list of a face."""
    axes = {axis: data[:, k] for k, axis in enumerate("xyz")}
    raw = {"face": {"data": polygons}, "vertex": {"data": axes}}
    return SimpleNamespace(faces=[[0, 1, 2], [0, 2, 3]], metadata={"_ply_raw": raw}, **more)


def test_polygons_in_a_table_with_their_counts_are_read_too():
    table = np.zeros(1, [("vertex_indices", [("f0", "i4"), ("f1", "i4", 4)])])
    table["vertex_indices"]["f1"] = [0, 1, 2, 3]
    np.testing.assert_array_equal(files._ply_faces(kept(table), False), [[0, 1, 2], [0, 2, 3]])
    folded = files._ply_faces(kept(table, ARROW), False)
    assert area(Part(ARROW, folded, None)) == pytest.approx(1.0)
    with pytest.raises(ValueError, match="is not convex, and has"):
        files._ply_faces(kept(table, ARROW), True)
    assert len(files._ply_faces(kept(table), True)) == 2
    other = np.zeros(1, [("red", "i4")])
    np.testing.assert_array_equal(files._ply_faces(kept(other), False), [[0, 1, 2], [0, 2, 3]])
    bare = SimpleNamespace(faces=[[0, 1, 2]], metadata={})
    np.testing.assert_array_equal(files._ply_faces(bare, True), [[0, 1, 2]])


@pytest.mark.parametrize(
    ("uv", "known"),
    [
        (None, False),
        (np.arange(8.0), False),
        (np.ones((3, 2)), False),
        (np.ones((4, 1)), False),
        (np.arange(8.0).reshape(4, 2), True),
        (np.arange(12.0).reshape(4, 3), True),
    ],
)
def test_u_and_v_are_two_numbers_of_each_vertex_or_nothing(uv, known):
    found = SimpleNamespace(
        vertices=SQUARE, faces=[[0, 1, 2]], metadata={}, visual=SimpleNamespace(uv=uv)
    )
    part = files._part(found)
    assert (part.uv is not None) == known
    np.testing.assert_array_equal(part.vertices, SQUARE)
    if known:
        np.testing.assert_array_equal(part.uv, uv[:, :2])


TREE = {
    "asset": {"version": "2.0"},
    "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"mesh": 0}, {"mesh": 0, "translation": [5.0, 0.0, 0.0]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"uri": " b.bin", "byteLength": 36}],
}


def chunk(kind, data):
    return struct.pack("<I", len(data)) + kind + data


def glb(tree, *chunks):
    tree = json.dumps(tree).encode()
    tree += b" " * (-len(tree) % 4)
    body = b"".join([chunk(b"JSON", tree), *chunks])
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


@pytest.mark.parametrize("kind", ["gltf", "glb"])
def test_a_mesh_stands_where_the_nodes_of_a_file_place_it(tmp_path, kind):
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], "<f4").tobytes()
    (tmp_path / "b.bin").write_bytes(corners)
    packed = glb(TREE | {"buffers": [{"byteLength": 36}]}, chunk(b"BIN\0", corners))
    parts = put(tmp_path, f"a.{kind}", json.dumps(TREE) if kind == "gltf" else packed)
    ends = sorted(part.vertices[:, 0].max() for part in parts)
    np.testing.assert_allclose(ends, [1.0, 6.0])
    np.testing.assert_allclose([area(part) for part in parts], [0.5, 0.5])


# --- what trimesh is given -----------------------------------------------------------------------


@pytest.mark.parametrize("length", range(4))
def test_a_binary_file_keeps_what_follows_its_tree_and_says_its_new_lengths(length):
    tree = TREE | {"images": [{"uri": "x" * (50 + length)}]}
    given = glb(tree, chunk(b"BIN\0", b"12345678"))
    found = files._glb_source(given).read()
    magic, version, whole, own = struct.unpack("<4sIII", found[:16])
    assert (magic, version, whole) == (b"glTF", 2, len(found))
    assert own % 4 == 0
    assert found[16:20] == b"JSON"
    assert found[20 + own :] == chunk(b"BIN\0", b"12345678")
    told = json.loads(found[20 : 20 + own])
    assert "images" not in told
    assert told["accessors"] == tree["accessors"]


def test_a_binary_file_without_a_whole_tree_is_none():
    good = glb(TREE)
    files._glb_source(good)
    for bad in (good[:-1], good.replace(b"JSON", b"BIN\0"), good[:15]):
        with pytest.raises(ValueError, match=r"^$"):
            files._glb_source(bad)


def test_text_is_utf_8_or_latin_1():
    assert files._decoded("é".encode()) == "é"
    assert files._decoded("é".encode("latin-1")) == "é"
    assert files._decoded("é".encode("utf-8-sig")) == "é"
    numbers = b"end_header\n\xff\xfe\x00"
    given = "ply\ncomment é\n".encode("latin-1") + numbers
    assert files._ply_source(given).read() == "ply\ncomment é\n".encode() + numbers


def light(**changes):
    return json.loads(files._light_tree(json.dumps(TREE | changes).encode()))


def test_parts_without_a_material_are_given_an_empty_one():
    primitives = [{"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 0}, "material": 0}]
    told = light(materials=[{"name": "red"}], meshes=[{"primitives": primitives}], images=[{}])
    assert told["materials"] == [{"name": "red"}, {}]
    assert [p["material"] for p in told["meshes"][0]["primitives"]] == [1, 0]
    assert "images" not in told
    assert light()["meshes"][0]["primitives"][0]["material"] == 0


# --- limits --------------------------------------------------------------------------------------


def accessor(kind, count, **more):
    return {"componentType": 5126, "type": kind, "count": count} | more


SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@pytest.mark.parametrize("kind", SIZES)
def test_numbers_of_arrays_are_counted(monkeypatch, kind):
    n = SIZES[kind]
    monkeypatch.setattr(files, "MOST_NUMBERS", 9 + 5 * n)
    monkeypatch.setattr(files, "MOST_ZEROS", 5 * n)
    held = TREE["accessors"][0]
    light(accessors=[held, accessor(kind, 5)])
    light(accessors=[held, accessor(kind, 5, bufferView=0)])
    with pytest.raises(ValueError, match=f"^{6 * n} numbers without bytes"):
        light(accessors=[held, accessor(kind, 6)])
    with pytest.raises(ValueError, match=f"arrays of {9 + 6 * n} numbers"):
        light(accessors=[held, accessor(kind, 6, bufferView=0)])


def test_faces_are_counted_where_they_stand(monkeypatch):
    """Two parts, of 2 faces by corners and 3 by indices; in nodes once, twice, or never."""
    primitives = [
        {"attributes": {"POSITION": 0}},
        {"attributes": {"POSITION": 0}, "indices": 1, "mode": 4},
    ]
    arrays = [accessor("VEC3", 6, bufferView=0), accessor("SCALAR", 11, bufferView=0)]
    given = {"meshes": [{"primitives": primitives}], "accessors": arrays}
    for nodes, faces in (([{"mesh": 0}], 5), ([{"mesh": 0}, {}, {"mesh": 0}], 10), ([], 5)):
        monkeypatch.setattr(files, "MOST_FACES", faces)
        light(nodes=nodes, **given)
        monkeypatch.setattr(files, "MOST_FACES", faces - 1)
        with pytest.raises(ValueError, match=f"^{faces} triangles are not read"):
            light(nodes=nodes, **given)
    assert files._faces(primitives[1] | {"mode": 5}, arrays) == 11  # a strip
    assert files._faces(primitives[0], arrays) == 2


def test_faces_of_the_file_as_read_are_counted(tmp_path, monkeypatch):
    text = "".join(f"v {x} {y} 0\n" for x, y in SQUARE[:, :2]) + "f 1 2 3\nf 1 3 4\n"
    monkeypatch.setattr(files, "MOST_FACES", 2)
    put(tmp_path, "a.obj", text)
    monkeypatch.setattr(files, "MOST_FACES", 1)
    with pytest.raises(ValueError, match=r"^a\.obj: 2 triangles are not read here: at most 1\.$"):
        put(tmp_path, "a.obj", text)


@pytest.mark.parametrize("key", ["POSITION", "TEXCOORD_0", "NORMAL"])
def test_integers_that_stand_for_shares_are_refused_where_they_are_read(key):
    arrays = [TREE["accessors"][0], accessor("VEC2", 3, bufferView=0, normalized=True)]
    where = {"POSITION": 0} | {key: 1}
    if key == "NORMAL":
        light(accessors=arrays, meshes=[{"primitives": [{"attributes": where}]}])
        return
    with pytest.raises(ValueError, match="`normalized`"):
        light(accessors=arrays, meshes=[{"primitives": [{"attributes": where}]}])


@pytest.mark.parametrize("count", [-1, 2.0, "3"])
def test_a_count_is_a_whole_number(count):
    with pytest.raises(ValueError, match=r"^$"):
        files._count({"count": count})
    assert [files._count({"count": n}) for n in (0, 7)] == [0, 7]


def test_faces_name_vertices_that_are_there():
    for face, wrong in (([0, 1, 4], 4), ([-1, 1, 2], -1), ([0, 9, 2], 9)):
        with pytest.raises(ValueError, match=f"names vertex {wrong}, but there are 4"):
            files._check_part(Part(SQUARE, np.array([[0, 1, 3], face]), None))
    files._check_part(Part(SQUARE, np.array([[0, 1, 3]]), SQUARE[:, :2]))
    for far, what in ((0, "coordinate of a vertex"), (1, "texture coordinate")):
        v, uv = SQUARE.copy(), SQUARE[:, :2].copy()
        (v, uv)[far][1, 1] = np.nan
        with pytest.raises(ValueError, match=f"^a {what} must be finite, but is nan"):
            files._check_part(Part(v, np.array([[0, 1, 2]]), uv))


@pytest.mark.parametrize(("double", "most"), [(True, 2.8948022309329e76), (False, 1073741824.0)])
def test_places_are_at_most_so_far_away(double, most):
    with jax.enable_x64(double):
        assert files.most_coordinate() == pytest.approx(most, rel=1e-6)
        files._check_range("a", most * np.array([0.9999, -0.9999]))
        for sign in (1.0, -1.0):
            with pytest.raises(ValueError, match="must lie within"):
                files._check_range("a", np.array([0.0, sign * 1.0001 * most]))


# --- what lies beside a file ---------------------------------------------------------------------


def test_files_beside_a_mesh_are_those_in_its_folder_and_below(tmp_path):
    (tmp_path / "in" / "deep").mkdir(parents=True)
    (tmp_path / "out.bin").write_bytes(b"out")
    (tmp_path / "in" / "a.bin").write_bytes(b"here")
    (tmp_path / "in" / "deep" / "b.bin").write_bytes(b"below")
    beside = files._Beside(pathlib.Path(tmp_path, "in", "mesh.obj"))
    assert beside.file_name == "mesh.obj"
    assert beside.get(" a.bin\n") == b"here"
    assert beside["deep/b.bin"] == b"below"
    with pytest.raises(ValueError, match="does not lie beside it"):
        beside.get("../out.bin")
    with pytest.raises(ValueError, match=r"^no\.bin, which it names: the file cannot be opened"):
        beside.get("no.bin")
    name = "x" * 79 + "yz"
    with pytest.raises(ValueError, match=f"^{name[:80]}, which"):
        beside.get(name)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.obj", "v 0 0 0\n", "a.obj: "),
        ("a.obj", "hello\n", "a.obj: "),
        ("a.ply", "ply\n", "a.ply: the file is damaged or is no mesh."),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n", "a.obj: "),
    ],
)
def test_what_holds_no_triangle_is_one_sentence(tmp_path, name, text, words):
    with pytest.raises(ValueError, match=f"^{words}"):
        put(tmp_path, name, text)
