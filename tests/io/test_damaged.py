"""Damaged files of every kind: an answer in finite numbers, or one sentence that names the file."""

import io
import json

import numpy as np
import pytest
import trimesh

from firstorder.io import read_image, read_layers, read_mesh_uv, write_layers
from tests.io.test_images import hdr, saved

TRIALS = 100
PIXELS = np.random.default_rng(7).uniform(0.0, 2.0, (6, 9, 3)).astype(np.float32)
NUMBERS = [b"nan", b"inf", b"-1", b"1e308", b"1e400", b"4294967295", b"99999999999999999999", b""]


def hdr_file(folder):
    (folder / "a.hdr").write_bytes(hdr(PIXELS))


def exr_file(folder):
    write_layers(folder / "a.exr", {"value": PIXELS})


def png_file(folder):
    saved(folder, (100 * PIXELS).astype(np.uint8), "a.png")


def jpg_file(folder):
    saved(folder, (100 * PIXELS).astype(np.uint8), "a.jpg")


def obj_file(folder):
    corners = "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    (folder / "a.obj").write_text(f"o square\n{corners}f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")


def ball():
    shape = trimesh.creation.icosahedron()
    uv = np.asarray(shape.vertices)[:, :2] / 2.0 + 0.5
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=(255, 0, 0, 255))
    shape.visual = trimesh.visual.TextureVisuals(uv, material)
    return shape


def ply_file(folder):
    ball().export(folder / "a.ply")


def text_ply_file(folder):
    ball().export(folder / "a.ply", encoding="ascii")


def glb_file(folder):
    ball().export(folder / "a.glb")


def gltf_file(folder):
    import base64

    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(ball()))
    tree = json.loads(files["model.gltf"])
    for buffer in tree["buffers"]:
        inside = base64.b64encode(files[buffer["uri"]]).decode()
        buffer["uri"] = f"data:application/octet-stream;base64,{inside}"
    (folder / "a.gltf").write_text(json.dumps(tree))


def damaged(data, rng):
    """Bytes with some changed, cut, doubled or swapped, or with another number for one."""
    data = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        if len(data) < 8:
            break
        i, j = sorted(rng.integers(0, len(data), 2))
        match rng.integers(6):
            case 0 | 1:
                data[i] ^= 1 << rng.integers(8)
            case 2:
                del data[i : i + rng.integers(1, 20)]
            case 3:
                data[j:j] = data[i : i + 30]
            case 4:
                digits = [k for k in range(i, len(data)) if chr(data[k]).isdigit()][:1]
                for k in digits:
                    data[k : k + 1] = rng.choice(NUMBERS)
            case 5 if rng.random() < 0.3:
                del data[j:]
            case _:
                data[i : i + 4] = rng.bytes(4)
    return bytes(data)


def image_numbers(path):
    return [read_image(path)]


def layer_numbers(path):
    return [a.shape for a in read_layers(path).values()]  # layers may hold what is not finite


def mesh_numbers(path):
    found, uv = read_mesh_uv(path)
    a, b, c = np.moveaxis(np.asarray(found.vertices)[found.faces], 1, 0)
    squares = np.sum(np.cross(b - a, c - a) ** 2, -1)
    return [squares, np.zeros(0) if uv is None else uv]


@pytest.mark.parametrize(
    ("make", "name", "numbers"),
    [
        (hdr_file, "a.hdr", image_numbers),
        (exr_file, "a.exr", image_numbers),
        (exr_file, "a.exr", layer_numbers),
        (png_file, "a.png", image_numbers),
        (jpg_file, "a.jpg", image_numbers),
        (obj_file, "a.obj", mesh_numbers),
        (ply_file, "a.ply", mesh_numbers),
        (text_ply_file, "a.ply", mesh_numbers),
        (glb_file, "a.glb", mesh_numbers),
        (gltf_file, "a.gltf", mesh_numbers),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_damaged_file_gives_finite_numbers_or_one_sentence(
    tmp_path, capfd, caplog, make, name, numbers
):
    make(tmp_path)
    whole, rng = (tmp_path / name).read_bytes(), np.random.default_rng(18)
    numbers(tmp_path / name)
    refused = 0
    for _ in range(TRIALS):
        (tmp_path / name).write_bytes(damaged(whole, rng))
        try:
            found = numbers(tmp_path / name)
        except ValueError as error:
            words, refused = str(error), refused + 1
            assert words.startswith(f"{name}: ")
            assert words.endswith(".")
            assert "\n" not in words
            assert str(tmp_path) not in words
        else:
            assert all(np.all(np.isfinite(a)) for a in found)
    assert refused > TRIALS // 10
    out, err = capfd.readouterr()
    assert out == ""
    assert "".join(line for line in io.StringIO(err) if "EXR_ERR" not in line) == ""
    assert caplog.text == ""
