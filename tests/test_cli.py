import os
import subprocess
import sys

import equinox as eqx
import numpy as np
import pytest

import firstorder
from firstorder.cli import Jet, main
from firstorder.flatland import Scene, box, primitive
from firstorder.io import write_flatland


def test_a_jet_is_printed_for_every_step_and_equals_differences(capsys):
    assert main(["jet", "--edge", "0.2", "--at", "0.35", "0.05"]) == 0
    head, *lines, _ = capsys.readouterr().out.splitlines()
    path = Jet(edge=0.2).path()
    assert [line.split()[0] for line in lines][0::8] == ["source", "curvature"]
    assert len(lines) == len(path.events) + 1
    assert head.split()[1] == "value"
    h = 1e-3
    x, theta = np.meshgrid(0.35 + h * np.arange(-1, 2), 0.05 + h * np.arange(-1, 2), indexing="ij")
    B = np.asarray(eqx.filter_jit(lambda f: f(x, theta))(path.light))
    gradient = (B[2, 1] - B[0, 1]) / (2 * h), (B[1, 2] - B[1, 0]) / (2 * h)
    bend = (B[2, 1] - 2 * B[1, 1] + B[0, 1]) / h**2, (B[1, 2] - 2 * B[1, 1] + B[1, 0]) / h**2
    mixed = (B[2, 2] - B[2, 0] - B[0, 2] + B[0, 0]) / (4 * h**2)
    shown = [float(n) for n in lines[-1].split()[1:]]
    exact = [B[1, 1], *gradient, bend[0], mixed, bend[1]]
    np.testing.assert_allclose(shown, exact, rtol=2e-3)  # differences err by h^2 / sigma^2


def test_the_table_shows_errors_and_refusals(capsys):
    assert main(["table", "warp"]) == 0
    head, line, *reasons = capsys.readouterr().out.splitlines()
    assert head.split() == ["value", "gradient", "hessian", "spectrum", "covariance", "wavelet"]
    assert line.split()[:2] == ["warp", "equal"]
    assert "refused: warp has no simple Fourier formula (warp / spectrum)" in reasons


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["jet", "--d", "-1"], "Argument `d` must not be negative, but is -1.0."),
        (["jet", "--roughness", "0"], "Argument `roughness` must be positive, but is 0.0."),
        (["jet", "--d-after", "-1"], "Argument `d_after` must not be negative, but is -1.0."),
        (["jet", "--edge", "nan"], "Argument `edge` must be finite, but is nan."),
        (
            ["table", "foo"],
            "Argument `names` must begin names that `table all` prints, but has 'foo'.",
        ),
    ],
)
def test_a_bad_argument_is_one_sentence_and_exit_code_2(capsys, arguments, sentence):
    assert main(arguments) == 2
    assert capsys.readouterr().err == sentence + "\n"


def test_a_command_that_does_not_exist_is_exit_code_2(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["paint"])
    assert stop.value.code == 2


