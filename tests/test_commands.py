"""Every command that the README, a page or an example's head shows runs as shown."""

import pathlib
import re

import pytest

from firstorder.cli import main

ROOT = pathlib.Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *DOCS.glob("*.md"), *DOCS.glob("tasks/*.md")]
SCENES = [f for f in (ROOT / "examples").iterdir() if f.suffix in (".toml", ".svg")]
# At full size a render takes minutes.
SMALL = {
    "render": ["--width", "8", "--height", "8", "--nodes", "2"],
    "agreements": ["--quick"],
}


def shown():
    """Commands in blocks of code, and in comments of scenes."""
    for page in PAGES:
        for block in re.findall(r"```(?:bash)?\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            yield from re.findall(r"^firstorder (.*?)(?: +#.*)?$", block, re.MULTILINE)
    for scene in SCENES:
        yield from re.findall(
            r"firstorder ((?:scene|render) .*?)(?: -->)?$", scene.read_text("utf-8"), re.MULTILINE
        )


COMMANDS = sorted(set(shown()))


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_runs_as_shown(command, tmp_path, monkeypatch, capsys):
    for package in ("OpenEXR", "trimesh", "svgelements"):
        pytest.importorskip(package)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    words = command.split()
    assert main([*words, *SMALL.get(words[0], [])]) == 0
    assert capsys.readouterr().out
    written = [words[k + 1] for k, word in enumerate(words) if word in ("--out", "--toml")]
    assert [f for f in written if not (tmp_path / f).exists()] == []


def test_every_scene_among_the_examples_shows_its_command():
    for scene in SCENES:
        assert any(f"examples/{scene.name}" in command for command in COMMANDS)
