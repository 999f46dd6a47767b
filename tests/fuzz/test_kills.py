"""What a killed program leaves is seen; the library's own programs are killed by `make fuzz`."""

import sys

import pytest

from tests.fuzz import kills

# Writes half of a file, waits, and writes the rest: in place, or beside it and renamed.
IN_PLACE = """
import pathlib, sys, time
out = pathlib.Path(sys.argv[1], "a.txt")
if out.exists():
    raise SystemExit
with out.open("w") as file:
    file.write("one")
    file.flush()
    time.sleep(2.0)
    file.write("two")
"""
RENAMED = """
import pathlib, sys, time
out = pathlib.Path(sys.argv[1], "a.txt")
part = out.with_name(".a.part")
part.write_text("one")
time.sleep(2.0)
part.write_text("onetwo")
part.replace(out)
"""
LITTERING = RENAMED.replace('".a.part"', 'f".a.{time.time()}.part"')


@pytest.mark.parametrize(
    ("program", "wrong"),
    [(IN_PLACE, ["a.txt differs"]), (RENAMED, []), (LITTERING, ["left"])],
    ids=["in place", "renamed", "littering"],
)
def test_half_a_file_and_litter_are_seen(monkeypatch, tmp_path, program, wrong):
    command = (sys.executable, "-c", program, "{out}")
    monkeypatch.setitem(kills.PROGRAMS, "toy", (command, (".txt",)))
    whole = kills.uninterrupted("toy", tmp_path / "whole")
    assert whole.files == {"a.txt": b"onetwo"}
    monkeypatch.setattr(kills, "_moment", lambda whole, seed, number: whole.seconds - 1.0)
    _, found = kills.wrong_after_a_kill("toy", tmp_path / "killed", whole, 0, 0)
    assert len(found) == len(wrong)
    assert all(words in line for words, line in zip(wrong, found, strict=True))
