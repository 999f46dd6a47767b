"""Jobs on real workers: each comes once, whatever ends; what is wrong is one sentence."""

import os
import shutil
import subprocess
import sys
import threading
import time

import pytest

from firstorder.jobs import _dask, run_jobs
from tests.jobs.cluster import Cluster, free_port


def square(job):
    time.sleep(0.1)
    return job * job


def asked(cluster, jobs, each=None, function=square):
    """Results by number, with something done after each, and a complaint if one comes twice."""
    found = {}
    for number, result in run_jobs(function, jobs, scheduler=cluster.address):
        assert number not in found
        found[number] = result
        if each is not None:
            each(len(found))
    return found


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    pytest.importorskip("distributed")
    with Cluster(2, tmp_path_factory.mktemp("cluster")) as running:
        yield running


def test_here_they_come_in_order_and_one_at_a_time():
    seen = []
    for number, result in run_jobs(lambda job: seen.append(job) or -job, [3, 4]):
        assert len(seen) == number + 1
        assert result == -seen[number]


def test_a_number_is_no_function():
    with pytest.raises(
        TypeError, match=r"^Argument `function` must be a function, but is|Type-check error"
    ):
        list(run_jobs(3, [1]))  # pyright: ignore[reportArgumentType]


def test_no_jobs_need_no_scheduler():
    assert list(run_jobs(square, [], scheduler="tcp://127.0.0.1:1")) == []


# A scheduler that has begun anew may know no worker yet when it is asked.
may_wait = pytest.mark.filterwarnings("ignore:The scheduler at .* has no workers yet")


@may_wait
def test_killed_workers_and_a_killed_scheduler_lose_nothing(cluster):
    """Three workers, one of them in the middle of a job, and the scheduler with all workers."""

    def kill(count):
        if count in (5, 12, 20):
            cluster.kill_worker()
        if count == 28:
            cluster.kill_scheduler()

    assert asked(cluster, range(40), kill) == {k: k * k for k in range(40)}


