"""Draw the figures: `python -m figures [NAME ...] [--quick] [--list] [--out DIR] [--scheduler A]`.

Each picture comes with the arrays behind it, and all with one table of claims. What is finished is
not drawn again unless code, versions, flags of the compiler or the files themselves have changed
(`figures/records.py`). Exit code 1 if a figure could not be drawn; a claim
that does not hold is reported and is no error.
"""

from __future__ import annotations

import ast
import concurrent.futures
import functools
import hashlib
import importlib
import importlib.metadata
import multiprocessing
import pathlib
import shutil
import sys
import time
import traceback
from dataclasses import dataclass
from typing import Annotated, Literal

import tyro
from tqdm import tqdm

import firstorder
from figures import claims, distant, records
from figures.style import Drawing
from firstorder import io, plotting, session
from firstorder.cli._pipes import piped

# What every figure is made with, beside the modules that those of one paper share.
_SHARED = ("style.py", "verdicts.py", "timing.py")


@dataclass(frozen=True)
class Options:
    """Draw the figures of the papers, and compare what they claim with what we measure."""

    names: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Figures to draw, such as r07_fig03; all if none is named."""
    quick: bool = False
    """Small sizes, in seconds."""
    list: bool = False
    """Only say which figures there are."""
    out: pathlib.Path = claims.FOLDER / "out"
    """Where pictures, arrays and claims are written."""
    vector: Literal["svg", "pdf"] | None = None
    """Also write each picture in this format."""
    force: bool = False
    """Draw again what is finished."""
    jobs: int = 1
    """Figures drawn side by side, each in a process of its own."""
    scheduler: str | None = None
    """Address of a scheduler of dask.distributed, tcp://host:8786, whose workers draw instead."""


def main(options: Options) -> int:
    """Draw, write, compare."""
    unknown = [n for n in options.names if n not in claims.names()]
    if unknown:
        print(f"There is no figure called {unknown[0]!r}: see --list.", file=sys.stderr)
        return 2
    chosen = list(options.names) or claims.names()
    if options.list:
        print("\n".join(f"{name:12} {_title(name)}" for name in chosen))
        return 0
    session.start()
    reasons = {n: "drawn again: as asked." if options.force else _why(n, options) for n in chosen}
    waiting = [name for name in chosen if reasons[name]]
    for name in sorted(n for n in reasons if records.path_of(n, options.out).exists()):
        print(f"{name:12} {reasons[name] or 'finished before'}")
    interrupted, failures = False, []
    try:
        failures = _draw_all(waiting, options)
    except KeyboardInterrupt:
        interrupted = True
        print("Interrupted: what is finished is kept, and the next run goes on from here.")
    told = _claims(options.out)
    io.write_json(options.out / "claims.json", [r for n in told for r in told[n]])
    shown = [r for n in chosen for r in told.get(n, [])]
    print("\n" + claims.table(shown, max(100, shutil.get_terminal_size().columns)))
    print(f"\n{claims.summary(shown)}")
    news = claims.differences(shown, claims.kept())
    if news:
        print("Not as in figures/claims.json (`make readme` renews it):\n  " + "\n  ".join(news))
    for sentence in failures:
        print(sentence)
    return 130 if interrupted else int(bool(failures))


def _draw_all(names: list[str], options: Options) -> list[str]:
    """Draw one after the other, or side by side; a sentence for each that fails."""
    progress = tqdm(total=len(names), unit="figure", disable=not sys.stderr.isatty())
    failures = []

    def done(name: str, seconds: float, failure: str | None) -> None:
        progress.write(failure or f"{name:12} {seconds:6.1f} s")
        progress.update()
        failures.extend([failure] if failure else [])

    with progress:
        if options.scheduler is not None:
            keys = {name: key(name, options.quick) for name in claims.longest_first(names)}
            try:
                for drawn in distant.drawn(keys, options):
                    _forget(drawn.name, options.out)
                    distant.write(drawn, options.out)
                    done(drawn.name, drawn.seconds, drawn.failure)
            except (ValueError, ModuleNotFoundError, ConnectionError) as error:
                failures.append(str(error))
            return failures
        if options.jobs == 1:
            for name in names:
                progress.set_postfix_str(name)
                done(*draw(name, options))
            return failures
        context = multiprocessing.get_context("spawn")
        with concurrent.futures.ProcessPoolExecutor(options.jobs, context) as pool:
            try:
                drawn = [pool.submit(draw, name, options) for name in claims.longest_first(names)]
                for future in concurrent.futures.as_completed(drawn):
                    done(*future.result())
            except KeyboardInterrupt:
                pool.shutdown(cancel_futures=True)
                raise
    return failures


