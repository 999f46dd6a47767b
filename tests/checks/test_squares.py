import dataclasses
import functools

import pytest

from docs.generate import kept
from firstorder.checks.registry import all_cases, all_faults
from firstorder.checks.squares import PORTRAITS, Square, goes_red, square

SQUARES = [(name, portrait) for name in all_cases() for portrait in PORTRAITS]
RULED = [s for s in SQUARES if all_cases()[s[0]].expected.get(s[1]) != "refused"]
FAULTS = [
    (name, fault, portrait)
    for name, listed in all_faults().items()
    for fault in listed
    for portrait in fault.portraits
]


@pytest.mark.parametrize(("name", "portrait"), SQUARES)
def test_apply_then_convert_is_convert_then_apply(name, portrait):
    case = all_cases()[name]
    found = square(case, portrait)
    assert found.verdict == case.expected.get(portrait, "equal"), found
    assert kept.is_current(found), f"{found}: python -m docs.generate.kept"


def test_a_kept_square_that_is_no_longer_so_is_seen():
    error = kept.squares()["tabulate"]["value"]["error"]
    found = Square("tabulate", "value", "approximate", error)
    assert kept.is_current(found)
    for other in ({"verdict": "equal"}, {"error": 1.1 * error}, {"error": None}, {"name": "new"}):
        assert not kept.is_current(dataclasses.replace(found, **other))


@functools.lru_cache(maxsize=4)
def wrong_step(name, fault):
    """One twin for all portraits that should notice it: its jets are computed once."""
    return fault.wrong(all_cases()[name].step)


@pytest.mark.parametrize(
    ("name", "fault", "portrait"), FAULTS, ids=lambda a: getattr(a, "name", str(a))
)
def test_every_fault_turns_its_square_red(name, fault, portrait):
    case = all_cases()[name]
    assert goes_red(case, portrait, wrong_step(name, fault)), (
        f"survivor: {fault.name} in {name}.{portrait}"
    )


@pytest.mark.parametrize(("name", "portrait"), RULED)
def test_every_cell_that_has_a_rule_has_three_faults(name, portrait):
    killers = [f.name for f in all_faults()[name] if portrait in f.portraits]
    assert len(killers) >= 3, killers


@pytest.mark.parametrize("name", ["rays", "frequencies"])
def test_a_square_that_compares_nothing_is_refused(name):
    case = all_cases()["mirror"]
    empty = {"rays": case.rays[:0], "frequencies": (case.frequencies[0], case.frequencies[1][:0])}
    with pytest.raises(ValueError, match=f"`{name}` must not be empty"):
        dataclasses.replace(case, **{name: empty[name]})
