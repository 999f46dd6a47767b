"""Commands on scenes: their light drawn and written, agreements, images."""

from __future__ import annotations

import pathlib
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

import firstorder

PICTURES = (".png", ".svg", ".pdf")


@dataclass(frozen=True)
class Scene:
    """Draw a flatland scene, and what light does along its receivers; describe one of space.

    The page shows the scene and, for each receiver, irradiance and its first and second derivative
    by arc length, exact across shadow edges. Beside it come the numbers as CSV, one file for each
    receiver; a few of them are printed. Three bands are drawn in colour. A TOML file that says
    `dimensions = 3` is a scene of space: its shapes, meshes, sky and camera are listed.
    """

    source: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="SCENE")]
    """A .toml or .svg file, or a name that `firstorder scene list` prints."""
    out: pathlib.Path | None = None
    """The picture (.png, .svg, .pdf); none if left out."""
    toml: pathlib.Path | None = None
    """Where to write the scene as TOML, if anywhere."""
    receivers: tuple[str, ...] = ()
    """Names of the receivers; `floor`, if left out, or else all that does not emit."""
    samples: int = 201
    """Samples along each receiver."""
    indirect: bool = False
    """All bounces between diffuse surfaces, and not direct light alone."""
    outside: bool = False
    """Read files that the scene names outside of its folder, too."""

    def run(self) -> int:
        """Read, measure, write."""
        from firstorder.flatland.library import _scenes as scenes
        from firstorder.io import is_space, read_scene, write_csv, write_flatland

        if is_space(self.source):
            return self._space()
        if self.source == "list":
            print(
                *(f"{name:12} {scenes.describe_scene(name)}" for name in scenes.scene_names()),
                sep="\n",
            )
            return 0
        if self.samples < 1:
            raise ValueError(f"Argument `samples` must be positive, but is {self.samples}.")
        if self.out is not None and self.out.suffix.lower() not in PICTURES:
            raise ValueError(
                f"Argument `out` must end in {' or '.join(PICTURES)}, but is {self.out.name}."
            )
        known = self.source in scenes.scene_names()
        scene = (
            scenes.named_scene(self.source)
            if known
            else read_scene(self.source, outside=self.outside)
        )
        if self.toml is not None:
            write_flatland(self.toml, scene)
        curves, tables = self._curves(scene), []
        for word, (name, curve) in zip(_file_words(curves), curves.items(), strict=True):
            _print_curve(name, curve)
            if self.out is not None:
                tables.append(f"{self.out.stem}_{word}.csv")
                write_csv(self.out.with_name(tables[-1]), curve)
        if self.out is not None:
            self._draw(scene, curves)
            _tell(_words(self.source, self.out, tables))
        return 0

    def _space(self) -> int:
        """List what is in a scene of space."""
        from firstorder.io import describe_space, read_space, write_space

        if self.out is not None or self.receivers or self.indirect:
            raise ValueError(
                "Arguments `out`, `receivers` and `indirect` are for scenes of flatland, "
                f"but {pathlib.Path(self.source).name} is one of space."
            )
        space = read_space(self.source, outside=self.outside)
        if self.toml is not None:
            write_space(self.toml, space)
        print(describe_space(space))
        return 0

    def _curves(self, scene) -> dict:
        """E, E' and E'' by receiver."""
        from firstorder.flatland import irradiance
        from firstorder.plotting import curve_of

        def light(at):
            return irradiance(scene, at)

        if self.indirect:
            from firstorder.flatland.bounces.radiosity import solve_radiosity

            shapes = f"{scene.count} shape{'s' * (scene.count > 1)}"
            _tell(f"Solving for the light of all bounces between {shapes} ...")
            light = solve_radiosity(scene).irradiance
        names = self.receivers or _receivers(scene)
        return {name: curve_of(scene, name, light, self.samples) for name in names}

    def _draw(self, scene, curves: dict) -> None:
        from firstorder.io import atomic_write
        from firstorder.plotting import house_style, scene_report

        title = pathlib.Path(self.source).name
        words = "all bounces" if self.indirect else "direct light"
        with house_style(), atomic_write(self.out) as part:
            scene_report(scene, curves, title, words).savefig(part)


