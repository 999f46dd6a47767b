"""Gathering: the rows of all Python files in a folder, each beside what a catalogue prints."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import importlib.util
import pathlib
import pkgutil
import sys
import types
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeAlias

from firstorder.ledger.catalogue import Entry, own_entry, read_catalogue
from firstorder.ledger.rows import Row

Ledger: TypeAlias = dict[str, tuple[Entry, Row]]

# What a module of the folder may give by equation, and the attribute of the row that it becomes.
GIVEN = {"DERIVED": "derived", "UNNOTICED": "unnoticed"}


def gather(folder: pathlib.Path, catalogue: Mapping[str, Entry] | None = None) -> Ledger:
    r"""All rows of a folder of Python files, by equation, in the order of the catalogue.

    A file may have `ROWS`, a list of `Row`; `DERIVED`, proofs by equation that start from what the
    library derives (`Row.derived`); and `UNNOTICED`, reasons by equation (`Row.unnoticed`). These
    two may be given for rows of other files. A folder with an `__init__.py` is a package, with its
    subpackages; in any other only the files directly in it count.

    Equations of the catalogue that nobody has a row for get an empty one, which says "not yet".

    Args:
        folder: of .py files.
        catalogue: what papers print; if left out, the *.toml files of the folder and those of its
            subfolder `catalogue`. A row that is in none must say its own `statement`.

    Raises:
        ValueError: one sentence, if there is no such folder or no row in it, or a file cannot be
            imported; a row stands twice, or is in no catalogue and says nothing; or something is
            given for a row that is not there.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.ledger import gather
        >>> folder = pathlib.Path(tempfile.mkdtemp())
        >>> _ = (folder / "optics.py").write_text(
        ...     "from firstorder.ledger import Row\n"
        ...     "ROWS = [Row('P.1', 'identity', statement='Light is linear.')]\n"
        ... )
        >>> [(k, entry.statement) for k, (entry, _) in gather(folder).items()]
        [('P.1', 'Light is linear.')]
    """
    if not folder.is_dir():
        raise ValueError(f"Argument `folder` must be a folder, but is {folder.name}.")
    modules = list(_modules(folder.resolve()))
    rows = _by_equation(row for m in modules for row in _rows(m))
    if not rows:
        raise ValueError(f"No Python file of {folder.name} has `ROWS`.")
    for module in modules:
        _give(rows, module)
    entries = _catalogue(folder) if catalogue is None else dict(catalogue)
    for equation, row in rows.items():
        if row.statement and equation in entries:
            raise ValueError(f"Row {equation} says its `statement`, and so does the catalogue.")
        if equation not in entries:
            entries[equation] = own_entry(row)
    return {k: (entry, rows.get(k) or Row(k, entry.kind)) for k, entry in entries.items()}


def _rows(module: types.ModuleType) -> list[Row]:
    rows = getattr(module, "ROWS", ())
    if not isinstance(rows, (list, tuple)) or not all(isinstance(r, Row) for r in rows):
        raise ValueError(f"{_file(module)}: `ROWS` must be a list of `firstorder.ledger.Row`.")
    return list(rows)


def _file(module: types.ModuleType) -> str:
    return pathlib.Path(module.__file__ or module.__name__).name


def _by_equation(rows: Iterable[Row]) -> dict[str, Row]:
    found: dict[str, Row] = {}
    for row in rows:
        if row.equation in found:
            raise ValueError(f"Row {row.equation} is listed twice.")
        found[row.equation] = row
    return found


def _give(rows: dict[str, Row], module: types.ModuleType) -> None:
    """Attach what a module gives to the rows that it names."""
    for name, attribute in GIVEN.items():
        for equation, what in _given(module, name).items():
            if equation not in rows:
                raise ValueError(f"{_file(module)}: `{name}` names {equation}, which has no row.")
            if getattr(rows[equation], attribute):
                raise ValueError(f"Row {equation} is given `{attribute}` twice.")
            rows[equation] = dataclasses.replace(rows[equation], **{attribute: what})


def _given(module: types.ModuleType, name: str) -> Mapping[str, Any]:
    given = getattr(module, name, {})
    if not isinstance(given, Mapping):
        raise ValueError(f"{_file(module)}: `{name}` must be a dictionary by equation.")
    return given


def _catalogue(folder: pathlib.Path) -> dict[str, Entry]:
    entries: dict[str, Entry] = {}
    for path in (*sorted(folder.glob("*.toml")), *sorted(folder.glob("catalogue/*.toml"))):
        for equation, entry in read_catalogue(path).items():
            if equation in entries:
                raise ValueError(f"{path.name}: {equation} stands in another catalogue already.")
            entries[equation] = entry
    return entries


def _modules(folder: pathlib.Path) -> Iterator[types.ModuleType]:
    """The folder's modules, imported as those of a package or as files."""
    if (folder / "__init__.py").exists():
        _findable(folder.parent)
        package = _imported(folder.name)
        if folder not in map(pathlib.Path, package.__path__):
            raise ValueError(f"Another package is called {folder.name}: rename the folder.")
        yield package
        for info in pkgutil.walk_packages(package.__path__, f"{folder.name}."):
            if not info.name.endswith(".__main__"):
                yield _imported(info.name)
        return
    _findable(folder)
    for path in sorted(folder.glob("*.py")):
        if path.name != "__main__.py":
            yield _of_file(path)


def _findable(folder: pathlib.Path) -> None:
    """What lies in a folder may be imported; last, so that it hides nothing."""
    if str(folder) not in sys.path:
        sys.path.append(str(folder))


def _of_file(path: pathlib.Path) -> types.ModuleType:
    """A file as a module that is called by its whole path: files of two folders do not meet."""
    name = str(path.with_suffix(""))
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        with _told(path.name):
            try:
                spec.loader.exec_module(sys.modules[name])
            except BaseException:
                del sys.modules[name]
                raise
    return sys.modules[name]


def _imported(name: str) -> types.ModuleType:
    with _told(name):
        return importlib.import_module(name)


@contextlib.contextmanager
def _told(name: str) -> Iterator[None]:
    """What goes wrong inside is one sentence about a module."""
    try:
        yield
    except Exception as failure:
        said = f"{type(failure).__name__}: {failure}"
        raise ValueError(f"{name} cannot be imported ({said}).") from failure
