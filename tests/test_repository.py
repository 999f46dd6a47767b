"""What the repository keeps."""

import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).parents[1]


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="an archive has no list of files")
def test_nothing_that_is_generated_is_kept():
    """Arrays and what figures write can be made again; only small pictures are kept."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True)
    files = [pathlib.Path(name) for name in listed.stdout.decode().split("\0") if name]
    assert "pyproject.toml" in map(str, files)
    made = {".npz", ".npy", ".exr", ".hdr", ".ipynb"}
    assert [f for f in files if f.suffix in made or "out" in f.parts] == []
