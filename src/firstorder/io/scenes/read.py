"""A scene from a file, whatever its format."""

from __future__ import annotations

import os
import pathlib

from firstorder.flatland.scene import Scene
from firstorder.io.scenes.flatland_toml import read_flatland
from firstorder.io.scenes.space_toml import is_space
from firstorder.io.svg.reader import read_svg


def read_scene(path: str | os.PathLike[str], *, outside: bool = False) -> Scene:
    """Reads a scene of flatland from a .toml or .svg file; `read_space` reads one of space.

    The keys of TOML stand at the head of `firstorder.io.scenes.flatland_toml`, the classes and
    attributes of SVG at that of `firstorder.io.svg.reader`.

    Args:
        path: the file; its ending says what it is.
        outside: whether files that it names may lie outside of its folder.

    Raises:
        ValueError: one sentence that names the file, the line and the element, if it is no scene.
        FileNotFoundError: one sentence that names the path, if there is no such file.
        ModuleNotFoundError: without the extra that reads what the file holds.

    Example:
        >>> from firstorder.io import read_scene
        >>> read_scene("scene.png")
        Traceback (most recent call last):
        ValueError: scene.png: a scene must be a .toml or .svg file.
    """
    path = pathlib.Path(path)
    kind = path.suffix.lower()
    if kind not in (".toml", ".svg"):
        raise ValueError(f"{path.name}: a scene must be a .toml or .svg file.")
    if is_space(path):
        raise ValueError(
            f"{path.name}: the scene is one of space (`dimensions = 3`): read it by read_space."
        )
    return read_svg(path) if kind == ".svg" else read_flatland(path, outside=outside)
