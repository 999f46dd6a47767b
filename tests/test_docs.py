"""The site: pages that the code writes, and links that lead somewhere."""

import collections
import fcntl
import importlib.util
import json
import os
import pathlib
import re
import subprocess
import sys

import jax.numpy as jnp
import numpy as np
import pytest

from docs import browser, generate, links
from docs.generate import api, claims, drawn, equations, own_words, steps
from docs.generate import markdown as md
from figures import claims as figure_claims
from figures.verdicts import REFUTED
from firstorder import io
from firstorder.checks.cases import FREQUENCIES, GRID, RAYS, bell, light
from firstorder.checks.registry import all_cases
from firstorder.checks.squares import Case
from firstorder.conventions import FLATLAND
from firstorder.laws import Law, Move
from firstorder.transport import Chain, Event

DOCS = pathlib.Path(generate.__file__).parents[1]
SPHINX = ("sphinx", "myst_parser", "furo", "latex2mathml")
slow = pytest.mark.slow


@pytest.fixture(scope="session")
def pages_file(tmp_path_factory):
    """Every generated page, as JSON: the formulas take a minute, once for all processes."""
    folder = tmp_path_factory.getbasetemp()
    if os.environ.get("PYTEST_XDIST_WORKER"):
        folder = folder.parent  # that of the run, in which each process has one
    file = folder / "site_pages.json"
    with (folder / "site_pages.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # until it is closed
        if not file.exists():
            io.write_json(file, generate.pages())
    return file


@pytest.fixture(scope="module")
def pages(pages_file):
    return json.loads(pages_file.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def site(pages):
    """All pages by their path below docs, those written by hand too."""
    files = [*DOCS.glob("*.md"), *DOCS.glob("tasks/*.md")]
    by_hand = {p.relative_to(DOCS).as_posix(): p.read_text(encoding="utf-8") for p in files}
    return by_hand | {f"_generated/{path}": text for path, text in pages.items()}


def without_code(text):
    """A page without what is no Markdown."""
    return re.sub(r"^```(?!\{py:)[^\n]*\n.*?^```$", "", text, flags=re.M | re.S)


def labels(site):
    return [name for text in site.values() for name in re.findall(r"^\(([\w-]+)\)=$", text, re.M)]


def described():
    """Dotted names that the pages of the API describe."""
    names = {n: t for n, t in api.public_names().items() if api.home(id(t)) in ("", n)}
    members = {f"{n}.{m}" for n, t in names.items() if isinstance(t, type) for m in members_of(t)}
    modules = {name.rpartition(".")[0] for name in names}
    return set(names) | members | modules


def members_of(cls):
    return [name for name, _ in api._members(cls)]


def dead(site, names):
    """Links that lead nowhere, each with its page."""
    known = set(labels(site))
    found = []
    for path, text in site.items():
        plain = without_code(text)
        paragraphs = re.split(r"\n\s*\n", plain)
        written = "\n".join(re.sub(r"(`+).*?\1", "", p, flags=re.S) for p in paragraphs)
        for target in re.findall(r"(?<!\\)\]\(([^)\s]+)\)", written):
            if target.startswith(("http:", "https:")):
                continue
            file = os.path.normpath(os.path.join(os.path.dirname(path), target))
            lives = target[1:] in known if target.startswith("#") else file in site
            # A page of an earlier run may still lie in the folder: only what is written now counts.
            if not (lives or (not file.endswith(".md") and (DOCS / file).is_file())):
                found.append(f"{path}: {target}")
        for role, target in re.findall(r"\{(py:\w+|download)\}`(?:[^`<]*<)?([^`>]+)>?`", plain):
            # By name: the folders of generated pages may not be there yet.
            file = os.path.normpath(os.path.join(os.path.dirname(path), target))
            there = file in site or pathlib.Path(os.path.normpath(DOCS / file)).is_file()
            if not (there if role == "download" else target in names):
                found.append(f"{path}: {role} {target}")
    return found


@slow
def test_every_law_and_event_of_the_registry_has_its_page(pages):
    for name, case in all_cases().items():
        told = pages[steps.path_of_case(case)]
        assert name.lower() in told.lower()
        assert "What becomes of light" in told
        events = case.step.events if isinstance(case.step, Chain) else (case.step,)
        assert all(steps.path_of(type(event)) in pages for event in events)


@slow
def test_every_portrait_of_every_case_is_told(pages):
    for case in all_cases().values():
        told = pages[steps.path_of_case(case)]
        for portrait in ("Value", "Gradient", "Hessian", "Spectrum", "Covariance", "Wavelet"):
            verdict = case.expected.get(portrait.lower(), "equal")
            assert f"**{portrait}**, {verdict}" in told


class Doubled(Event):
    """Light at twice the place: `l'(x, theta) = l(2 x, theta)`, as in R07 eqs. 53-54."""

    def law(self, frame) -> Law:
        return Move(jnp.diag(jnp.array([2.0, 1.0])))


def test_a_new_event_has_its_page_by_existing(monkeypatch):
    brute = lambda u: bell(2.0 * u[0], u[1])  # noqa: E731
    case = Case("doubled", Doubled(), light(FLATLAND), GRID, FREQUENCIES, RAYS, brute)
    monkeypatch.setattr(steps, "all_cases", lambda: {"doubled": case})
    assert Doubled in steps.steps()
    told = steps._step(Doubled)
    assert steps.path_of(Doubled) == "events/doubled.md"
    assert r"L'(x, \theta) = L\left(2 x, \theta\right)" in told
    assert r"\hat{L}\left(\frac{\Omega_{x}}{2}, \Omega_{\theta}\right)" in told
    assert "[R07.54](#eq-r07-54)" in told


def test_every_row_of_the_ledger_has_one_anchor():
    found = collections.Counter(labels(equations.pages()))
    assert set(found) == {equations.anchor(equation) for equation in equations.ledger()}
    assert set(found.values()) == {1}


def test_errata_are_the_misprints_and_over_claims_with_a_counterexample_each():
    written = equations.pages()
    for equation, (_, row) in equations.ledger().items():
        errata = written.get(f"equations/{row.paper.lower()}-errata.md", "")
        listed = f"### [{equation}](#" in errata
        assert listed == (row.kind in equations.WRONG), equation
    counted = sum(text.count("Counterexample: at") for p, text in written.items() if "errata" in p)
    assert counted == sum(row.kind in equations.WRONG for _, row in equations.ledger().values())


def test_the_errata_are_there_as_plain_text_to_send():
    text = equations.letter("D05")
    assert max(map(len, text.splitlines()[1:])) <= 78
    for equation, (_, row) in equations.ledger().items():
        listed = bool(
            re.search(rf"^{re.escape(equation)}( \(|$)", equations.letter(row.paper), re.M)
        )
        assert listed == (row.kind in equations.WRONG), equation
    assert text.count("\n  Correct: ") == text.count("\n  At ") > 5


def test_every_figure_is_in_the_gallery_and_says_where_its_claims_are(monkeypatch):
    shown = claims.gallery()
    kept = figure_claims.kept()
    assert [n for n in figure_claims.names() if f"## {n}\n" not in shown] == []
    judged = {record["figure"] for record in figure_claims.statements(kept)}
    assert {n for n in judged if f"](#figure-{n.replace('_', '-')})" not in shown} == set()
    wrong = {record["figure"] for record in kept if record["verdict"] == REFUTED}
    assert shown.count(" are refuted") == len(wrong)
    assert [g for g in figure_claims.GALLERY if f"../gallery/{g}.png" not in shown] == []


def test_all_claims_stand_in_one_table_with_a_field_to_filter_them():
    page = claims.pages()["claims/all.md"]
    assert len(re.findall(r"^\| \[", page, re.M)) == len(figure_claims.kept())
    assert '<input type="search" class="filter"' in page
    assert "input.filter" in (DOCS / "_static" / "filter.js").read_text(encoding="utf-8")


def test_what_the_papers_call_an_event_is_in_the_glossary():
    called = {thing.__name__: words for thing, words in own_words.papers_words()}
    assert called["Mirror"] == "mirror reparameterization (R07 step 2, D05 step 4)."
    page = own_words.pages()["glossary.md"]
    assert all(md.escaped(words, cell=True) in page for words in called.values())
    assert "silhouette: all of it" in page


def test_how_to_add_something_stands_on_one_page_only():
    written = own_words.pages()
    assert "## An event" in written["adding.md"]
    assert "Attack it: units" in written["adding.md"]
    assert "Attack it: units" not in written["contributing.md"]


def test_the_picture_of_the_conventions_has_the_codes_directions():
    panels = drawn.figure().axes
    assert len(panels) == 6
    tips = [
        np.asarray(line.get_xydata())[-1] for line in panels[0].lines if line.get_alpha() == 0.0
    ]
    expected = [(0.0, 1.0), (-np.sin(0.6), np.cos(0.6)), (1.0, 0.0)]
    np.testing.assert_allclose(tips, expected, rtol=0.0, atol=1e-12)
    longest = max(panels[5].lines, key=lambda line: np.size(line.get_xdata()))
    lamp = np.asarray(longest.get_xydata())
    np.testing.assert_allclose(lamp[[0, -1]], [(3.0, 2.0), (1.0, 2.0)], rtol=0.0, atol=1e-12)
    text = drawn.pages()["sides.svg"]
    assert text == drawn.pages()["sides.svg"]
    assert "l'(x, v) = l(x - v d, v)" in text


def test_a_counterexample_on_the_page_is_what_its_functions_say():
    row = equations.ledger()["R07.fig2.integrate.wavelet"][1]
    said = re.findall(r"\*\*([-\d.e+]+)\*\*", equations._correction(row))
    np.testing.assert_allclose(
        [float(s) for s in said], [3 * np.pi**0.5 / 9, np.pi**0.5], rtol=1e-5
    )


@slow
def test_links_between_pages_lead_somewhere(site):
    assert dead(site, described()) == []
    assert len(set(labels(site))) == len(labels(site))


def test_a_link_that_leads_nowhere_is_seen():
    good = "(here)=\n# A\n\n[b](b.md), [b](#here), {py:obj}`x <a.b>`, {download}`x <conf.py>`"
    assert dead({"a.md": f"{good}, {{download}}`c.txt`", "b.md": "# B", "c.txt": ""}, {"a.b"}) == []
    for wrong in ("[b](c.md)", "[b](#there)", "{py:obj}`x <a.c>`", "{download}`x <gone.py>`"):
        assert len(dead({"a.md": f"{good}, {wrong}", "b.md": "# B"}, {"a.b"})) == 1


def test_pages_that_are_gone_are_removed(tmp_path):
    generate.write(tmp_path / "out", {"old/page.md": "# Old"})
    generate.write(tmp_path / "out", {"new.md": "# New"})
    assert [p.name for p in (tmp_path / "out").rglob("*")] == ["new.md"]


def test_every_public_name_is_described_once_and_with_its_words():
    written = api.pages()
    for name, thing in api.public_names().items():
        if isinstance(thing, type) and api.home(id(thing)) == name:
            chapter, _, last = name.removeprefix("firstorder.").rpartition(".")
            assert written[f"api/{chapter}.md"].count(f"{{py:class}} {last}(") == 1, name
    assert "Light after a distance: `l'(x, v) = l(x -+ v d, v)`" in written["api/transport.md"]
    assert (
        "- `d` (`Scalar`): distance along the normal of the reference line"
        in written["api/transport.md"]
    )


def test_a_built_site_with_a_broken_link_is_seen(tmp_path):
    (tmp_path / "a.html").write_text(
        '<p id="top"><a href="b.html#there">b</a> <a href="#top">a</a>'
    )
    (tmp_path / "b.html").write_text('<p id="there"><a href="https://example.org">out</a>')
    assert links.broken(tmp_path) == []
    (tmp_path / "b.html").write_text('<p id="elsewhere"><img src="gone.png">')
    assert links.broken(tmp_path) == ["a.html: b.html#there", "b.html: gone.png"]
    assert links.main(str(tmp_path)) == 1


@pytest.mark.skipif(browser.browser() is None, reason="there is no browser here")
def test_a_page_that_fails_in_a_browser_is_seen(tmp_path):
    found = '<h1>A</h1><ul role="list" class="search"><li>here</li></ul>'
    for name in ("index", "search"):
        (tmp_path / f"{name}.html").write_text(found)
    assert browser.main(str(tmp_path)) == 0
    (tmp_path / "index.html").write_text("<p><script>throw new Error('gone')</script>")
    (tmp_path / "search.html").write_text(found.replace("li>", "p>"))
    words = browser.wrong(tmp_path)
    assert ["Uncaught" in words[0], *words[1:]] == [
        True,
        "index.html: no heading is shown",
        "search: nothing is found for irradiance",
    ]
    assert browser.main(str(tmp_path)) == 1


def test_where_there_is_no_browser_that_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(browser, "browser", lambda: None)
    assert browser.main(str(tmp_path)) == 0
    assert "no browser" in capsys.readouterr().out


@slow
@pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in SPHINX),
    reason="the site is built only where Sphinx is: `make docs` installs it, builds and walks it",
)
def test_the_site_builds_without_a_warning_and_no_link_is_broken(tmp_path, pages_file):
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "--quiet", "-b", "html"]
    given = ["-D", f"pages={pages_file}", str(DOCS), str(tmp_path)]
    built = subprocess.run([*command, *given], capture_output=True, text=True, cwd=DOCS.parent)
    assert built.returncode == 0, built.stderr
    assert links.broken(tmp_path) == []
