"""The command `firstorder`: numbers and tables without writing a program."""

from __future__ import annotations

import functools
import pathlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import equinox as eqx
import jax.numpy as jnp
import tyro

import firstorder
from firstorder import session
from firstorder._argument_checks import check_finite, check_positive
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.errors import Refused
from firstorder.fields import Affine, GaussianProfile, gaussian
from firstorder.laws import Hemisphere
from firstorder.transport import (
    Curvature,
    Mirror,
    Path,
    Reflection,
    ToAngle,
    Travel,
    half_plane_blocker,
)

Pair = tuple[float, float]


@dataclass(frozen=True)
class Jet:
    """Print value, gradient and Hessian of light at one ray, at every step of a path.

    A Gaussian light travels, passes a half-plane (if there is one), travels on, and is reflected
    by a curved glossy receiver. Every step is asked at the same two numbers.
    """

    at: Pair = (0.3, 0.1)
    """The ray: position in metres, and slope or angle in radians."""
    center: Pair = (0.1, -0.05)
    """Where the source is brightest: metres, slope."""
    sigma: Pair = (0.5, 0.3)
    """Its standard deviations."""
    d: float = 1.0
    """Distance travelled to the blocker, in metres."""
    edge: float | None = None
    """The half-plane blocks x < edge; without one, nothing is blocked."""
    d_after: float = 0.7
    """Distance travelled from there to the receiver, in metres."""
    kappa: float = 0.4
    """Curvature of the receiver in radians per metre, positive in a valley."""
    roughness: float = 0.2
    """Standard deviation of its Gaussian lobe, in radians."""

    def path(self) -> Path:
        """The path in words of the library."""
        for name in ("at", "center", "edge"):
            if getattr(self, name) is not None:
                check_finite(name, jnp.asarray(getattr(self, name)))
        path = gaussian(self.center, self.sigma, frame=FLATLAND_SLOPE) >> Travel(self.d)
        if self.edge is not None:
            path = path >> half_plane_blocker(self.edge, FLATLAND_SLOPE)
        # Light that had a slope comes from above the base line, which in the mirrored local frame
        # is the hemisphere about kappa x; beyond it the tangent would begin anew.
        above = Hemisphere(Affine([self.kappa, 0.0], 0.0, FLATLAND.turned()))
        shine = Mirror() >> Reflection(GaussianProfile(self.roughness), above)
        turned = path >> Travel(self.d_after) >> ToAngle() >> Curvature(self.kappa)
        return turned >> shine >> Curvature(self.kappa, back=True)

    def run(self) -> int:
        """One line for each step."""
        path = self.path()
        u = jnp.asarray(self.at)
        jets = eqx.filter_jit(Path.jets)(path, u)
        names = ["source", *(type(event).__name__.lower() for event in path.events)]
        print(f"{'step':12}" + "".join(f"{head:>12}" for head in _HEADS))
        for name, jet in zip(names, jets, strict=True):
            H = jet.hessian
            numbers = (jet.value, *jet.gradient, H[0, 0], H[0, 1], H[1, 1])
            print(f"{name:12}" + "".join(f"{number:12.5g}" for number in numbers))
        print("1 is x; 2 is the slope v up to the second travel, and the angle theta after it.")
        return 0


_HEADS = ("value", "d/d1", "d/d2", "d2/d1d1", "d2/d1d2", "d2/d2d2")


@dataclass(frozen=True)
class Table:
    """Print what each law and event does to each portrait, with the measured error.

    Exit code 1 if a square is not as it is declared.
    """

    names: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """How the names of laws and events begin, such as travel; or all. The laws, if left out."""

    def run(self) -> int:
        """One line for each law or event, and the reasons of refusals."""
        from firstorder.checks.registry import all_cases
        from firstorder.checks.table import LAWS, as_text, measure

        known = all_cases()
        lost = [n for n in self.names if n != "all" and not any(k.startswith(n) for k in known)]
        if lost:
            raise ValueError(
                f"Argument `names` must begin names that `table all` prints, but has {lost[0]!r}."
            )
        chosen = [k for k in known if k.startswith(self.names)] if self.names else LAWS
        table = measure(known if "all" in self.names else chosen)
        print(as_text(table))
        squares = [(name, s) for name, row in table.items() for s in row.values()]
        return int(any(s.verdict != known[n].expected.get(s.portrait, "equal") for n, s in squares))


