"""Catalogues: what papers print, in our own words, one TOML table for each statement."""

from __future__ import annotations

import dataclasses
import pathlib
from typing import Any

from firstorder.io.scenes._toml_tables import parsed
from firstorder.ledger.rows import Row


@dataclasses.dataclass(frozen=True)
class Entry:
    """One statement of a paper, as it is printed.

    Attributes:
        equation: id, such as "R07.25", or "D05.s4.5" for a statement without a number.
        statement: what it says, in our words.
        formula: the printed formula in ASCII, in the paper's symbols.
        kind: a first guess; the ledger's rows have the last word.
        section: section of the paper.
        suspect: why it may be misprinted or claim too much; "" if it is not suspected.

    Example:
        >>> from firstorder.ledger import Entry
        >>> Entry("P.1", "Light is linear.", "L(a + b) = L(a) + L(b)").kind
        'identity'
    """

    equation: str
    statement: str
    formula: str = ""
    kind: str = "identity"
    section: str = ""
    suspect: str = ""


_FIELDS = tuple(f.name for f in dataclasses.fields(Entry))


def read_catalogue(path: pathlib.Path) -> dict[str, Entry]:
    r"""Entries of a TOML file by id: one table for each, with the attributes of `Entry` as keys.

    Keys that `Entry` does not have are the catalogue's own affair.

    Raises:
        ValueError: one sentence, if the file is no TOML, or a table does not say its statement.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.ledger import read_catalogue
        >>> file = pathlib.Path(tempfile.mkdtemp(), "paper.toml")
        >>> _ = file.write_text('["P.1"]\nstatement = "Light is linear."')
        >>> read_catalogue(file)["P.1"].statement
        'Light is linear.'
    """
    _, tables = parsed(path.read_bytes(), path.name)
    return {equation: _entry(path.name, equation, t) for equation, t in tables.items()}


def _entry(file: str, equation: str, table: Any) -> Entry:
    if not isinstance(table, dict):
        raise ValueError(f"{file}: `{equation}` must be a table.")
    known = {k: v for k, v in table.items() if k in _FIELDS}
    if wrong := [k for k, v in known.items() if not isinstance(v, str)]:
        raise ValueError(f"{file}, {equation}: `{wrong[0]}` must be a text.")
    if not known.get("statement"):
        raise ValueError(f"{file}, {equation}: `statement` is missing.")
    return Entry(**{**known, "equation": equation})


def own_entry(row: Row) -> Entry:
    """Entry of a row without a catalogue, by what the row says of itself.

    Raises:
        ValueError: if it says nothing.

    Example:
        >>> from firstorder.ledger import Row, own_entry
        >>> own_entry(Row("P.1", "definition", statement="Light is linear.")).statement
        'Light is linear.'
    """
    if not row.statement:
        raise ValueError(f"Row {row.equation} is in no catalogue and has no `statement`.")
    return Entry(row.equation, row.statement, row.printed, row.kind)
