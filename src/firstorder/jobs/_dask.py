"""Jobs on the workers of a scheduler: all that the library knows of `dask.distributed`.

A job is a function and what it is asked. The function is pickled once, travels as bytes, which
workers pass on to each other, and is kept by each as long as it works on that function's jobs: what
it has compiled or built serves the next job. Bytes, because a worker may make arrays only after
`session.start` has set their precision.

What is lost is asked again, in rounds: a round is a connection to the scheduler, which has ended
when all is done or the connection has. Only results that came are crossed off.
"""

from __future__ import annotations

import functools
import importlib
import logging
import platform
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

import firstorder
from firstorder import session

FIRST, AGAIN = 10.0, 60.0  # seconds for a scheduler to answer: at first, and when it was lost
ATTEMPTS = 3  # of a job that fails
ROUNDS = 10  # without a single result, after which a cluster is given up
QUIET = 30.0  # seconds without a result, after which it is asked whether workers are left
POLL = 0.02  # seconds between two looks for results

Asked = dict[str, Any]


class Answer(NamedTuple):
    """A worker's answer to a job.

    Attributes:
        result: of the job; None if the worker refuses it.
        worker: its address.
        refusal: why it does not compute it, in words; none if it does.
        processor: instructions of its processor.
    """

    result: Any
    worker: str
    refusal: str
    processor: str


# --- on the worker -------------------------------------------------------------------------------

_one_at_a_time = threading.RLock()  # a worker may have several threads


def _answer(job: bytes, function: bytes, asked: Asked) -> Answer:
    """Computes a job, if this worker is set as the client is and can read it."""
    worker = importlib.import_module("distributed").get_worker().address
    with _one_at_a_time:
        _start(asked["x64"])
        if words := session.differing(asked, settings(), "there"):
            return Answer(None, worker, f"differs ({words})", processor())
        try:
            call, given = _unpacked(function), importlib.import_module("cloudpickle").loads(job)
        except Exception as error:  # whatever the modules say that are imported for it
            words = f"cannot read the job ({type(error).__name__}: {error})"
            return Answer(None, worker, words, processor())
    return Answer(call(given), worker, "", processor())


@functools.lru_cache(maxsize=1)
def _unpacked(function: bytes) -> Callable[[Any], Any]:
    """The function, the same object for all its jobs."""
    return importlib.import_module("cloudpickle").loads(function)


@functools.lru_cache(maxsize=1)
def _start(x64: bool) -> None:
    session.start(x64=x64)


def settings() -> Asked:
    """Versions and settings that must be the same here and there for the same bits."""
    return {
        "firstorder": firstorder.__version__,
        "python": ".".join(platform.python_version_tuple()[:2]),  # in which code is pickled
        "numpy": np.__version__,
        **session.settings(),
        "device": jax.default_backend(),
    }


@functools.cache
def processor() -> str:
    """The processor's instructions, by which compilers order sums."""
    found = np.show_config(mode="dicts")["SIMD Extensions"]
    return " ".join([platform.machine(), *found.get("found", ())])


# --- on the client -------------------------------------------------------------------------------


def results(
    function: Callable[[Any], Any], jobs: Sequence[Any], address: str
) -> Iterator[tuple[int, Any]]:
    """As `run_jobs` with a scheduler."""
    packed, left = _packed(function), {k: _packed(job) for k, job in enumerate(jobs)}
    failures, idle = Counter[int](), 0
    if not left:
        return
    client = _connected(address, FIRST)
    while left:
        before = len(left)
        with client:
            _look_around(client, address)
            for number, answer in _round(client, left, packed, failures, address):
                _check(answer)
                del left[number]
                yield number, answer.result
        idle = 0 if len(left) < before else idle + 1
        if left and idle < ROUNDS:
            client = _connected_again(address)
        elif left:
            raise ConnectionError(
                f"The scheduler at {address} has lost all jobs {ROUNDS} times: what is finished "
                "is kept."
            )


def _round(
    client: Any, left: dict[int, bytes], function: bytes, failures: Counter[int], address: str
) -> Iterator[tuple[int, Answer]]:
    """Answers as they come, until all are there or the scheduler is lost."""
    asked, shared = settings(), _shared(client, function)

    def submit(number: int) -> Any:
        # Each time under another key: the scheduler remembers what has failed under an old one.
        return client.submit(_answer, left[number], shared, asked, pure=False, priority=-number)

    numbers = {submit(number): number for number in left}
    coming = _package("distributed").as_completed(
        numbers, loop=client.loop, with_results=True, raise_errors=False
    )
    for future, answer in _arriving(coming, client, address):
        number = numbers.pop(future)
        if isinstance(answer, Answer):
            yield number, answer
        elif future.status == "error":
            _count(failures, number, future.exception())
            again = submit(number)
            numbers[again] = number
            coming.add(again)
        # What is cancelled was lost with the scheduler: it is asked in the next round.