@dataclass(frozen=True)
class Scene:
    """Draw a flatland scene, and what light does along its receivers; describe one of space.

    The page shows the scene and, for each receiver, irradiance and its first and second derivative
    by arc length, exact across shadow edges. Beside it come the numbers as CSV, one file for each
    receiver; a few of them are printed. A TOML file that says `dimensions = 3` is a scene of space:
    its shapes, meshes, sky and camera are listed.
    """

    source: Annotated[str, tyro.conf.Positional]
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
        known = self.source in scenes.scene_names()
        scene = scenes.named_scene(self.source) if known else read_scene(self.source)
        if self.toml is not None:
            write_flatland(self.toml, scene)
        curves = self._curves(scene)
        for name, curve in curves.items():
            _print_curve(name, curve)
            if self.out is not None:
                word = "".join(c if c.isalnum() or c in "-_" else "_" for c in name)
                write_csv(self.out.with_name(f"{self.out.stem}_{word}.csv"), curve)
        if self.out is not None:
            self._draw(scene, curves)
        return 0

    def _space(self) -> int:
        """List what is in a scene of space."""
        from firstorder.io import describe_space, read_space, write_space

        if self.out is not None or self.receivers or self.indirect:
            raise ValueError(
                "Arguments `out`, `receivers` and `indirect` are for scenes of flatland, "
                f"but {pathlib.Path(self.source).name} is one of space."
            )
        space = read_space(self.source)
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

    source: Annotated[str, tyro.conf.Positional]
    """A .toml or .svg file, or a name that `firstorder scene list` prints."""
    receiver: str = ""
    """Name of the shape on which the receiver lies; `floor`, if left out, or the first dark one."""
    s: float = 0.63
    """Where on it, from 0 to 1."""
    quick: bool = False
    """Few rays, paths and photons."""
    seed: int = 0
    """Of the random numbers."""

    def run(self) -> int:
        """Measure and print."""
        from firstorder._argument_checks import check_between
        from firstorder.checks.agreements import FULL, QUICK, agreements
        from firstorder.flatland import receiver
        from firstorder.flatland.library import _scenes as scenes
        from firstorder.io import read_scene

        check_between("s", self.s, 0.0, 1.0)
        known = self.source in scenes.scene_names()
        scene = scenes.named_scene(self.source) if known else read_scene(self.source)
        number = scene.named(self.receiver or _receivers(scene)[0])[0]
        at = receiver(scene, number, self.s)
        sizes = QUICK if self.quick else FULL
        table = agreements(scene, at, sizes=sizes, seed=self.seed, name=self.source)
        print(table)
        return int(not table.agrees)


@dataclass(frozen=True)
class Render:
    """Render a scene of space: an .exr file with all layers, and a tone-mapped .png beside it.

    Direct light of rectangles that emit and of the sky, soft shadows, diffuse and glossy lobes.
    Layers: `value`; its gradient `grad.u`, `grad.v` per unit of the image, of which moving shadows
    make `shadow.u`, `shadow.v`; R07's `SV`, `DV`, `CV`, `CDV` and each by `.diffuse` and `.glossy`;
    `index`, `distance`, `cosine`, `curvature`. Killed at any time, the same command goes on.
    """

    source: Annotated[str, tyro.conf.Positional]
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

    def run(self) -> int:
        """Render, or go on."""
        import hashlib

        from firstorder.io import is_space, read_space
        from firstorder.rendering.image_files import (
            render_to_files,
            scene_fingerprint,
            world_from_scene,
        )

        for name in ("width", "height", "passes", "nodes", "sky_rows"):
            check_positive(name, getattr(self, name))
        if self.out.suffix.lower() != ".exr":
            raise ValueError(f"Argument `out` must end in .exr, but is {self.out.name}.")
        if not is_space(self.source):
            raise ValueError(
                "Argument `source` must be a .toml file that says `dimensions = 3`, "
                f"but is {pathlib.Path(self.source).name}."
            )
        space = read_space(self.source)
        world = world_from_scene(space, self.nodes, self.sky_rows, self.sky_nodes)
        words = hashlib.sha256(pathlib.Path(self.source).read_bytes()).hexdigest()[:16]
        # Meshes and pictures lie in files of their own; another version may shade otherwise.
        words = f"{words} {scene_fingerprint(space)} {firstorder.__version__}"
        key = f"{words} {self.nodes} {self.sky_rows} {self.sky_nodes}"
        folder = self.tiles or self.out.with_name(f"{self.out.stem}_tiles")
        render_to_files(
            world, self.width, self.height, folder, passes=self.passes, key=key, out=self.out
        )
        print(f"{self.out} and {self.out.with_suffix('.png').name} are written.")
        return 0