@pytest.mark.parametrize("asked", ["--help", "--version", "scene --help"])
def test_help_is_there_before_jax_is_imported(asked):
    program = f"""
import sys
from firstorder.cli import main
try:
    main({asked.split()!r})
except SystemExit as stop:
    assert not stop.code
print(sorted({{"jax", "numpy", "matplotlib", "sympy"}} & set(sys.modules)), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "[]\n"
    assert "firstorder" in done.stdout


def test_the_version_is_that_of_the_package(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"firstorder {firstorder.__version__}\n"


def test_a_scene_is_drawn_with_its_numbers_beside_it(capsys, tmp_path):
    out, toml = tmp_path / "b.png", tmp_path / "b.toml"
    arguments = ["scene", "scene_b", "--out", str(out), "--toml", str(toml), "--samples", "21"]
    assert main(arguments) == 0
    shown = capsys.readouterr()
    assert "the numbers are in b_floor.csv." in shown.err
    assert "firstorder agreements scene_b" in shown.err
    name, head, *rows = shown.out.splitlines()
    assert name == "floor:"
    assert head.split() == ["arc", "x", "y", "E", "E'", "E''"]
    assert len(rows) == 11
    assert out.read_bytes()[:4] == b"\x89PNG"
    columns = np.genfromtxt(tmp_path / "b_floor.csv", delimiter=",", names=True)
    middle = columns[10]
    both = 0.5 / np.hypot(0.5, 1.0) - 0.2 / np.hypot(0.2, 0.5)
    assert middle["E"] == pytest.approx(2 * both, rel=1e-13)
    assert abs(middle["dE"]) < 1e-13
    # ... and what was written is the same scene
    assert main(["scene", str(toml), "--samples", "21"]) == 0
    assert capsys.readouterr().out.splitlines() == [name, head, *rows]


def test_all_bounces_of_a_furnace_are_waited_for_in_words(capsys, tmp_path):
    walls = box((0.0, 0.0), (1.0, 1.0), inward=True)
    furnace = Scene.of(primitive(walls, name="walls", emission=0.5, albedo=0.5))
    write_flatland(tmp_path / "furnace.toml", furnace)
    command = ["scene", str(tmp_path / "furnace.toml"), "--indirect"]
    assert main([*command, "--samples", "8", "--receivers", "walls"]) == 0
    shown = capsys.readouterr()
    assert shown.err == "Solving for the light of all bounces between 4 shapes ...\n"
    E = [float(line.split()[3]) for line in shown.out.splitlines()[2:]]
    np.testing.assert_allclose(E, 2.0, rtol=1e-5)  # L = 1 everywhere


def test_a_drawing_is_a_scene_and_its_dark_shapes_are_receivers(capsys, tmp_path):
    file = tmp_path / "d.svg"
    file.write_text(
        '<svg><line id="lamp" class="light" x1="1" x2="-1" y1="-1" y2="-1"/>'
        '<path id="ground" stroke="white" d="M -1 0 H 1"/></svg>'
    )
    assert main(["scene", str(file), "--samples", "3"]) == 0
    name, _, *rows = capsys.readouterr().out.splitlines()
    assert name == "ground:"
    assert float(rows[1].split()[3]) == pytest.approx(2**0.5, rel=1e-4)


def test_the_scenes_that_ship_are_listed(capsys):
    assert main(["scene", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "scene_a      A line light over a line receiver, nothing between them."
    assert len(lines) > 10


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nothing"], "nothing: a scene must be a .toml or .svg file."),
        (["no.toml"], "no.toml: the file cannot be opened (no such file or directory)."),
        (["scene_a", "--samples", "0"], "Argument `samples` must be positive, but is 0."),
        (
            ["scene_a", "--out", "a.bmp"],
            "Argument `out` must end in .png or .svg or .pdf, but is a.bmp.",
        ),
        (
            ["scene_a", "--receivers", "roof"],
            "Argument `name` must be one of floor, lamp, but is 'roof'.",
        ),
    ],
)
def test_a_bad_scene_is_one_sentence_and_exit_code_2(capsys, arguments, sentence):
    assert main(["scene", *arguments]) == 2
    assert capsys.readouterr().err == sentence + "\n"


def test_what_cannot_be_written_is_one_sentence(capsys, tmp_path):
    (tmp_path / "file").touch()
    for out in (tmp_path / "file" / "b.toml", tmp_path):
        assert main(["scene", "scene_a", "--toml", str(out)]) == 2
        (words,) = capsys.readouterr().err.splitlines()
        assert words.startswith(str(tmp_path))


def test_receivers_of_almost_the_same_name_have_files_of_their_own(capsys, tmp_path):
    names, file = ("wall 1", "wall.1", "wall_1"), tmp_path / "d.svg"
    walls = (f'<path id="{n}" stroke="white" d="M 0 {y} H 1"/>' for y, n in enumerate(names))
    file.write_text(f"<svg>{''.join(walls)}</svg>")
    assert main(["scene", str(file), "--samples", "3", "--out", str(file.with_suffix(".png"))]) == 0
    assert len(list(tmp_path.glob("*.csv"))) == 3


SPACE = """dimensions = 3
[[shape]]
kind = "sphere"
center = [0, 0, 0.5]
radius = 0.5
albedo = 0.6
[[shape]]
kind = "rectangle"
name = "lamp"
center = [0, -1, 2.5]
u = [0, 0.5, 0]
v = [0.5, 0, 0]
emission = 5.0
[camera]
eye = [0, -4, 2]
look_at = [0, 0, 0.4]
gamma = 2.0
"""


def test_a_scene_of_space_is_rendered(tmp_path, capsys):
    pytest.importorskip("OpenEXR")
    file, out = tmp_path / "ball.toml", tmp_path / "ball.exr"
    file.write_text(SPACE)
    size = ["--width", "16", "--height", "16", "--nodes", "3", "--out", str(out)]
    assert main(["render", str(file), *size]) == 0
    assert out.exists()
    assert out.with_suffix(".png").exists()
    assert len(list((tmp_path / "ball_tiles").glob("pass*"))) == 1
    capsys.readouterr()
    file.write_text(SPACE.replace("5.0", "6.0"))
    assert main(["render", str(file), *size]) == 2
    assert "tiles of this image" in capsys.readouterr().err


def test_a_missing_package_is_said_before_the_work(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    file = tmp_path / "ball.toml"
    file.write_text(SPACE)
    assert main(["render", str(file), "--out", str(tmp_path / "ball.exr")]) == 2
    assert "ball.exr: .exr files need the package OpenEXR" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [file]


def test_tiles_of_another_mesh_under_the_same_name_are_refused(tmp_path, capsys):
    for package in ("OpenEXR", "trimesh", "embreex"):
        pytest.importorskip(package)
    file, out = tmp_path / "piece.toml", tmp_path / "piece.exr"
    mesh = tmp_path / "piece.obj"
    file.write_text(SPACE + '[[mesh]]\nfile = "piece.obj"\nalbedo = 0.5\n')
    corners = "v -1 0 1\nv 1 0 1\nv 0 1 {}\nf 1 2 3\n"
    mesh.write_text(corners.format(1))
    size = ["--width", "8", "--height", "8", "--nodes", "2"]
    command = ["render", str(file), *size, "--out", str(out)]
    assert main(command) == 0
    assert main(command) == 0  # nothing has changed: the tiles are taken
    capsys.readouterr()
    mesh.write_text(corners.format(2))
    assert main(command) == 2
    assert "tiles of this image" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (["--out", "a.png"], "Argument `out` must end in .exr, but is a.png."),
        (["--width", "0"], "Argument `width` must be positive, but is 0."),
        ([], "must be a .toml file that says `dimensions = 3`, but is flat.toml."),
    ],
)
def test_what_cannot_be_rendered_is_one_sentence(tmp_path, capsys, more, sentence):
    (tmp_path / "flat.toml").write_text("dimensions = 2")
    assert main(["render", str(tmp_path / "flat.toml"), *more]) == 2
    assert sentence in capsys.readouterr().err


def test_a_table_of_agreements_is_printed_and_a_bad_place_is_one_sentence(capsys):
    assert main(["agreements", "scene_c", "--quick"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("scene_c at (0.63, 0) m")
    assert max(map(len, lines)) <= 100
    assert main(["agreements", "scene_b", "--s", "2"]) == 2
    assert capsys.readouterr().err == "Argument `s` must lie in [0, 1], but is 2.0.\n"


OWN = """
import sympy
from firstorder.symbolic import event
from firstorder.transport import Mirror, Travel
from firstorder.fields import gaussian

