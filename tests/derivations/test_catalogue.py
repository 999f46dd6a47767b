"""The catalogue is complete: no numbered equation of the four papers is missing, no row hollow."""

import dataclasses

import pytest

from derivations.catalogue import KINDS, PAPERS, SOURCES, load

COUNTS = {"R07": 72, "J12": 87, "E11": 18, "D05": 21}
FIG2 = [
    f"R07.fig2.{law}.{column}"
    for law in ("multiply", "integrate", "convolve", "move", "warp")
    for column in ("primal", "gradient", "fourier", "wavelet")
]
SITUATIONS = "distant overcast near bump flat flat-envmap lambertian mirror"
FIG4 = [f"R07.fig4.{row}" for row in SITUATIONS.split()]
TABLE1 = [f"D05.T1.{row}" for row in range(1, 11)]


def issue_of(paper, number):
    """The issue that proves a numbered equation."""
    if paper == "D05":
        return 1
    if paper == "E11":
        return 2
    if paper == "J12":
        return 2 if number <= 55 or 74 <= number <= 82 else 3
    if number <= 29 or 50 <= number <= 55 or number in (68, 69):
        return 1
    return 2 if 30 <= number <= 37 or number in (70, 71) else 3


def test_numbered_equations_are_198():
    assert sum(e.numbered for e in load().values()) == 198 == sum(COUNTS.values())


@pytest.mark.parametrize("paper", PAPERS)
def test_numbers_are_contiguous_and_in_order(paper):
    keys = [k for k, e in load().items() if e.numbered and k.startswith(f"{paper}.")]
    numbers = [int(k.split(".")[1]) for k in keys]
    assert numbers == list(range(1, COUNTS[paper] + 1))


def test_papers_come_in_order():
    order = [SOURCES.index(k.split(".")[0]) for k in load()]
    assert order == sorted(order)


def test_numbered_equations_have_their_issue():
    for key, entry in load().items():
        if entry.numbered:
            paper, number = key.split(".")
            assert entry.issue == issue_of(paper, int(number)), key


READ_ONCE_MORE = 17  # the issue of sentences about equations


def test_unnumbered_statements_belong_to_issue_1_but_for_a_few_about_shadows():
    old = {k: e.issue for k, e in load().items() if not e.numbered and e.issue != READ_ONCE_MORE}
    later = {k: issue for k, issue in old.items() if issue != 1}
    later = {k: issue for k, issue in later.items() if not k.startswith("C.")}  # corollaries
    assert later == {
        "D05.s3.4b": 2,  # measured with flatland's periodic blockers
        "R07.fn6": 3,  # Appendix B's frames in space
        "R07.sBa": 3,
        "J12.fn2": 3,  # the largest radiance
        "R07.fn3": 2,  # shadow edges in line
        "R07.fn4": 3,  # shadow edges per azimuth
        "R07.s7.2a": 3,
        "R07.sDa": 3,
        "R07.s6.2": 2,  # the metric that shadow edges give
        "R07.s9.1a": 4,  # adaptive sampling: how D05's metric is put into numbers
        "R07.s9.1b": 4,
        "R07.s9.1c": 4,
        "E11.sBa": 4,  # Appendix B in words
        "E11.sBb": 4,
        "D05.s5.2d": 4,  # the shading chain in 4D
        "D05.s5.2e": 4,
        "D05.s5.2f": 4,
        "D05.s5.2g": 4,
        "D05.s5.2h": 4,
    }


OTHERS = ["R07.fn1", "R07.fn2", "R07.s5.2a", "D05.fn1", "D05.s3.3a", "D05.s4.5", "D05.s6.1a"]


@pytest.mark.parametrize("key", [*FIG2, *FIG4, *TABLE1, *OTHERS])
def test_agreed_ids_exist(key):
    assert not load()[key].numbered


def test_tables_have_no_stray_cells():
    keys = load()
    assert [k for k in keys if k.startswith("R07.fig2.")] == FIG2
    assert [k for k in keys if k.startswith("R07.fig4.")] == FIG4
    assert [k for k in keys if k.startswith("D05.T1.")] == TABLE1


def test_no_row_is_hollow():
    for key, entry in load().items():
        assert entry.equation == key
        assert entry.kind in KINDS, key
        assert entry.statement.strip().endswith("."), key
        assert entry.formula.strip(), key
        assert entry.section.strip(), key
        for text in (entry.statement, entry.formula, entry.suspect):
            assert text == " ".join(text.split()), key


def test_entries_are_frozen():
    entry = load()["R07.1"]
    with pytest.raises(dataclasses.FrozenInstanceError):
        entry.statement = ""  # pyright: ignore[reportAttributeAccessIssue]


def test_load_gives_a_fresh_dictionary():
    load().clear()
    assert load()