@dataclass(frozen=True)
class Agreements:
    """Print what one receiver of a flatland scene gets, found in independent ways, side by side.

    Irradiance with two derivatives, its spectrum, the wedge of its shadows; by intervals, edges,
    laws, 50 digits, rays, a cached record, paths and photons. Exit code 1 if two of them differ.
    """

    source: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="SCENE")]
    """A .toml or .svg file, or a name that `firstorder scene list` prints."""
    receiver: str = ""
    """Name of the shape on which the receiver lies; `floor`, if left out, or the first dark one."""
    s: float = 0.63
    """Where on it, from 0 to 1."""
    quick: bool = False
    """Few rays, paths and photons."""
    seed: int = 0
    """Of the random numbers."""
    outside: bool = False
    """Read files that the scene names outside of its folder, too."""

    def run(self) -> int:
        """Measure and print."""
        from firstorder._argument_checks import check_between
        from firstorder.checks.agreements import FULL, QUICK, agreements
        from firstorder.flatland import receiver
        from firstorder.flatland.library import _scenes as scenes
        from firstorder.io import read_scene

        check_between("s", self.s, 0.0, 1.0)
        known = self.source in scenes.scene_names()
        scene = (
            scenes.named_scene(self.source)
            if known
            else read_scene(self.source, outside=self.outside)
        )
        number = scene.named(self.receiver or _receivers(scene)[0])[0]
        at = receiver(scene, number, self.s)
        sizes = QUICK if self.quick else FULL
        table = agreements(scene, at, sizes=sizes, seed=self.seed, name=self.source)
        print(table)
        return int(not table.agrees)


@dataclass(frozen=True)
class Render:
    """Render a scene of space: an .exr file with all layers, and a tone-mapped .png beside it.

    Both are in colour if the scene has three bands, red, green and blue.

    Direct light of rectangles that emit and of the sky, soft shadows, diffuse and glossy lobes.
    Layers: `value`; its gradient `grad.u`, `grad.v` per unit of the image, of which moving shadows
    make `shadow.u`, `shadow.v`; R07's `SV`, `DV`, `CV`, `CDV` and each by `.diffuse` and `.glossy`;
    `index`, `distance`, `cosine`, `curvature`. Killed at any time, the same command goes on,
    to the same bytes if versions and flags of the compiler are the same.
    """

    source: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="SCENE")]
    """A .toml file that says `dimensions = 3`, with a camera and a lamp or a sky."""
    out: pathlib.Path = pathlib.Path("render.exr")
    """The .exr file; the .png has the same name."""
    width: int = 512
    """Of the image, in pixels; the camera's u goes from -1 to 1 across."""
    height: int = 512
    """Of the image, in pixels."""
    passes: int = 1
    """Over the image, each with other nodes of the light; the file is written after each."""
    nodes: int = 12
    """Shadow rays along each edge of a lamp."""
    sky_rows: int = 12
    """Rows of shadow rays to the sky, of twice as many columns."""
    sky_nodes: Literal["even", "cosine", "luminance"] = "even"
    """Where these go: evenly all around, by the cosine to each surface, or to the bright parts."""
    tiles: pathlib.Path | None = None
    """Folder of the finished tiles; beside the .exr file, if left out."""
    scheduler: str | None = None
    """Address of a scheduler of dask.distributed, tcp://host:8786, whose workers make the tiles."""
    outside: bool = False
    """Read files that the scene names outside of its folder, too."""

    def run(self) -> int:
        """Render, or go on."""
        import hashlib

        from firstorder._argument_checks import check_positive
        from firstorder.io import is_space, read_space
        from firstorder.io._channels import openexr
        from firstorder.rendering.image_files import (
            render_to_files,
            scene_fingerprint,
            world_from_scene,
        )
        from firstorder.scene._bands import bands_of

        for name in ("width", "height", "passes", "nodes", "sky_rows"):
            check_positive(name, getattr(self, name))
        if self.out.suffix.lower() != ".exr":
            raise ValueError(f"Argument `out` must end in .exr, but is {self.out.name}.")
        if not is_space(self.source):
            raise ValueError(
                "Argument `source` must be a .toml file that says `dimensions = 3`, "
                f"but is {pathlib.Path(self.source).name}."
            )
        openexr(self.out.name)  # what is missing is said before the work and not after it
        space = read_space(self.source, outside=self.outside)
        world = world_from_scene(space, self.nodes, self.sky_rows, self.sky_nodes)
        words = hashlib.sha256(pathlib.Path(self.source).read_bytes()).hexdigest()[:16]
        # Meshes and pictures lie in files of their own; another version may shade otherwise.
        words = f"{words} {scene_fingerprint(space)} {firstorder.__version__}"
        key = f"{words} {self.nodes} {self.sky_rows} {self.sky_nodes}"
        folder = self.tiles or self.out.with_name(f"{self.out.stem}_tiles")
        render_to_files(
            world, self.width, self.height, folder, passes=self.passes, key=key, out=self.out,
            scheduler=self.scheduler,
        )  # fmt: skip
        if bands_of(world) in (None, 3):
            print(f"{self.out} and {self.out.with_suffix('.png').name} are written.")
        else:
            print(f"{self.out} is written; a picture has one band or three, and no .png is made.")
        return 0


