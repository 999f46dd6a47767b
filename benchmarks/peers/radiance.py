"""Radiance's programs as pyradiance ships them, and scenes of ours in its words.

`rtrace` draws by a fixed sequence, so two runs with the same rays have common random numbers.
"""

from __future__ import annotations

import importlib.util
import os
import pathlib
import subprocess
from collections.abc import Iterable

import numpy as np

from firstorder.io import AmbientRecords, read_ambient
from firstorder.space import Scene
from firstorder.space.scene import FRONT

# The canonical cube's faces as corners, seen counter-clockwise from outside.
FACES = np.array([
    [(-1, -1, -1), (-1, 1, -1), (1, 1, -1), (1, -1, -1)],
    [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
    [(-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)],
    [(-1, 1, -1), (-1, 1, 1), (1, 1, 1), (1, 1, -1)],
    [(-1, -1, -1), (-1, -1, 1), (-1, 1, 1), (-1, 1, -1)],
    [(1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1)],
], float)  # fmt: skip
SQUARE = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)


def to_radiance(scene: Scene, lamp: str = "light") -> str:
    """A scene of rectangles, boxes and balls as the text that `oconv` takes.

    Args:
        scene: of one band; lamps are black and shine from their fronts.
        lamp: "light" is sampled by itself; a "glow" is met by gathered rays only.

    Raises:
        ValueError: for a shape of another kind.
    """
    lines, number = [], 0
    for group in scene.groups:
        for center, axes in zip(np.asarray(group.center), np.asarray(group.axes), strict=True):
            emission = float(scene.material.emission[number, FRONT])
            albedo = float(scene.material.albedo[number, FRONT])
            lines += _material(number, emission, albedo, lamp)
            lines += _surfaces(number, type(group).__name__, center, axes)
            number += 1
    return "\n".join(lines) + "\n"


def _material(number: int, emission: float, albedo: float, lamp: str) -> list[str]:
    if emission > 0.0:
        rgb = " ".join(3 * [f"{emission:.9g}"])
        ending = f"4 {rgb} 0" if lamp == "glow" else f"3 {rgb}"
        return [f"void {lamp} m{number} 0 0 {ending}"]
    return [f"void plastic m{number} 0 0 5 {' '.join(3 * [f'{albedo:.9g}'])} 0 0"]


def _surfaces(number: int, kind: str, center: np.ndarray, axes: np.ndarray) -> list[str]:
    if kind == "Ellipsoids":
        radius = np.linalg.norm(axes, axis=0)
        if not np.allclose(axes.T @ axes, radius[0] ** 2 * np.eye(3), rtol=1e-9):
            raise ValueError("Argument `scene` must have balls here, but has an ellipsoid.")
        return [f"m{number} sphere s{number} 0 0 4 {_words(center)} {radius[0]:.9g}"]
    if kind not in ("Rectangles", "Boxes"):
        raise ValueError(f"Argument `scene` must have rectangles, boxes and balls, but has {kind}.")
    faces = FACES if kind == "Boxes" else SQUARE[None]
    return [
        f"m{number} polygon p{number}.{k} 0 0 12 {_words(face @ axes.T + center)}"
        for k, face in enumerate(faces)
    ]


def _words(numbers: np.ndarray) -> str:
    return " ".join(f"{a:.9g}" for a in np.ravel(numbers))


# --- its programs --------------------------------------------------------------------------------


def run(*command: object, given: bytes = b"") -> bytes:
    """What one of its programs prints."""
    found = importlib.util.find_spec("pyradiance")
    assert found is not None, "whoever calls looks whether it is there"
    assert found.origin is not None
    package = pathlib.Path(found.origin).parent
    paths = {"RAYPATH": str(package / "lib")}
    paths["PATH"] = f"{package / 'bin'}{os.pathsep}{os.environ['PATH']}"
    program = [str(package / "bin" / str(command[0])), *map(str, command[1:])]
    done = subprocess.run(program, input=given, capture_output=True, env=os.environ | paths)
    if done.returncode:
        raise RuntimeError(f"{command[0]}: {done.stderr.decode().strip()}")
    return done.stdout


def compiled(scene: Scene, folder: pathlib.Path, name: str = "world", lamp: str = "light"):
    """The octree of a scene, as a file in a folder."""
    text, octree = folder / f"{name}.rad", folder / f"{name}.oct"
    text.write_text(to_radiance(scene, lamp), encoding="utf-8")
    octree.write_bytes(run("oconv", text))
    return octree


def irradiance(octree: pathlib.Path, places: Iterable, *options: object) -> np.ndarray:
    """Irradiance at places of the floor, facing up [W/m^2]."""
    given = "".join(f"{x:.9g} {y:.9g} 0 0 0 1\n" for x, y in places).encode()
    lines = run("rtrace", "-h", "-I", *options, octree, given=given).decode().splitlines()
    return np.array([float(line.split()[0]) for line in lines])


def records(ambient: pathlib.Path) -> AmbientRecords:
    """The records of an ambient file, through its text."""
    text = ambient.with_suffix(".txt")
    text.write_bytes(run("lookamb", "-h", "-d", ambient))
    return read_ambient(text)
