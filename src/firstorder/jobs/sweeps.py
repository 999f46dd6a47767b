"""Sweeps: one function of numbers over all rows of a table, here or on the workers of a cluster."""

from __future__ import annotations

import dataclasses
import functools
import sys
from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np
from jaxtyping import Shaped
from tqdm import tqdm

from firstorder._argument_checks import check_count
from firstorder._labelled import DataFrame
from firstorder.jobs.running import _check_function, run_jobs

Table = dict[str, Shaped[np.ndarray, "rows ..."]]


def sweep(
    function: Callable[..., Any],
    table: Mapping[str, Any] | DataFrame,
    scheduler: str | None = None,
    *,
    batch: int = 256,
    quiet: bool | None = None,
) -> Table:
    """The table, and beside its columns what a function says of each row.

    Rows are computed by the batch, by one compiled function (`jax.vmap`): the same here and on
    workers, and so to the same bits. All batches have one size, the last one filled up.

    Valid when: JAX can trace the function. A number that decides what is compiled, such as one of
    nodes or of shapes, is no column: sweep for each of its values.

    Args:
        function: of numbers by the names of the columns; gives a number or an array, called
            `value`, or several by name.
        table: arrays of one length by name, such as a dictionary or a table of pandas; an array of
            shape (rows, ...) gives each row a part of it.
        scheduler: address of a scheduler of `dask.distributed`, as in `run_jobs`.
        batch: number of rows of a job.
        quiet: whether to show no progress; by default it is shown on a terminal.

    Returns:
        Columns by name, of shapes (rows, ...), in the order of the rows.

    Raises:
        ValueError: if columns are of different lengths, hold no numbers, are none or have one name,
            or a result has the name of a column; and as `run_jobs`.
        TypeError: if the table has no names, the function is none, or gives anything else, such as
            a tuple.
        ConnectionError: as in `run_jobs`.
        ModuleNotFoundError: for a scheduler, without the extra `cluster`.

    Example:
        >>> from firstorder.jobs import sweep
        >>> found = sweep(lambda side: {"area": side**2}, {"side": [1.0, 2.0, 3.0]})
        >>> found["area"].tolist(), list(found)
        ([1.0, 4.0, 9.0], ['side', 'area'])
    """
    check_count("batch", batch)
    if not hasattr(table, "keys"):
        raise TypeError(
            "Argument `table` must hold columns by name, but is a "
            f"{type(table).__name__}: write {{'x': [0.0, 1.0]}}."
        )
    _check_function(function)
    columns = _columns(table)
    rows = _length(columns)
    batch = min(batch, rows)
    numbers = [np.arange(k, k + batch) % rows for k in range(0, rows, batch)]
    jobs = [{name: a[some] for name, a in columns.items()} for some in numbers]
    quiet = not sys.stderr.isatty() if quiet is None else quiet
    found: dict[int, dict[str, np.ndarray]] = {}
    with tqdm(total=rows, unit="row", disable=quiet) as progress:
        for k, results in run_jobs(_Batches(function), jobs, scheduler=scheduler):
            found[k] = results
            progress.update(min(batch, rows - k * batch))
    names = list(found[0])
    if both := [name for name in names if name in columns]:
        raise ValueError(
            f"Argument `function` must give results of other names than the columns, but one is "
            f"{both[0]!r}."
        )
    return columns | {
        name: np.concatenate([found[k][name] for k in range(len(jobs))])[:rows] for name in names
    }


def _columns(table: Mapping[str, Any] | DataFrame) -> dict[str, np.ndarray]:
    """Columns as arrays, by their names as text."""
    columns: dict[str, np.ndarray] = {}
    for name in table:
        if str(name) in columns:
            raise ValueError(
                f"Argument `table` must hold each column once, but has two called {str(name)!r}."
            )
        try:
            columns[str(name)] = np.asarray(table[name])
        except ValueError:  # rows of several lengths
            raise ValueError(
                f"Argument `table` must hold arrays, but its column {name!r} is none."
            ) from None
    return columns


def _length(columns: dict[str, np.ndarray]) -> int:
    """Number of rows of all columns."""
    lengths = {a.shape[:1] for a in columns.values()}
    if len(lengths) != 1 or lengths <= {(), (0,)}:
        listed = ", ".join(f"{name} {a.shape}" for name, a in columns.items()) or "nothing"
        raise ValueError(
            f"Argument `table` must hold columns of one length, with rows, but has {listed}."
        )
    for name, a in columns.items():
        if a.dtype.kind not in "biufc":
            raise ValueError(
                f"Argument `table` must hold numbers, but its column {name!r} holds {a.dtype}."
            )
    return lengths.pop()[0]


@dataclasses.dataclass(frozen=True)
class _Batches:
    """A function of a batch of rows, compiled where it is first called."""

    function: Callable[..., Any]

    @functools.cached_property
    def _compiled(self) -> Callable[[Table], Any]:
        return jax.jit(jax.vmap(lambda row: self.function(**row)))

    def __getstate__(self) -> dict[str, Any]:
        return {"function": self.function}  # without what is compiled: it travels

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    def __call__(self, rows: Table) -> Table:
        found = self._compiled(rows)
        named = found if isinstance(found, Mapping) else {"value": found}
        for one in named.values():
            if not isinstance(one, jax.Array):
                raise TypeError(
                    "Argument `function` must give a number, an array, or several by name, but "
                    f"gives a {type(one).__name__}."
                )
        return {str(name): np.asarray(a) for name, a in named.items()}
