import ast
import json

import pytest
from PIL import Image

from figures import claims
from figures.verdicts import MEASURED, REFUTED, UNDECIDED
from firstorder.checks.registry import all_cases
from firstorder.checks.squares import PORTRAITS
from firstorder.checks.table import LAWS, read_verdicts

README = claims.README.read_text(encoding="utf-8")
TOLD_BY = {"rule": "at least 0.5", "scanned": "", "verdict": "holds", "reason": ""}
VALUES = {"paper": 0.5, "measured": 0.51234, "error": None, "unit": "m"}
RECORD = {"figure": "a", "claim": "c|d", "source": "R07 §1", **VALUES, **TOLD_BY}


def rows(table):
    return [[c.strip() for c in line.strip("|").split(" | ")] for line in table.splitlines()[2:]]


def test_every_figure_opens_with_what_it_shows_and_can_be_drawn():
    for name, script in claims.scripts().items():
        tree = ast.parse(script.read_text(encoding="utf-8"))
        assert ast.get_docstring(tree), name
        draw = next(n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == "draw")
        assert [a.arg for a in draw.args.args] == ["quick"], name


def test_every_figure_is_among_the_claims_that_are_kept_and_no_other():
    assert {r["figure"] for r in claims.kept()} == set(claims.names())


def test_the_claims_of_the_page_are_those_that_are_kept():
    shown = claims.section(claims.PAGE.read_text(encoding="utf-8"), "claims")
    assert shown == claims.markdown(claims.kept())


def test_the_laws_of_the_readme_are_those_that_the_squares_show():
    # Each square has its verdict by a test of its own: tests/checks/test_squares.py.
    expected = {
        law: tuple(all_cases()[law].expected.get(p, "equal") for p in PORTRAITS) for law in LAWS
    }
    page = claims.LAWS.read_text(encoding="utf-8")
    assert read_verdicts(claims.section(page, "laws")) == expected


def test_the_readme_counts_the_claims_that_are_kept():
    assert claims.section(README, "claims") == claims.summary(claims.kept())


# What the README tells of claims that do not hold: figure, how the claim begins, its words for it.
TOLD = [
    ("d05_fig15", "(20) bounds what the eye sees in a valley", "up to {:,.0f} times"),
    ("d05_fig15", "(21) bounds what the eye sees behind an edge", "{:,.0f} times"),
    (
        "j12_fig22",
        "RMS error of ellipses below that of circles, geometric",
        "{:.0f} % of the error",
    ),
    ("j12_fig13", "A way to enforce a user-specified error bound: largest", "{:.0f} times"),
    (
        "r07_cost_of_a_pixel",
        "Time of the full image over that of 17 % by gradient, 32 x 32 shadow rays",
        "{:.1f} times as fast",
    ),
    ("r07_cost_of_a_pixel", "What gradients add to the time of values, 32 x 32", "add {:.0f} %"),
    ("r07_fig04", "Lambertian, far: B_x is SV+CDV", "{:.2f} of the derivative"),
    ("e11_fig05", "At the rates (17) and (18) replicas stay off", "in {:.0%} of lay-outs"),
]


@pytest.mark.parametrize(("figure", "claim", "words"), TOLD)
def test_what_the_readme_tells_of_a_claim_is_what_was_measured(figure, claim, words):
    found = [r for r in claims.kept() if r["figure"] == figure and r["claim"].startswith(claim)]
    assert [r["verdict"] for r in found] == [REFUTED]
    told = words.format(found[0]["measured"]).replace("%", " %").replace("  %", " %")
    assert told in " ".join(README.split())
    assert f"`{figure}`" in README


def test_every_statement_says_where_it_stands_how_it_was_read_and_why_it_is_refuted():
    kept = claims.statements(claims.kept())
    assert [r["claim"] for r in kept if not (r["source"] and r["rule"])] == []
    refuted = [r for r in kept if r["verdict"] == REFUTED]
    assert [r["claim"] for r in refuted if not r["reason"].endswith(".")] == []


def test_no_statement_is_without_a_verdict():
    assert [r["claim"] for r in claims.kept() if r["verdict"] == UNDECIDED] == []


def test_a_section_is_replaced_and_found_again():
    old = "a\n<!-- begin: x -->\nold\n<!-- end: x -->\nb"
    new = claims.with_section(old, "x", "new")
    assert new == old.replace("old", "new")
    assert claims.section(new, "x") == "new"
    with pytest.raises(ValueError, match="lacks the markers"):
        claims.with_section("nothing", "x", "new")


