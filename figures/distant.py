"""Figures that workers draw: their files come back as bytes, and only this side writes them.

A worker has the repository on its path, as this program has it: the key of a figure, the digest of
all code that it depends on, has to be the same there.
"""

from __future__ import annotations

import dataclasses
import pathlib
import tempfile
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from figures import records
from firstorder import io
from firstorder.jobs import run_jobs

if TYPE_CHECKING:
    from figures.__main__ import Options

_one_at_a_time = threading.Lock()  # the house style is the process's


class Drawn(NamedTuple):
    """What a worker made of a figure.

    Attributes:
        name: of the figure.
        seconds: that it took.
        failure: a sentence; None if there was none.
        files: their bytes by name; a record, if it is finished.
    """

    name: str
    seconds: float
    failure: str | None
    files: dict[str, bytes]


def drawn(keys: dict[str, str], options: Options) -> Iterator[Drawn]:
    """Figures as workers finish them.

    Args:
        keys: of the figures, by name.
        options: with a scheduler.
    """
    jobs = list(keys.items())
    for _, found in run_jobs(_Pen(options), jobs, scheduler=options.scheduler):
        yield found


def write(found: Drawn, out: pathlib.Path) -> None:
    """Write the files of a figure, its record last."""
    record = records.path_of(found.name, out).name
    for file in sorted(found.files, key=lambda file: file == record):
        with io.atomic_write(out / file) as part:
            part.write_bytes(found.files[file])


@dataclasses.dataclass(frozen=True)
class _Pen:
    """Draws a figure on a worker, in a folder that is gone afterwards."""

    options: Options

    def __call__(self, job: tuple[str, str]) -> Drawn:
        from figures.__main__ import draw, key

        name, expected = job
        if key(name, self.options.quick) != expected:
            raise ValueError(
                f"Argument `scheduler` must lead to workers with the code of this program, but one "
                f"has other code for {name}, or other versions of what it uses."
            )
        with _one_at_a_time, tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            _, seconds, failure = draw(name, dataclasses.replace(self.options, out=here))
            failure = failure and failure.replace(folder, str(self.options.out))
            files = {f.name: f.read_bytes() for f in here.iterdir() if f.is_file()}
            return Drawn(name, seconds, failure, files)
