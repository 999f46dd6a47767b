import pytest

from firstorder.ledger import Row, own_entry, read_catalogue


def written(folder, text):
    file = folder / "paper.toml"
    file.write_text(text)
    return file


def test_entries_keep_their_order_and_their_words(tmp_path):
    file = written(
        tmp_path,
        '["P.2"]\nstatement = "Second."\nformula = "b"\nkind = "definition"\nissue = 3\n'
        '["P.1"]\nstatement = "First."\n',
    )
    second, first = read_catalogue(file).values()
    assert (second.equation, second.statement, second.formula) == ("P.2", "Second.", "b")
    assert second.kind == "definition"
    assert (first.kind, first.formula, first.section) == ("identity", "", "")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('["P.1"]\nformula = "a"', "paper.toml, P.1: `statement` is missing."),
        ('["P.1"]\nstatement = 3', "paper.toml, P.1: `statement` must be a text."),
        ('title = "A paper"', "paper.toml: `title` must be a table."),
        ('["P.1"', "paper.toml, line 1: "),
    ],
)
def test_a_bad_catalogue_is_one_sentence(tmp_path, text, sentence):
    with pytest.raises(ValueError, match=r"paper\.toml") as refusal:
        read_catalogue(written(tmp_path, text))
    assert str(refusal.value).startswith(sentence)


def test_a_row_without_a_catalogue_says_its_own_statement():
    entry = own_entry(Row("P.1", "definition", statement="A.", printed="a"))
    assert (entry.statement, entry.formula, entry.kind) == ("A.", "a", "definition")
    with pytest.raises(ValueError, match=r"Row P\.1 is in no catalogue and has no `statement`\."):
        own_entry(Row("P.1", "identity"))