x, theta, f = sympy.symbols("x theta f")
lens = event({theta: theta - x / f}, parameters={f: 0.5}, name="lens")
seen = gaussian((0.0, 0.0), (1.0, 1.0)) >> lens >> Mirror()
"""


def test_events_of_a_file_are_explained_and_judged(capsys, tmp_path):
    file = tmp_path / "own.py"
    file.write_text(OWN)
    assert main(["explain", str(file), "--at", "0.1", "0.2"]) == 0
    told = capsys.readouterr().out
    assert "L(x, theta + 2*x)" in told
    assert "at x = 0.1, theta = 0.2: value" in told
    assert main(["check", str(file)]) == 0
    assert "lens: sound" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "name", "sentence"),
    [
        ("a = 1", "own.py", "own.py has no variable that is an event"),
        ("a = 1", "own.txt", "`source` must be a .py file, but is own.txt"),
    ],
)
def test_a_file_without_events_is_one_sentence(capsys, tmp_path, text, name, sentence):
    file = tmp_path / name
    file.write_text(text)
    assert main(["explain", str(file)]) == 2
    assert sentence in capsys.readouterr().err


def test_a_file_without_anything_to_judge_is_not_sound(capsys, tmp_path):
    (tmp_path / "own.py").write_text(
        "from firstorder.fields import gaussian\nfrom firstorder.transport import Mirror\n"
        "seen = gaussian((0.0, 0.0), (1.0, 1.0)) >> Mirror()"
    )
    assert main(["check", str(tmp_path / "own.py")]) == 2
    assert "own.py has no variable that is an event or a chain." in capsys.readouterr().err


ROWS = """
import math

