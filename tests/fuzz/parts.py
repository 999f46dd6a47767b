"""The three things that are fuzzed, by the case and by the thousand: scenes, files, kills."""

from __future__ import annotations

import pathlib
import tempfile
from collections.abc import Iterator, Sequence

import numpy as np

from tests.fuzz import files, kills, mutants, scenes, workers, worlds
from tests.fuzz.limits import known
from tests.fuzz.report import Tally

LOOKED_AT = 2  # scenes of a batch that are compared with rays and digits


def fuzz_scenes(
    tally: Tally, world: str, precision: str, seed: int, count: int, name: str, first: int = 0
) -> None:
    """Judges scenes of a class.

    Args:
        tally: of what is found.
        world: name of it.
        precision: name of it.
        seed: of the random numbers.
        count: of scenes, rounded up to whole batches.
        name: of the class.
        first: number of the first batch.
    """
    here, where = worlds.WORLDS[world], f"{world} {precision} {name}"
    for batch in range(first, first + -(-count // here.batch)):
        rows = range(batch % 7, here.batch, here.batch // LOOKED_AT)
        for found in scenes.judged(here, precision, name, seed, batch, rows):
            case = f"{world}/{precision}/{name}/{seed}/{batch * here.batch + found.row}"
            limit = known(world, precision, name, found.kind, found.amount)
            tally.add(where, found.kind, found.amount, case, limit)
        tally.asked[f"{world} {precision}"] += here.batch


def fuzz_files(tally: Tally, name: str, seed: int, numbers: Sequence[int]) -> None:
    """Reads mutants of a sample, each of which is known by its number."""
    data = mutants.whole(name)
    with tempfile.TemporaryDirectory() as folder, files.bounded_memory():
        for number in numbers:
            found = files.judged(name, data, pathlib.Path(folder), number, seed)
            tally.asked[f"files {name} {found.verdict}"] += 1
            if not found.is_clean:
                case = f"files/{name}/{seed}/{number}"
                tally.add(f"files {name}", found.verdict, found.seconds, case, None)


def fuzz_kills(tally: Tally, name: str, seed: int, numbers: Sequence[int]) -> Iterator[str]:
    """Kills a program at moments, each of which is known by its number; tells of each."""
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        kills.uninterrupted(name, here / "warm")  # compiled functions are kept from here on
        whole = kills.uninterrupted(name, here / "whole")
        for number in numbers:
            moment, wrong = kills.wrong_after_a_kill(name, here / str(number), whole, seed, number)
            tally.asked[f"kills of {name}"] += 1
            for words in wrong:
                tally.add(f"kills {name}", words, np.nan, f"kills/{name}/{seed}/{number}", None)
            words = ", ".join(wrong) or "the same bytes"
            yield f"{name}: killed after {moment:.1f} of {whole.seconds:.1f} s: {words}"


def fuzz_workers(tally: Tally, seed: int, count: int) -> Iterator[str]:
    """Kills so many workers, schedulers and clients of renders; tells of each image."""
    with tempfile.TemporaryDirectory() as folder:
        for found in workers.renders(pathlib.Path(folder), seed, count):
            tally.asked["kills of a cluster"] += found.kills.total()
            case = f"workers/{seed}/{count}"
            lost = [f"{found.lost} tiles lost"] if found.lost else []
            lost += [f"{found.twice} tiles written twice"] if found.twice else []
            for words in (*lost, *found.wrong):
                tally.add("workers", words, np.nan, case, None)
            words = ", ".join(f"{n} of {what}" for what, n in found.kills.items()) or "no kill"
            yield f"workers: {words}: {found.lost} tiles lost, {found.twice} written twice"


def repeat(tally: Tally, case: str) -> Iterator[str]:
    """Does a case again, and tells what it is about.

    Raises:
        ValueError: if no case has that name.
    """
    match case.split("/"):
        case "files", name, seed, number:
            fuzz_files(tally, name, int(seed), [int(number)])
            yield repr(mutants.mutant(name, mutants.whole(name), int(seed), int(number)))
        case "kills", name, seed, number:
            yield from fuzz_kills(tally, name, int(seed), [int(number)])
        case "workers", seed, count:
            yield from fuzz_workers(tally, int(seed), int(count))
        case world, precision, name, seed, number if world in worlds.WORLDS:
            here = worlds.WORLDS[world]
            batch, row = divmod(int(number), here.batch)
            s, steps = scenes.drawn(here, precision, name, int(seed), batch)
            asked = scenes.asked(here, precision, name, s, steps)
            for field, values in zip(s._fields, s, strict=True):
                yield f"{field} = {values[row].tolist()}"
            by_rays, bound = here.by_rays(s, row, asked.eps, 1 << 16)
            yield f"irradiance = {asked.E[row]}; by rays {by_rays}, up to {bound:.1g}"
            for found in scenes.judged(here, precision, name, int(seed), batch, [row]):
                if found.row == row:
                    limit = known(world, precision, name, found.kind, found.amount)
                    tally.add(case.rpartition("/")[0], found.kind, found.amount, case, limit)
        case _:
            raise ValueError(f"There is no case {case}.")
