"""A quick round of damaged files."""

import pathlib

import pytest

from tests.fuzz import files, mutants, parts
from tests.fuzz.report import Tally

NUMBERS = range(1000, 1040)


@pytest.mark.parametrize("name", mutants.SAMPLES)
def test_a_damaged_file_is_read_or_refused_in_one_line(name):
    tally = Tally()
    parts.fuzz_files(tally, name, 0, NUMBERS)
    assert tally.failures == 0, "\n".join(tally.lines)
    assert tally.asked[f"files {name} refused"] > len(NUMBERS) // 4


def test_a_mutant_is_made_again_by_its_number():
    data = mutants.whole("svg")
    made = [mutants.mutant("svg", data, 0, k) for k in range(20)]
    assert made == [mutants.mutant("svg", data, 0, k) for k in range(20)]
    assert len({*made, data}) > 15


def hangs(path):
    sum(range(10**7))


def leaks(path):
    raise KeyError(path.name)


def fills(path):
    return bytearray(4 * files.MEMORY)


def talks(path):
    raise ValueError(f"{path.name}: two\nlines.")


def nameless(path):
    raise ValueError("It is no file.")


FAULTS = {leaks: "KeyError", fills: "MemoryError", talks: "loose words", nameless: "loose words"}


@pytest.mark.parametrize("read", FAULTS, ids=lambda read: read.__name__)
def test_a_fault_of_a_reader_is_seen(monkeypatch, tmp_path, read):
    sample = mutants.SAMPLES["svg"]._replace(read=read)
    monkeypatch.setitem(mutants.SAMPLES, "svg", sample)
    with files.bounded_memory():
        assert files.judged("svg", b"<svg/>", tmp_path, 0, 0).verdict == FAULTS[read]


def test_a_reader_that_takes_long_is_seen(monkeypatch, tmp_path):
    monkeypatch.setattr(files, "SECONDS", 0.01)
    monkeypatch.setitem(mutants.SAMPLES, "svg", mutants.SAMPLES["svg"]._replace(read=hangs))
    assert files.judged("svg", b"<svg/>", pathlib.Path(tmp_path), 0, 0).verdict == "slow"
