import sys

import pytest

from firstorder.ledger import Entry, gather

HEAD = "from firstorder.ledger import Row, na\n"


def folder_of(tmp_path, **files):
    for name, text in files.items():
        (tmp_path / f"{name}.py").write_text(HEAD + text)
    return tmp_path


def row(equation, **more):
    words = "".join(f", {k}={v!r}" for k, v in more.items())
    return f"Row({equation!r}, 'identity'{words})"


def test_rows_of_all_files_are_gathered_with_their_own_statements(tmp_path):
    folder = folder_of(
        tmp_path,
        b=f"ROWS = [{row('P.1', statement='One.', printed='1')}]",
        a=f"from b import ROWS as THEIRS\nROWS = [{row('P.2', statement='Two.')}]",
        c="x = 1",
    )
    ledger = gather(folder)
    assert {k: (e.statement, e.formula) for k, (e, _) in ledger.items()} == {
        "P.1": ("One.", "1"),
        "P.2": ("Two.", ""),
    }


def test_a_catalogue_in_the_folder_gives_statements_and_order(tmp_path):
    folder = folder_of(tmp_path, rows=f"ROWS = [{row('P.1')}, {row('Q.1', statement='Own.')}]")
    (tmp_path / "paper.toml").write_text('["P.2"]\nstatement = "Two."\n["P.1"]\nstatement = "One."')
    ledger = gather(folder)
    assert list(ledger) == ["P.2", "P.1", "Q.1"]
    assert ledger["P.2"][1].symbolic is None
    assert ledger["P.1"][0].statement == "One."


def test_a_catalogue_that_is_given_is_used_instead(tmp_path):
    folder = folder_of(tmp_path, rows=f"ROWS = [{row('P.1')}]")
    ledger = gather(folder, {"P.1": Entry("P.1", "Given.")})
    assert ledger["P.1"][0].statement == "Given."


def test_files_of_two_folders_may_have_one_name(tmp_path):
    for name in "ab":
        (tmp_path / name).mkdir()
        folder_of(tmp_path / name, rows=f"ROWS = [{row('P.' + name, statement=name)}]")
    assert [list(gather(tmp_path / n)) for n in "ab"] == [["P.a"], ["P.b"]]


def test_a_package_is_gathered_with_its_subpackages(tmp_path, monkeypatch):
    package = tmp_path / "paper_of_nobody"
    (package / "part").mkdir(parents=True)
    for init in (package, package / "part"):
        (init / "__init__.py").write_text("")
    (package / "__main__.py").write_text("raise RuntimeError")
    folder_of(package, _words="WORDS = 'One.'")
    one = (
        "from paper_of_nobody._words import WORDS\nROWS = [Row('P.1', 'identity', statement=WORDS)]"
    )
    folder_of(package / "part", one=one)
    monkeypatch.setattr(sys, "path", [*sys.path])
    assert gather(package)["P.1"][0].statement == "One."


def test_derived_proofs_and_reasons_are_attached_to_the_rows_they_name(tmp_path):
    given = "DERIVED = {'P.1': lambda: 1}\nUNNOTICED = {'P.1': 'it is a count'}"
    folder = folder_of(tmp_path, a=given, rows=f"ROWS = [{row('P.1', statement='One.')}]")
    _, found = gather(folder)["P.1"]
    assert found.derived is not None
    assert found.derived() == 1
    assert found.unnoticed == "it is a count"


ONE = f"ROWS = [{row('P.1', statement='One.')}]\n"


@pytest.mark.parametrize(
    ("files", "sentence"),
    [
        ({"a": "x = 1"}, "No Python file of {} has `ROWS`."),
        ({"a": "ROWS = [1]"}, "a.py: `ROWS` must be a list of `firstorder.ledger.Row`."),
        ({"a": ONE, "b": ONE}, "Row P.1 is listed twice."),
        (
            {"a": f"ROWS = [{row('P.1')}]"},
            "Row P.1 is in no catalogue and has no `statement`.",
        ),
        (
            {"a": ONE + "DERIVED = {'P.2': lambda: 0}"},
            "a.py: `DERIVED` names P.2, which has no row.",
        ),
        (
            {"a": ONE + "DERIVED = {'P.1': dict}", "b": "DERIVED = {'P.1': dict}"},
            "Row P.1 is given `derived` twice.",
        ),
        ({"a": ONE + "DERIVED = [1]"}, "a.py: `DERIVED` must be a dictionary by equation."),
    ],
)
def test_a_bad_folder_is_one_sentence(tmp_path, files, sentence):
    with pytest.raises(ValueError, match=r"\.py|\.toml|Row|No Python") as refusal:
        gather(folder_of(tmp_path, **files))
    assert str(refusal.value) == sentence.format(tmp_path.name)


def test_a_folder_that_is_none_is_one_sentence(tmp_path):
    with pytest.raises(ValueError, match="must be a folder, but is nothing"):
        gather(tmp_path / "nothing")


def test_two_truths_are_refused(tmp_path):
    folder = folder_of(tmp_path, a=ONE)
    (tmp_path / "paper.toml").write_text('["P.1"]\nstatement = "Another."')
    with pytest.raises(ValueError, match="and so does the catalogue"):
        gather(folder)
    (tmp_path / "a.py").unlink()
    (tmp_path / "other.toml").write_text('["P.1"]\nstatement = "Another."')
    folder_of(tmp_path, b=f"ROWS = [{row('P.1')}]")
    with pytest.raises(ValueError, match="another catalogue already"):
        gather(folder)


def test_a_file_that_does_not_run_is_one_sentence_and_is_tried_again(tmp_path):
    folder = folder_of(tmp_path, a="raise RuntimeError('no')")
    for _ in range(2):
        with pytest.raises(ValueError, match=r"a\.py cannot be imported \(RuntimeError: no\)"):
            gather(folder)
    folder_of(tmp_path, a=ONE)
    assert list(gather(folder)) == ["P.1"]
