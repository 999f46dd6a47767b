"""A report counts, knows limits from news, and names the command that repeats a case."""

import pytest

from tests.fuzz import parts, scenes, worlds
from tests.fuzz.limits import LIMITS
from tests.fuzz.report import Tally


def test_what_is_known_is_no_failure():
    tally = Tally()
    tally.asked["flatland float64"] += 10
    tally.add("flatland float64 random", "rays", 0.5, "flatland/float64/random/0/3", None)
    tally.add("flatland float64 random", "rays", 0.7, "flatland/float64/random/0/4", None)
    tally.add("space float32 huge", "bounds", 0.1, "space/float32/huge/0/4", LIMITS[-1])
    assert tally.failures == 2
    assert tally.lines == [
        "asked: 10 of flatland float64",
        "WRONG: flatland float64 random: rays: 2, by 0.7 at most",
        "    make fuzz CASE=flatland/float64/random/0/4",
        "    make fuzz CASE=flatland/float64/random/0/3",
        "known: space float32 huge: bounds: 1, by 0.1 at most",
        f"    {LIMITS[-1].reason}: space/float32/huge/0/4",
        "2 failures",
    ]


def test_a_case_is_repeated_by_its_name(monkeypatch):
    asked = []

    def judged(world, precision, name, seed, batch, rows):
        asked.append((world.name, precision, name, seed, batch, list(rows)))
        return [scenes.Finding("rays", 5, 0.5), scenes.Finding("rays", 6, 0.7)]

    monkeypatch.setattr(scenes, "judged", judged)
    tally, size = Tally(), worlds.FLATLAND.batch
    said = list(parts.repeat(tally, f"flatland/float64/random/3/{2 * size + 5}"))
    assert asked == [("flatland", "float64", "random", 3, 2, [5])]
    assert any(line.startswith("segments = [[[") for line in said)
    assert tally.failures == 1


def test_a_file_is_repeated_by_its_name():
    tally = Tally()
    (said,) = parts.repeat(tally, "files/svg/0/17")
    assert said.startswith("b'")
    assert sum(tally.asked.values()) == 1


def test_a_name_of_no_case_is_refused():
    with pytest.raises(ValueError, match="There is no case"):
        list(parts.repeat(Tally(), "flatland/float64"))