def test_what_a_run_lacks_is_not_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "FOLDER", tmp_path)
    (tmp_path / "ours").mkdir()
    (tmp_path / "ours" / "a.py").touch()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "claims.json").write_text("[]")
    with pytest.raises(SystemExit, match="The last run lacks a: run `make figures`"):
        claims.keep()


def test_a_full_run_is_kept_without_its_seconds_and_shown(tmp_path, monkeypatch):
    pages = (("README.md", "claims"), ("portraits.md", "laws"), ("CLAIMS.md", "claims"))
    for page, name in pages:
        (tmp_path / page).write_text(f"<!-- begin: {name} -->\n<!-- end: {name} -->\n")
    folder = tmp_path / "figures"
    (folder / "out").mkdir(parents=True)
    (folder / "ours").mkdir()
    (folder / "ours" / "a.py").touch()
    for name in claims.GALLERY:
        Image.new("RGBA", (2 * claims.WIDE, 10)).save(folder / "out" / f"{name}.png")
    record = RECORD
    (folder / "out" / "claims.json").write_text(json.dumps([record | {"seconds": 1.0}]))
    monkeypatch.setattr(claims, "FOLDER", folder)
    monkeypatch.setattr(claims, "KEPT", folder / "claims.json")
    monkeypatch.setattr(claims, "SECONDS", folder / "seconds.json")
    monkeypatch.setattr(claims, "README", tmp_path / "README.md")
    monkeypatch.setattr(claims, "PAGE", tmp_path / "CLAIMS.md")
    monkeypatch.setattr(claims, "LAWS", tmp_path / "portraits.md")
    monkeypatch.setattr(claims.laws, "measure", dict)
    claims.keep()
    assert claims.kept() == [record]
    assert json.loads(claims.SECONDS.read_text()) == {"a": 1.0}
    shown = claims.section(claims.PAGE.read_text(), "claims")
    assert r"| a | R07 §1 | c\|d | 0.5 m | 0.512 m | at least 0.5 | holds |" in shown
    shown = {f.stem for f in (tmp_path / "gallery").iterdir()}
    assert shown == set(claims.GALLERY)
    for file in (tmp_path / "gallery").iterdir():
        with Image.open(file) as image:
            assert image.size == (claims.WIDE, 5)


def test_what_takes_long_or_is_new_is_drawn_first(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "SECONDS", tmp_path / "seconds.json")
    assert claims.longest_first(["a", "b"]) == ["a", "b"]
    claims.SECONDS.write_text('{"a": 1.0, "b": 20.0}')
    assert claims.longest_first(["a", "b", "new"]) == ["new", "b", "a"]


def test_differences_are_told_for_the_figures_that_ran():
    was = [RECORD, RECORD | {"claim": "e", "verdict": MEASURED}]
    other = RECORD | {"figure": "b"}
    assert claims.differences(was, [*was, other]) == []
    now = [RECORD | {"verdict": REFUTED}, RECORD | {"claim": "f"}]
    told = claims.differences(now, was)
    assert claims.differences([other], was) == ["b is new."]
    assert told == ["a: 'f' is new.", "a: 'e' is gone.", "a: 'c|d' was holds and is refuted."]


def test_tables_show_value_unit_and_error_and_keep_their_bars():
    record = RECORD | {"error": 0.0123}
    line = claims.table([record]).splitlines()[-1].split()
    assert line == ["a", "holds", "0.5", "m", "0.512", "±", "0.012", "m", "c|d"]
    number = RECORD | {"verdict": MEASURED}
    wrong = RECORD | {"verdict": REFUTED, "reason": "It is small."}
    page = claims.markdown([number, wrong])
    assert "- **R07 §1** (`a`): c|d. Paper: 0.5 m; measured: 0.512 m. It is small." in page
    assert page.endswith("| a | c\\|d | 0.512 m |")
    assert claims.summary([number, wrong, RECORD]).startswith("The figures judge 2 statements")


def test_what_lies_within_its_error_bar_is_counted_apart():
    told = claims.summary([RECORD, RECORD | {"verdict": UNDECIDED}])
    assert "1 hold, 0 are refuted and 1 lie within their error bar. 0 further" in told