@dataclass(frozen=True)
class Explain:
    """Print the equations of the paths and events of a Python file, step by step."""

    source: Annotated[pathlib.Path, tyro.conf.Positional]
    """A .py file with events, chains and paths as variables of its module."""
    at: tuple[float, ...] = ()
    """A ray, for numbers beside the formulas of paths."""

    def run(self) -> int:
        """One passage for each path and event."""
        from firstorder.symbolic import explain
        from firstorder.transport import Chain

        for name, found in _events(self.source).items():
            path = found if isinstance(found, (Path, Chain)) else Chain((found,))
            told = explain(path, self.at or None if isinstance(found, Path) else None)
            print(f"{name}:\n{told}\n")
        return 0


@dataclass(frozen=True)
class Check:
    """Judge the events of a Python file by all squares, with faults made on purpose.

    Exit code 1 if a square does not hold or a fault is not seen.
    """

    source: Annotated[pathlib.Path, tyro.conf.Positional]
    """A .py file with events and chains as variables of its module."""

    def run(self) -> int:
        """One table for each event."""
        from firstorder.checks import check

        found = _events(self.source)
        reports = [check(e, name=n) for n, e in found.items() if not isinstance(e, Path)]
        print(*reports, sep="\n\n")
        return int(not all(report.sound for report in reports))


@dataclass(frozen=True)
class Ledger:
    """Judge the ledger of equations in a folder, and print one line for each.

    Its Python files list `ROWS` (`firstorder.ledger.Row`); TOML catalogues may stand beside them.
    Exit code 1 if anything that should hold does not.
    """

    folder: Annotated[pathlib.Path, tyro.conf.Positional]
    """With .py files, or a package of them."""
    equations: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Ids, or what stands in them before a dot; all if none is given."""
    json: pathlib.Path | None = None
    """Also write the rows to this file."""
    jobs: int = 1
    """Processes that judge rows side by side."""
    attack: bool = False
    """Try instead whether each row notices that the function it names is off."""

    def run(self) -> int:
        """Judge, print, write."""
        from firstorder.ledger import gather, report

        check_positive("jobs", self.jobs)
        rows = functools.partial(gather, self.folder)
        return report(rows, self.equations, json=self.json, jobs=self.jobs, attacked=self.attack)


def _events(source: pathlib.Path) -> dict:
    """Events, chains and paths of a Python file, by the names of their variables."""
    import runpy

    from firstorder.transport import Chain, Event

    if source.suffix != ".py" or not source.is_file():
        raise ValueError(f"Argument `source` must be a .py file, but is {source.name}.")
    variables = runpy.run_path(str(source))
    kinds = Event, Chain, Path
    found = {k: v for k, v in variables.items() if isinstance(v, kinds) and k[0] != "_"}
    if not found:
        raise ValueError(f"{source.name} has no variable that is an event, a chain or a path.")
    return found


def _receivers(scene) -> tuple[str, ...]:
    """The floor, or all names of what does not emit, in the order of the shapes."""
    if "floor" in scene.names:
        return ("floor",)
    dark = [n for n, L in zip(scene.names, scene.material.emission, strict=True) if not L.any()]
    return tuple(dict.fromkeys(dark or scene.names))


def _print_curve(name: str, curve: dict) -> None:
    """Eleven samples of a curve, from end to end."""
    print(f"{name or 'unnamed shapes'}:")
    print("".join(f"{head:>12}" for head in ("arc", "x", "y", "E", "E'", "E''")))
    count = len(curve["arc"])
    for k in sorted({round(j * (count - 1) / 10) for j in range(11)}):
        row = (curve[key][k] for key in ("arc", "x", "y", "E", "dE", "d2E"))
        print("".join(f"{number:12.5g}" for number in row))


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; a bad argument is one sentence, and exit code 2.

    Example:
        >>> from firstorder.cli import main
        >>> main(["--version"])
        firstorder 0.1.0
        0
    """
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    if arguments == ["--version"]:
        print(f"firstorder {firstorder.__version__}")
        return 0
    command = tyro.cli(
        Jet | Table | Scene | Agreements | Render | Explain | Check | Ledger,
        args=arguments,
        prog="firstorder",
        description=__doc__,
    )
    session.start()
    try:
        return command.run()
    except (ValueError, ModuleNotFoundError, Refused) as error:
        print(error, file=sys.stderr)
        return 2