from firstorder.ledger import ROUTES, Check, Row, na

OUT = dict.fromkeys(ROUTES, na("scale"))
SINE = Check(lambda: abs(math.sin(1e-3) - 1e-3), 1e-9)
ROWS = [
    Row("P.1", "approximation", statement="A sine.", **OUT | {"brute_force": SINE}),
    Row("P.2", "definition", statement="A name.", **OUT),
]
"""


def test_a_ledger_of_ones_own_is_judged(capsys, tmp_path):
    (tmp_path / "paper.py").write_text(ROWS)
    assert main(["ledger", str(tmp_path)]) == 0
    assert "P: 1 pass, 1 stated" in capsys.readouterr().out
    assert main(["ledger", str(tmp_path), "P.1", "--json", str(tmp_path / "out.json")]) == 0
    assert "A sine." in (tmp_path / "out.json").read_text()
    assert "A name." not in capsys.readouterr().out
    (tmp_path / "paper.py").write_text(ROWS.replace("1e-9", "1e-12"))
    (tmp_path / "paper.py").rename(tmp_path / "stricter.py")
    assert main(["ledger", str(tmp_path)]) == 1
    assert "P.1 fails by brute_force" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "arguments", "sentence"),
    [
        ("", [], "No Python file of {} has `ROWS`."),
        ("x =", [], "paper.py cannot be imported (SyntaxError: "),
        (ROWS, ["Q"], "Argument `equations` matches no row: Q."),
        (ROWS, ["--jobs", "0"], "Argument `jobs` must be positive, but is 0."),
    ],
)
def test_a_bad_ledger_is_one_sentence_and_exit_code_2(capsys, tmp_path, text, arguments, sentence):
    (tmp_path / "paper.py").write_text(text)
    assert main(["ledger", str(tmp_path), *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(sentence.format(tmp_path.name))


OURS = "-c", "from firstorder.cli import main; raise SystemExit(main())"


@pytest.mark.parametrize(
    "command",
    [
        (*OURS, "scene", "list"),
        (*OURS, "--help"),
        (*OURS, "--version"),
        ("-m", "figures", "--list"),
        ("-m", "gallery", "--list"),
        ("-m", "derivations", "E11.1"),
    ],
    ids=" ".join,
)
def test_a_reader_that_stops_is_no_error(command):
    """Python keeps lines back until the end, unless PYTHONUNBUFFERED says otherwise."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, *command],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": ""},
    )
    os.close(writing)
    assert done.stderr == ""
    assert done.returncode == 1


def test_a_python_file_that_is_none_is_said_with_its_line(tmp_path, capsys):
    source = tmp_path / "mine.py"
    source.write_text("x = 1\ndef (:\n")
    for command in ("explain", "check"):
        assert main([command, str(source)]) == 2
        assert capsys.readouterr().err == "mine.py, line 2: invalid syntax.\n"


def test_a_module_that_is_none_is_said_and_not_the_file_that_imports_it(
    tmp_path, capsys, monkeypatch
):
    (tmp_path / "broken_part.py").write_text("x = 1\n\ndef (:\n")
    source = tmp_path / "mine.py"
    source.write_text("import broken_part\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert main(["explain", str(source)]) == 2
    assert capsys.readouterr().err == "broken_part.py, line 3: invalid syntax.\n"