@may_wait
def test_that_no_worker_is_left_is_told(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(_dask, "QUIET", 0.5)

    def end_worker(count):
        if count == 1:
            for worker in cluster.workers:
                worker.kill()
                worker.wait()

    def begin_worker():
        time.sleep(5.0)
        cluster.start_worker()

    with Cluster(1, tmp_path) as cluster:
        later = threading.Thread(target=begin_worker)
        later.start()
        with pytest.warns(UserWarning, match="has no workers any more: waiting.$") as told:
            found = asked(cluster, range(3), end_worker)
        later.join()
    assert found == {0: 0, 1: 1, 2: 4}
    assert len(told) == 1


def test_a_job_that_fails_is_tried_again_and_then_raises_its_own_error(cluster, tmp_path):
    def clumsy(job):
        times = tmp_path / f"{job}.times"
        with times.open("a") as log:
            log.write("x")
        if job == 1 and len(times.read_text()) < 3:
            raise OSError("disk full")
        if job == 7:
            raise OverflowError("seven is too many")
        return job

    assert asked(cluster, [0, 1, 2], function=clumsy) == {0: 0, 1: 1, 2: 2}
    with pytest.raises(OverflowError, match="seven is too many"):
        asked(cluster, [0, 7], function=clumsy)
    assert (tmp_path / "7.times").read_text() == "x" * _dask.ATTEMPTS


def test_what_a_function_builds_serves_all_jobs_of_a_worker(cluster):
    class Builds:
        def __init__(self):
            self.made = None

        def __call__(self, job):
            self.made = self.made or object()
            return os.getpid(), id(self.made)

    found = asked(cluster, range(30), function=Builds()).values()
    assert len(set(found)) == len({process for process, _ in found})


def test_numbers_are_as_precise_there_as_here(cluster):
    def dtype(job):
        import jax.numpy as jnp

        return str((jnp.asarray(1.0) + job).dtype)

    assert asked(cluster, [1.0], function=dtype) == {0: "float64"}


# --- sentences -----------------------------------------------------------------------------------


def test_no_scheduler_at_the_address(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(_dask, "FIRST", 0.5)
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(ValueError, match=f"but none answers at {address} within 0 s.$"):
        list(run_jobs(square, [1], scheduler=address))
    with pytest.raises(ValueError, match=r"an address such as tcp://host:8786, but is 'a://b:c'"):
        list(run_jobs(square, [1], scheduler="a://b:c"))


def test_no_dask(monkeypatch):
    monkeypatch.setitem(sys.modules, "cloudpickle", None)
    with pytest.raises(ModuleNotFoundError, match=r'extra `cluster`: pip install "firstorder\[clu'):
        list(run_jobs(square, [1], scheduler="tcp://127.0.0.1:1"))


def test_a_function_that_cannot_travel(cluster):
    lock = threading.Lock()
    with pytest.raises(ValueError, match="must be one that can be pickled"):
        asked(cluster, [1], function=lambda job: lock)


def test_a_worker_that_cannot_read_the_job(cluster, tmp_path, monkeypatch):
    (tmp_path / "only_here.py").write_text("def f(job):\n    return job\n")
    monkeypatch.syspath_prepend(tmp_path)
    from only_here import f  # pyright: ignore[reportMissingImports]

    told = r"that at tcp://[\d.:]+ cannot read the job \(ModuleNotFoundError: No module named 'only"
    with pytest.raises(ValueError, match=told):
        asked(cluster, [1], function=f)


def test_a_worker_with_other_flags_of_the_compiler(tmp_path):
    pytest.importorskip("distributed")
    flags = os.environ.get("XLA_FLAGS", "") + " --xla_cpu_multi_thread_eigen=false"
    with Cluster(1, tmp_path, XLA_FLAGS=flags) as other:
        told = r"that at tcp://[\d.:]+ differs \(XLA_FLAGS .*, there .*_eigen=false.*\).$"
        with pytest.raises(ValueError, match=told):
            asked(other, [1])


def test_a_worker_without_this_package(tmp_path):
    pytest.importorskip("distributed")
    words = "raise ModuleNotFoundError(\"No module named 'firstorder'\")"
    (tmp_path / "firstorder.py").write_text(words)
    with Cluster(0, tmp_path) as other:
        other.environment["PYTHONPATH"] = str(tmp_path)
        other.start_worker()
        other.wait_for_workers(1)
        told = r"workers with the packages of this program, but that at tcp://[\d.:]+ says Module"
        with pytest.raises(ValueError, match=told):
            asked(other, [1])


def test_a_worker_that_comes_late_is_waited_for_in_words(tmp_path):
    pytest.importorskip("distributed")
    with Cluster(0, tmp_path) as late:
        threading.Timer(1.0, late.start_worker).start()
        with pytest.warns(UserWarning, match=r"^The scheduler at .* has no workers yet: waiting.$"):
            assert asked(late, [5]) == {0: 25}


def test_another_kind_of_processor_is_warned_of():
    answer = _dask.Answer(1, "tcp://a:1", "", "vax none")
    with pytest.warns(UserWarning, match=r"tcp://a:1 has another kind of processor \(vax none\)"):
        _dask._check(answer)


def test_a_scheduler_that_is_lost_while_it_is_asked_for_its_workers_is_asked_again():
    class Lost:
        def run(self, *_, **__):
            raise OSError("in <TCP (closed)>: Stream is closed")

    assert _dask._look_around(Lost(), "tcp://a:1") is None


def test_a_scheduler_that_is_lost_for_good(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(_dask, "AGAIN", 1.0)
    lost = pytest.raises(ConnectionError, match=r"was lost, and what is finished is kept\. Arg")
    with Cluster(1, tmp_path) as short, lost:
        asked(short, range(20), lambda count: count == 3 and short.stop())


def test_a_job_that_ends_every_worker_is_given_up(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(_dask, "ATTEMPTS", 1)
    given_up = pytest.raises(ConnectionError, match="Job 0 was given up: 1 times all workers")
    settings = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with Cluster(1, tmp_path, **settings) as fragile, given_up:
        asked(fragile, [1], function=lambda job: os._exit(1))


# What dask says of a client of its own that it could not connect.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_by_tls_a_client_without_the_certificate_is_not_let_in(tmp_path, monkeypatch):
    dask = pytest.importorskip("dask")
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("no openssl to make a certificate with")
    key, certificate = (str(tmp_path / name) for name in ("key.pem", "cert.pem"))
    made = [
        "req",
        "-x509",
        "-newkey",
        "rsa:2048",
        "-nodes",
        "-days",
        "1",
        "-subj",
        "/CN=firstorder",
    ]
    subprocess.run(
        [openssl, *made, "-keyout", key, "-out", certificate], check=True, capture_output=True
    )
    where = "distributed.comm.tls"
    tls = {f"{where}.ca-file": certificate, f"{where}.client.cert": certificate}
    tls[f"{where}.client.key"] = key
    settings = {"DASK_DISTRIBUTED__COMM__TLS__CA_FILE": certificate}
    for role in ("CLIENT", "SCHEDULER", "WORKER"):
        settings[f"DASK_DISTRIBUTED__COMM__TLS__{role}__CERT"] = certificate
        settings[f"DASK_DISTRIBUTED__COMM__TLS__{role}__KEY"] = key
    monkeypatch.setattr(_dask, "FIRST", 3.0)
    known = dask.config.set(tls)
    with known, Cluster(1, tmp_path, protocol="tls", **settings) as secret:
        assert asked(secret, [3]) == {0: 9}
        with pytest.raises(ValueError, match="none answers"):
            list(run_jobs(square, [3], scheduler=secret.address.replace("tls", "tcp")))
        unknown = dask.config.set(dict.fromkeys(tls))
        with unknown, pytest.raises(ValueError, match=r"none answers|such as tcp"):
            asked(secret, [3])
