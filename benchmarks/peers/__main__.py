"""Run the comparisons: `python -m benchmarks.peers [NAME ...] [--quick]`, or `make compare`.

At full size the results and their pictures are kept in `docs/kept/peers`, which the page "Beside
the peers" of the documentation shows; a run of some comparisons keeps the others. At quick size
nothing is kept unless a folder is named.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pathlib
from typing import Any

from benchmarks.one_core import pinned

NAMES = ("gradients", "floor_cache", "one_bounce", "flatland_hits")
KEPT = pathlib.Path(__file__).parents[2] / "docs" / "kept" / "peers"
RESULTS = "results.json"


def main(words: list[str] | None = None) -> None:
    """Run what is asked for, keep it, and print its tables."""
    asked = _asked(words)
    pinned(1)
    folder = asked.out or (None if asked.quick else KEPT)
    results: dict[str, Any] = {}
    if folder and (folder / RESULTS).is_file():
        results = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
    for name in asked.names or NAMES:
        results[name] = run(name, asked.quick)
        if folder:
            keep(folder, results)
    from docs.generate import peers

    print(peers.page(results))


def _asked(words: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*NAMES, []], metavar="NAME",
                        help=f"one of {', '.join(NAMES)}; all if left out")  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="small sizes: whether it runs")
    parser.add_argument("--out", type=pathlib.Path, help="folder for results and pictures")
    return parser.parse_args(words)


def run(name: str, quick: bool) -> dict[str, Any]:
    """One comparison, with what it was made with."""
    from benchmarks.peers import measure

    found = importlib.import_module(f"benchmarks.peers.{name}").run(quick)
    for sentence in found["left out"]:
        print(sentence)
    return {**found, "setting": measure.setting(), "quick": quick}


def keep(folder: pathlib.Path, results: dict[str, Any]) -> None:
    """Results and pictures, each whole or not at all."""
    from benchmarks.peers import pictures
    from firstorder import io

    folder.mkdir(parents=True, exist_ok=True)
    io.write_json(folder / RESULTS, results)
    pictures.write(folder, results)


if __name__ == "__main__":
    main()
