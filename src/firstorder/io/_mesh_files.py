"""The parts of a mesh file, by trimesh: what it is given, and what becomes of its errors.

It reads bytes that are in memory, and asks for no file but the buffers that a .gltf names. Pictures
of materials are left out beforehand: nobody looks at them here, and one may unpack to any size.
"""

from __future__ import annotations

import io
import json
import pathlib
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from firstorder.io._polygons import BadFace, faces_of, fans_only, triangles
from firstorder.io._quietly import quietly
from firstorder.io._regular import read_regular_file

# Triangles of one mesh, and numbers of all arrays in a glTF file; such as it promises without bytes
# behind them, which are zeros.
MOST_FACES = 2**24
MOST_NUMBERS = 2**27
MOST_ZEROS = 2**20

_NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TRIANGLES = 4


class Part(NamedTuple):
    """One mesh of a file, in the file's place; (u, v) at the vertices, None for none."""

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None


class _Refused(ValueError):
    """A fault of a mesh file, in words of ours."""


def read_parts(path: pathlib.Path, trimesh: Any) -> list[Part]:
    """All parts of a mesh file that have triangles.

    Args:
        path: of the file; its ending says what it is.
        trimesh: the package.

    Raises:
        ValueError: one sentence that names the file.
        OSError: if it cannot be opened.
    """
    data = read_regular_file(path)
    try:
        with quietly():
            parts = _parts(path, data, trimesh)
        if not parts:
            raise _Refused("the file holds no triangle.")
        for one in parts:
            _check_part(one)
    except (_Refused, BadFace) as error:
        raise ValueError(f"{path.name}: {error}") from None
    except Exception:  # whatever the library thinks of the bytes
        raise ValueError(f"{path.name}: the file is damaged or is no mesh.") from None
    return parts


def _parts(path: pathlib.Path, data: bytes, trimesh: Any) -> list[Part]:
    kind = path.suffix.lower()[1:]
    source = _SOURCES[kind](data)
    found = trimesh.load_scene(source, file_type=kind, resolver=_Beside(path), process=False)
    _check_count(sum(len(found.geometry[g].faces) for g in _placed(found, trimesh)))
    # Joined by trimesh, pictures of all parts would become one, and (u, v) move with them.
    meshes = (m for m in found.dump(concatenate=False) if isinstance(m, trimesh.Trimesh))
    return [_part(m) for m in meshes if len(m.faces)]


def _placed(scene: Any, trimesh: Any) -> list[str]:
    """Names of the meshes of a scene, each as often as it stands there."""
    names = [scene.graph[node][1] for node in scene.graph.nodes_geometry]
    return [name for name in names if isinstance(scene.geometry[name], trimesh.Trimesh)]


def _part(found: Any) -> Part:
    """A mesh of a file, from trimesh."""
    vertices = np.asarray(found.vertices, float).reshape(-1, 3)
    uv = getattr(found.visual, "uv", None)
    faces = _ply_faces(found, uv is not None)
    if np.ndim(uv) != 2 or len(uv) != len(vertices) or np.shape(uv)[1] < 2:
        return Part(vertices, faces, None)
    return Part(vertices, faces, np.asarray(uv, float)[:, :2])


def _ply_faces(found: Any, mapped: bool) -> np.ndarray:
    """Triangles of a mesh, those of a .ply file from its faces, of which trimesh makes fans.

    Vertices with (u, v) are no longer those of the file: faces that are no fans are refused.
    """
    faces = np.asarray(found.faces, np.int64).reshape(-1, 3)
    elements = found.metadata.get("_ply_raw", {})
    kept = elements.get("face", {}).get("data")
    names = kept if isinstance(kept, dict) else getattr(getattr(kept, "dtype", None), "names", None)
    name = next((n for n in names or () if n.startswith("vertex_ind")), None)
    polygons = faces if name is None else kept[name]
    polygons = polygons["f1"] if getattr(polygons.dtype, "names", None) else polygons
    if np.ndim(polygons) == 2 and np.shape(polygons)[1] == 3:
        return faces
    data = elements["vertex"]["data"]
    cut = triangles(list(polygons), np.stack([np.ravel(data[axis]) for axis in "xyz"], -1))
    if not cut:
        return faces
    if mapped:
        raise _Refused("a face is not convex, and has (u, v): cut it into triangles first.")
    return np.concatenate([faces_of(f, cut.get(k)) for k, f in enumerate(polygons)])


class _Beside:
    """Files beside a mesh, as trimesh asks for them: those in its folder, and below."""

    def __init__(self, path: pathlib.Path):
        self.file_name = path.name
        self._folder = path.parent.resolve()

    def get(self, name: str) -> bytes:
        """The bytes of a file; trimesh leaves out a material whose file is refused."""
        beside = (self._folder / name.strip()).resolve()
        if not beside.is_relative_to(self._folder):
            raise _Refused("the file names another that does not lie beside it.")
        called = " ".join(beside.name.split())[:80]
        try:
            return read_regular_file(beside)
        except (ValueError, OSError) as error:
            words = str(error).removeprefix(f"{beside}: ").removeprefix(f"{beside.name}: ")
        raise _Refused(f"{called}, which it names: {words}")

    __getitem__ = get


# --- what may be wrong in numbers ----------------------------------------------------------------


