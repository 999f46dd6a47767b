"""A board as TOML, as a drawing and as Python, and back from the first two.

What a scene does not hold (who receives, where the probe is) stands in a comment of the file.
"""

from __future__ import annotations

import dataclasses
import json
import pathlib
import re
import tempfile
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from firstorder.flatland import ConstantSky, GaussianSky, PanoramaSky
from firstorder.io import flatland_to_toml, read_scene

from .board import KINDS, POINT, Board, Part, board_of

KEPT = ("receiver", "probe", "tilt", "tolerance", "window")


def read(name: str, text: str) -> Board:
    """The board of a file.

    Args:
        name: its name; the ending says what it is.
        text: what stands in it.

    Raises:
        ValueError: one sentence, if it is no scene.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, pathlib.PurePath(name).name)
        file.write_text(text, encoding="utf-8")
        board = board_of(read_scene(file))
    found = re.search(r"explorer: (\{[^}]*\})", text)
    if not found:
        return board
    try:
        kept = {key: v for key, v in json.loads(found[1]).items() if key in KEPT}
    except ValueError:
        return board
    if "window" in kept:
        kept["window"] = tuple(kept["window"])
    if not 0 <= kept.get("receiver", 0) < len(board.shapes):
        return board
    return dataclasses.replace(board, **kept)


def _kept(board: Board) -> str:
    return "explorer: " + json.dumps({key: getattr(board, key) for key in KEPT})


def to_toml(board: Board) -> str:
    """The board as TOML; it comes back to the bit."""
    return f"# {_kept(board)}\n\n{flatland_to_toml(board.scene())}"


# --- a drawing -----------------------------------------------------------------------------------


def to_svg(board: Board) -> str:
    """The board as a drawing that `firstorder.io.read_svg` reads as the same scene, to rounding.

    Raises:
        ValueError: for a smooth curve or a sky that a drawing has no words for.
    """
    low, high = _covered(board)
    size = high - low
    sky = "" if board.environment is None else f' data-sky="{_svg_sky(board.environment)}"'
    box = " ".join(repr(float(v)) for v in (*low, *size))
    thin = f'fill="none" stroke="black" stroke-width="{0.008 * float(max(size)):.3g}"'
    drawn = "\n".join(f"  {_drawn(part, float(low[1] + high[1]))}" for part in board.parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}"{sky}>\n'
        f"  <!-- {_kept(board)} -->\n  <g {thin}>\n{drawn}\n  </g>\n</svg>\n"
    )


def _covered(board: Board) -> tuple[np.ndarray, np.ndarray]:
    a, b, c, d = board.window
    points = np.concatenate([part.outline() for part in board.parts] + [[[a, c], [b, d]]])
    return points.min(0), points.max(0)


def _svg_sky(sky: Any) -> str:
    match sky:
        case ConstantSky():
            return repr(float(sky.radiance))
        case GaussianSky():
            return " ".join(repr(float(v)) for v in (sky.radiance, sky.center, sky.sigma))
        case _:
            raise ValueError("This sky has no words in a drawing: save TOML.")


def _drawn(part: Part, turned: float) -> str:
    """One element; y runs down the page, `turned` less what it is in the scene."""

    def at(p) -> tuple[str, str]:
        return repr(float(p[0])), repr(turned - float(p[1]))

    n, more = part.numbers, _attributes(part)
    if part.kind == "segment":
        (a, b), (c, d) = at(n["start"]), at(n["end"])
        return f'<line x1="{a}" y1="{b}" x2="{c}" y2="{d}"{more}/>'
    if part.kind == "arc":
        line, r = part.outline(2), repr(n["radius"])
        (a, b), (c, d) = at(line[0]), at(line[-1])
        large, clockwise = int(abs(n["sweep"]) > np.pi), int(n["sweep"] < 0.0)
        return f'<path d="M {a} {b} A {r} {r} 0 {large} {clockwise} {c} {d}"{more}/>'
    if part.kind == "circle":
        x, y = at(n["center"])
        return f'<circle cx="{x}" cy="{y}" r="{n["radius"]!r}"{more}/>'
    if part.kind == "ellipse":
        (x, y), (a, b) = at(n["center"]), n["semi"]
        turn = f"rotate({float(-np.degrees(n['tilt']))!r} {x} {y})"
        return f'<ellipse cx="{x}" cy="{y}" rx="{a!r}" ry="{b!r}" transform="{turn}"{more}/>'
    if part.kind == POINT:
        x, y = at(n["position"])
        strength = f'class="point-light" data-intensity="{n["intensity"]!r}"'
        return f'<circle cx="{x}" cy="{y}" r="0.01" {strength}/>'
    raise ValueError("A smooth curve has no shape in a drawing: save TOML.")


def _attributes(part: Part) -> str:
    """Name and material of an element."""
    found = f" id={quoteattr(part.name)}" if part.name else ""
    for key, value in part.material.items():
        words = " ".join(repr(float(v)) for v in np.atleast_1d(value))
        found += f' data-{key}="{words}"'
    return found


# --- Python --------------------------------------------------------------------------------------


def to_python(board: Board) -> str:
    """A program that makes the scene and prints E, E' and E'' at the probe."""
    things, names = [], {"Scene", "derivatives_on_shape", "irradiance", "primitive"}
    for part in board.shapes:
        cls, keys = KINDS[part.kind]
        names.add(cls.__name__)
        given = ", ".join(f"{key}={part.numbers[key]!r}" for key in keys)
        if part.kind == "curve":
            given += f", samples={part.numbers['samples']}"
        more = f", name={part.name!r}" if part.name else ""
        more += "".join(f", {key}={value!r}" for key, value in part.material.items())
        things.append(f"    primitive({cls.__name__}({given}){more}),\n")
    lights = [part.numbers for part in board.parts if part.kind == POINT]
    if lights:
        names.add("PointLights")
        at, strength = [n["position"] for n in lights], [n["intensity"] for n in lights]
        things.append(f"    points=PointLights({at!r}, {strength!r}),\n")
    if board.environment is not None:
        names.add(type(board.environment).__name__)
        things.append(f"    environment={_python_sky(board.environment)},\n")
    return (
        "from firstorder import session\n"
        f"from firstorder.flatland import {', '.join(sorted(names))}\n\n"
        "session.start()\n"
        f"scene = Scene.of(\n{''.join(things)})\n"
        "light = derivatives_on_shape(\n"
        f"    lambda at: irradiance(scene, at), scene, {board.receiver}, {board.probe!r}\n"
        ")\n"
        "print(light.value, light.first, light.second)\n"
    )


def _python_sky(sky: Any) -> str:
    match sky:
        case ConstantSky():
            return f"ConstantSky({float(sky.radiance)!r})"
        case GaussianSky():
            given = ", ".join(
                f"{key}={float(getattr(sky, key))!r}" for key in ("center", "sigma", "radiance")
            )
            return f"GaussianSky({given})"
        case PanoramaSky():
            return f"PanoramaSky({np.asarray(sky.values).tolist()!r}, {sky.smooth!r})"
        case _:
            raise ValueError("This sky is a function that has no text.")