def draw(name: str, options: Options) -> tuple[str, float, str | None]:
    """Draw one figure and write all that belongs to it, its record last."""
    session.start()
    begin = time.perf_counter()
    log = options.out / f"{name}.log"
    _forget(name, options.out)
    try:
        with plotting.house_style():
            drawing = importlib.import_module(claims.module(name)).draw(options.quick)
            seconds = time.perf_counter() - begin
            told = [claim.as_json() for claim in drawing.claims]
            files = _write(name, drawing, options)
    except Exception as error:
        io.write_text(log, traceback.format_exc())
        words = " ".join(str(error).split())[:200]
        failure = f"{name} could not be drawn: {type(error).__name__}: {words} (see {log})."
        return name, time.perf_counter() - begin, failure
    about = {"seconds": round(seconds, 2), "size": drawing.size, "seed": drawing.seed}
    rows = [{"figure": name, **claim, **about} for claim in told]
    records.write(name, options.out, key(name, options.quick), files, rows)
    return name, seconds, None


def _write(name: str, drawing: Drawing, options: Options) -> list[str]:
    """Picture, arrays, curves; their names."""
    formats = ["png", *([options.vector] if options.vector else [])]
    files = [f"{name}.{suffix}" for suffix in formats]
    for file in files:
        with io.atomic_write(options.out / file) as part:
            drawing.figure.savefig(part)
    io.write_npz(options.out / f"{name}.npz", drawing.arrays)
    for curve, columns in drawing.curves.items():
        files.append(f"{name}.{curve}.csv")
        io.write_csv(options.out / files[-1], columns)
    return [*files, f"{name}.npz"]


def _why(name: str, options: Options) -> str:
    """Why a figure is to be drawn; none if all files are there, from the same code and size."""
    asked = {f"{name}.png"} | ({f"{name}.{options.vector}"} if options.vector else set())
    return records.why_drawn(name, options.out, key(name, options.quick), asked)


def _claims(out: pathlib.Path) -> dict[str, list[claims.Record]]:
    """Claims of all figures that have records; one that cannot be read is named and left out."""
    found = {}
    for name in claims.names():
        try:
            record = records.read(name, out)
        except ValueError as error:
            print(f"{error}: its claims are left out until {name} is drawn again.")
            continue
        if record is not None:
            found[name] = record["claims"]
    return found


def _forget(name: str, out: pathlib.Path) -> None:
    """Remove what an earlier run left of a figure, its record first."""
    try:
        record = records.read(name, out)
    except ValueError:  # files that it alone named stay
        record = None
    stale = [file["name"] for file in record["files"]] if record else []
    for file in (f"{name}.json", f"{name}.log", *stale):
        (out / file).unlink(missing_ok=True)


def key(name: str, quick: bool) -> str:
    """Digest of all that a figure depends on: size, script, shared modules, package, versions."""
    script = claims.scripts()[name].read_bytes()
    return hashlib.sha256(script + _common_key() + bytes([quick])).hexdigest()[:32]


@functools.cache
def _common_key() -> bytes:
    package = pathlib.Path(firstorder.__file__).parent
    shared = [*map(claims.FOLDER.joinpath, _SHARED), *sorted(claims.FOLDER.glob("*/*/*.py"))]
    digest = hashlib.sha256()
    for file in [*shared, *sorted(package.rglob("*.py"))]:
        digest.update(file.name.encode() + file.read_bytes())
    for dependency in ("jax", "numpy", "scipy", "matplotlib", "equinox"):
        digest.update(importlib.metadata.version(dependency).encode())
    return digest.digest()


def _title(name: str) -> str:
    """First line of a figure's docstring, without running it."""
    tree = ast.parse(claims.scripts()[name].read_text(encoding="utf-8"))
    return (ast.get_docstring(tree) or "").partition("\n")[0]


if __name__ == "__main__":
    # Functions travel to other processes by name, and `__main__` is not a name that they know.
    from figures.__main__ import Options, main

    config = (tyro.conf.FlagCreatePairsOff,)
    sys.exit(piped(lambda: main(tyro.cli(Options, description=__doc__, config=config))))