def _check_part(part: Part) -> None:
    wrong = part.faces[(part.faces < 0) | (part.faces >= len(part.vertices))]
    if wrong.size:
        raise _Refused(f"a face names vertex {wrong[0]}, but there are {len(part.vertices)}.")
    _check_range("a coordinate of a vertex", part.vertices)
    if part.uv is not None:
        _check_range("a texture coordinate", part.uv)


def _check_range(what: str, numbers: np.ndarray) -> None:
    """Refuses what is not finite, or too far away for the session's precision."""
    if not np.all(np.isfinite(numbers)):
        raise _Refused(f"{what} must be finite, but is {numbers[~np.isfinite(numbers)][0]}.")
    furthest = most_coordinate()
    far = np.abs(numbers) > furthest
    if np.any(far):
        raise _Refused(f"{what} must lie within {furthest:g} of 0, but is {numbers[far][0]:g}.")


def most_coordinate() -> float:
    """How far from 0 a vertex may lie: the square of an area, a fourth power, must be finite.

    A quarter of the fourth root of the greatest number: the longest edge of a box of that half
    width is 2 sqrt(3) = 3.5 of it, and twice the area of a triangle on such edges below its square.

    Example:
        >>> from firstorder.io._mesh_files import most_coordinate
        >>> print(f"{most_coordinate():.0e}")
        3e+76
    """
    return 0.25 * float(jnp.finfo(jnp.result_type(float)).max) ** 0.25


def _check_count(faces: int) -> None:
    if faces > MOST_FACES:
        raise _Refused(f"{faces} triangles are not read here: at most {MOST_FACES}.")


# --- what trimesh is given -----------------------------------------------------------------------


def _obj_source(data: bytes) -> io.StringIO:
    """Text in UTF-8, or else in Latin-1, in which every byte is a letter; its faces are fans."""
    text = _decoded(data)
    try:
        return io.StringIO(fans_only(text))
    except BadFace:
        raise
    except (ValueError, IndexError):  # trimesh will say that it is none
        return io.StringIO(text)


def _ply_source(data: bytes) -> io.BytesIO:
    """The header may hold comments in either encoding; numbers follow."""
    head, end, rest = data.partition(b"end_header")
    return io.BytesIO(_decoded(head).encode() + end + rest)


def _gltf_source(data: bytes) -> io.BytesIO:
    return io.BytesIO(_light_tree(data))


def _glb_source(data: bytes) -> io.BytesIO:
    """The tree of a binary file is its first chunk, behind five numbers of four bytes."""
    end = 20 + int.from_bytes(data[12:16], "little")
    if data[16:20] != b"JSON" or end > len(data):
        raise ValueError
    tree = _light_tree(data[20:end])
    tree += b" " * (-len(tree) % 4)
    length, own = (n.to_bytes(4, "little") for n in (20 + len(tree) + len(data) - end, len(tree)))
    return io.BytesIO(data[:8] + length + own + b"JSON" + tree + data[end:])


_SOURCES = {"obj": _obj_source, "ply": _ply_source, "gltf": _gltf_source, "glb": _glb_source}


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _light_tree(data: bytes) -> bytes:
    """The tree of a glTF file without its pictures, if it promises nothing too large."""
    tree = json.loads(data)
    arrays = tree.get("accessors", [])
    sizes = [_count(a) * _NUMBERS[a["type"]] for a in arrays]
    zeros = sum(n for n, a in zip(sizes, arrays, strict=True) if "bufferView" not in a)
    if zeros > MOST_ZEROS:
        raise _Refused(f"{zeros} numbers without bytes behind them are more than {MOST_ZEROS}.")
    if sum(sizes) > MOST_NUMBERS:
        raise _Refused(f"arrays of {sum(sizes)} numbers are not read here: at most {MOST_NUMBERS}.")
    parts = [p for m in tree.get("meshes", []) for p in m["primitives"]]
    for part in parts:
        _check_unscaled(part["attributes"], arrays)
    faces = [sum(_faces(p, arrays) for p in m["primitives"]) for m in tree.get("meshes", [])]
    nodes = tree.get("nodes", [])
    _check_count(max(sum(faces), sum(faces[n["mesh"]] for n in nodes if "mesh" in n)))
    # trimesh keeps (u, v) of what has a material alone.
    tree["materials"] = [*tree.get("materials", []), {}]
    for part in parts:
        part.setdefault("material", len(tree["materials"]) - 1)
    return json.dumps({key: value for key, value in tree.items() if key != "images"}).encode()


def _check_unscaled(attributes: Any, arrays: Any) -> None:
    """Refuses integers that stand for shares of the largest, which trimesh takes for metres."""
    read = (attributes[key] for key in ("POSITION", "TEXCOORD_0") if key in attributes)
    if any(arrays[k].get("normalized") for k in read):
        raise _Refused("an array whose integers are `normalized` is not read here.")


def _count(array: Any) -> int:
    count = array["count"]
    if not isinstance(count, int) or count < 0:
        raise ValueError
    return count


def _faces(primitive: Any, arrays: Any) -> int:
    """How many faces a part of a mesh has: each three numbers, or as many as in a strip."""
    corners = _count(arrays[primitive.get("indices", primitive["attributes"]["POSITION"])])
    return corners // 3 if primitive.get("mode", _TRIANGLES) == _TRIANGLES else corners
