"""Jobs that know nothing of each other, run one after the other or on workers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from firstorder._argument_checks import what


def _check_function(function: Any) -> None:
    """Refuse what cannot be called, before any job."""
    if not callable(function):
        raise TypeError(f"Argument `function` must be a function, but is {what(function)}.")


def run_jobs(
    function: Callable[[Any], Any], jobs: Sequence[Any], *, scheduler: str | None = None
) -> Iterator[tuple[int, Any]]:
    """Results of a function of each job, with the job's number, as they come: each job once.

    Without a scheduler they are computed here and come in order. With one they are computed by its
    workers, as `firstorder.session` is set here. A worker that ends loses nothing: its jobs are
    asked of another. A scheduler that ends and begins anew within a minute is asked again for what
    has not come yet. A job that fails is tried `ATTEMPTS` times, as the fault may be a worker's.

    Valid when: the function depends on the job alone, as a job may be computed twice, of which one
    result is given. Wrong when: the network is not trusted (docs/SECURITY.md).

    Args:
        function: of one job. What it holds travels to each worker once, pickled.
        jobs: what it is asked; small things, which travel pickled as well.
        scheduler: address of a scheduler of `dask.distributed`, such as tcp://host:8786.

    Yields:
        Number of the job, and what the function says of it.

    Raises:
        TypeError: if `function` is none.
        ValueError: if no scheduler answers at the address, or a worker has another version or other
            settings of the compiler, or cannot read the function.
        ConnectionError: if the scheduler is lost for good, or a job ends all workers that try it.
        ModuleNotFoundError: for a scheduler, without the extra `cluster`.

    Example:
        >>> from firstorder.jobs import run_jobs
        >>> dict(run_jobs(lambda side: side**2, [3, 4]))
        {0: 9, 1: 16}
    """
    _check_function(function)
    if scheduler is not None:
        from firstorder.jobs._dask import results

        yield from results(function, jobs, scheduler)
        return
    for number, job in enumerate(jobs):
        yield number, function(job)