def _receivers(scene) -> tuple[str, ...]:
    """The floor, or all names of what does not emit, in the order of the shapes."""
    if "floor" in scene.names:
        return ("floor",)
    dark = [n for n, L in zip(scene.names, scene.material.emission, strict=True) if not L.any()]
    return tuple(dict.fromkeys(dark or scene.names))


def _file_words(names: Iterable[str]) -> list[str]:
    """Names as parts of names of files, no two of them alike."""
    words: list[str] = []
    for name in names:
        word = "".join(c if c.isalnum() or c in "-_" else "_" for c in name)
        while word in words:
            word += "_"
        words.append(word)
    return words


def _words(source: str, out: pathlib.Path, tables: list[str]) -> str:
    """Words about the files that were written, and commands to try next."""
    next_ = {
        "scene list": "other scenes",
        f"scene {source} --toml mine.toml": "this scene, as a file to edit",
        f"scene {source} --indirect": "all bounces between diffuse surfaces",
        f"agreements {source}": "the same numbers, found in ten ways",
    }
    width = max(map(len, next_))
    return "\n".join(
        (
            f"{out.name} shows E, E' and E'' in W/m, W/m^2 and W/m^3; "
            f"the numbers are in {', '.join(tables)}.",
            "Next:",
            *(f"  firstorder {words:{width}}  {about}" for words, about in next_.items()),
        )
    )


def _tell(words: str) -> None:
    """Prints words at once, where they do not stand among the numbers."""
    print(words, file=sys.stderr, flush=True)


def _print_curve(name: str, curve: dict) -> None:
    """Eleven samples of a curve, from end to end; of several bands E alone."""
    from firstorder.scene._bands import band_columns

    print(f"{name or 'unnamed shapes'}:")
    heads = {"arc": "arc", "x": "x", "y": "y", "E": "E", "dE": "E'", "d2E": "E''"}
    if curve["E"].ndim == 2:
        heads = {key: key for key in ("arc", "x", "y", *band_columns({"E": curve["E"]}))}
    columns = band_columns(curve)
    print("".join(f"{head:>12}" for head in heads.values()))
    count = len(curve["arc"])
    for k in sorted({round(j * (count - 1) / 10) for j in range(11)}):
        print("".join(f"{columns[key][k]:12.5g}" for key in heads))
