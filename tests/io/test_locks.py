import json
import os
import signal
import subprocess
import sys
import threading

import pytest

from firstorder.io._locks import at_work

fcntl = pytest.importorskip("fcntl")

HOLDER = """
import sys, time
from firstorder.io._locks import at_work
with at_work(sys.argv[1], {"passes": 8, "key": "a"}):
    print("at work", flush=True)
    time.sleep(60.0)
"""


@pytest.fixture
def file(tmp_path):
    return tmp_path / "a.exr"


@pytest.fixture
def holder(file):
    """Another program that is at work on the file."""
    command = [sys.executable, "-c", HOLDER, str(file)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "at work\n"
        yield process
        process.kill()


def test_another_program_with_other_settings_is_told_and_one_with_equal_ones_goes_on(file, holder):
    with pytest.raises(ValueError, match="writing it now") as told:
        at_work(file, {"passes": 6, "key": "b"}).__enter__()
    assert str(told.value) == (
        f"a.exr: process {holder.pid} is writing it now with other settings (passes 8 and not 6, "
        "key): wait until it ends, or choose another file."
    )
    with at_work(file, {"passes": 8, "key": "a"}):
        pass
    with at_work(file.with_name("b.exr"), {"passes": 6}):
        pass
    assert [f.name for f in file.parent.iterdir()] == [".a.exr.lock"]


def test_what_a_killed_program_left_binds_nobody(file, holder):
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    assert [f.name for f in file.parent.iterdir()] == [".a.exr.lock"]
    with at_work(file, {"passes": 6}):
        words = json.loads((file.parent / ".a.exr.lock").read_text())
        assert words == {"process": os.getpid(), "settings": {"passes": 6}}
    assert not list(file.parent.iterdir())


def test_the_file_is_free_after_an_error(file):
    with pytest.raises(KeyboardInterrupt), at_work(file, {"passes": 8}):
        raise KeyboardInterrupt
    with at_work(file, {"passes": 6}):
        pass


def test_a_lock_that_was_cut_short_binds_nobody(file):
    (file.parent / ".a.exr.lock").write_text('{"process": 1, "sett')
    with at_work(file, {"passes": 6}):
        pass


def test_a_folder_that_knows_no_locks_is_written_all_the_same(file, monkeypatch):
    def unknown(*_):
        raise OSError("no locks available")

    monkeypatch.setattr(fcntl, "flock", unknown)
    with at_work(file, {"passes": 6}), at_work(file, {"passes": 8}):
        pass


def test_never_two_settings_at_once_however_programs_come_and_go(file):
    """Threads stand for programs: a lock belongs to an opened file and not to a process."""
    inside, seen, refused = [], [], []

    def come_and_go(passes):
        for _ in range(200):
            try:
                with at_work(file, {"passes": passes}):
                    inside.append(passes)
                    seen.append(set(inside))
                    inside.remove(passes)
            except ValueError:
                refused.append(passes)

    threads = [threading.Thread(target=come_and_go, args=(k,)) for k in (6, 6, 8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert seen
    assert all(len(one) == 1 for one in seen)
    assert len(seen) + len(refused) == 600
