import pytest

from firstorder.checks.registry import all_cases
from firstorder.checks.squares import PORTRAITS
from firstorder.checks.table import LAWS, as_markdown, as_text, measure, read_verdicts


@pytest.fixture(scope="module")
def table():
    return measure(("warp", "move"))


def test_every_law_has_its_case():
    assert set(LAWS) <= set(all_cases())


def test_the_table_says_what_the_cases_expect(table):
    for name, row in table.items():
        assert tuple(row) == PORTRAITS
        for portrait, square in row.items():
            assert square.verdict == all_cases()[name].expected.get(portrait, "equal")


def test_verdicts_can_be_read_back_from_markdown(table):
    found = read_verdicts(as_markdown(table))
    assert found == {n: tuple(s.verdict for s in row.values()) for n, row in table.items()}


def test_every_refusal_gives_its_reason(table):
    for rendered in (as_markdown(table), as_text(table)):
        for row in table.values():
            assert all(s.reason in rendered for s in row.values() if s.verdict == "refused")


def test_an_unknown_case_is_refused():
    with pytest.raises(ValueError, match="'teleport' is none"):
        measure(("teleport",))