def _arriving(coming: Any, client: Any, address: str) -> Iterator[tuple[Any, Any]]:
    """Results as they come, and a warning if none can come as no worker is left.

    A scheduler forgets workers that say nothing for five minutes, such as those of a machine that
    slept. A worker with a nanny, as `dask worker` begins it, begins anew; another one ends.
    """
    told, last = False, time.monotonic()
    while not coming.is_empty():
        if batch := coming.next_batch(block=False):
            yield from batch
            told, last = False, time.monotonic()
        elif not told and time.monotonic() - last > QUIET:
            told, last = _has_no_worker(client), time.monotonic()
            if told:
                warnings.warn(
                    f"The scheduler at {address} has no workers any more: waiting.", stacklevel=5
                )
        else:
            time.sleep(POLL)


def _has_no_worker(client: Any) -> bool:
    """Whether the scheduler answers, and knows no worker."""
    try:
        return not client.nthreads()
    except OSError:  # it was lost: the round will end by itself
        return False


def _shared(client: Any, function: bytes) -> Any:
    """A function's bytes on the cluster, fetched anew if the worker that has them ends."""
    config = importlib.import_module("dask").config
    with config.set({"distributed.admin.large-graph-warning-threshold": "1 TB"}):
        return client.submit(bytes, function, pure=False)


def _count(failures: Counter[int], number: int, error: BaseException) -> None:
    """Counts what went wrong with a job, and raises it if it has gone wrong too often."""
    failures[number] += 1
    if "deserialization of the task graph" in str(error):
        raise ValueError(
            "Argument `scheduler` must lead to a scheduler with the packages of this program, but "
            f"it cannot read the jobs ({error.__cause__})."
        ) from None
    if failures[number] < ATTEMPTS:
        return
    if type(error).__name__ == "KilledWorker":
        raise ConnectionError(
            f"Job {number} was given up: {ATTEMPTS} times all workers that tried it ended, perhaps "
            "for want of memory; what is finished is kept."
        ) from None
    raise error


def _check(answer: Answer) -> None:
    """Raises what a worker refuses; warns of one whose last bits may differ."""
    if answer.refusal:
        raise ValueError(
            "Argument `scheduler` must lead to workers with the versions, settings and modules of "
            f"this program, but that at {answer.worker} {answer.refusal}."
        )
    if answer.processor != processor():
        warnings.warn(
            f"The worker at {answer.worker} has another kind of processor ({answer.processor}) "
            f"than this program ({processor()}): last bits of its results may differ.",
            stacklevel=3,
        )


def _packed(thing: Any) -> bytes:
    try:
        return _package("cloudpickle").dumps(thing)
    except (TypeError, AttributeError, ValueError, RecursionError) as error:
        raise ValueError(
            f"Argument `function` must be one that can be pickled, and so must its jobs ({error})."
        ) from None


def _connected(address: str, patience: float) -> Any:
    """A connection to the scheduler, which is tried for some seconds."""
    distributed = _package("distributed")
    # What dask logs of a lost connection is said by us, or mended.
    for name in ("client", "core", "comm", "utils"):
        logging.getLogger(f"distributed.{name}").setLevel(logging.CRITICAL + 1)
    end = time.monotonic() + patience
    while True:
        try:
            return distributed.Client(address, timeout=patience, set_as_default=False)
        except OSError:
            if time.monotonic() < end:  # it ended while it answered
                time.sleep(0.5)
                continue
            raise ValueError(
                "Argument `scheduler` must be the address of a scheduler of dask.distributed, but "
                f"none answers at {address} within {patience:.0f} s."
            ) from None
        except (ValueError, TypeError) as error:
            raise ValueError(
                "Argument `scheduler` must be an address such as tcp://host:8786, but is "
                f"{address!r} ({error})."
            ) from None


def _connected_again(address: str) -> Any:
    """A connection to the scheduler that was lost, once it has begun anew."""
    try:
        return _connected(address, AGAIN)
    except ValueError as error:
        raise ConnectionError(
            f"The scheduler at {address} was lost, and what is finished is kept. {error}"
        ) from None


def _look_around(client: Any, address: str) -> None:
    """Refuses workers without this package, which would end unheard; tells if none are there.

    Such a worker that comes later ends, and says why in its own log.
    """
    try:
        there = client.run(processor, on_error="return")
    except OSError:  # the scheduler was lost: the round will find nothing
        return
    for worker, said in there.items():
        if isinstance(said, Exception) and not isinstance(said, OSError):  # that has ended by now
            raise ValueError(
                "Argument `scheduler` must lead to workers with the packages of this program, but "
                f"that at {worker} says {said}."
            )
    if not there:
        warnings.warn(f"The scheduler at {address} has no workers yet: waiting.", stacklevel=4)


def _package(name: str) -> Any:
    """The package, or an error that says where it comes from."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            f"A scheduler needs the package {name}, which comes with the extra `cluster`: "
            'pip install "firstorder[cluster]".'
        ) from None
