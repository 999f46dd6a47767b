"""Keys of scene files: each reader is run on a minimal file, and what it asks for is written down.

So a table has what the reader knows, with how it is read and what stands for it if it is left out.
What it means is said at the head of the reader's module, which opens each part of the page.
"""

from __future__ import annotations

import functools
import inspect
import pathlib
import re
import tempfile
import textwrap
import types
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from docs.generate import api
from docs.generate import markdown as md
from docs.generate.docstrings import told
from firstorder.io.scenes import _surface_maps, flatland_toml, space_toml
from firstorder.io.scenes._beside import Beside
from firstorder.io.scenes._elements import Place
from firstorder.io.scenes._skies import sky_of
from firstorder.io.scenes._toml_tables import TomlTable
from firstorder.io.scenes._toml_text import exact_text, quoted
from firstorder.io.svg import _xml, reader

HEAD = ("kind", "key", "is", "if left out")
Row = tuple[str, str, str, str]
Tables = dict[str, list[Row]]  # by their headers
_AT, _UP, _ONE = [0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0]
_PICTURE = [[0.0, 0.2, 0.4, 0.6]] * 4
_COLOURS = [[[0.5, 0.5, 1.0]] * 4] * 4
# The least that each reader takes, by the kind; of some kinds several, for their several ways.
FLATLAND = {
    "segment": [{"start": [0.0, 0.0], "end": [1.0, 0.0]}],
    "arc": [{"center": [0.0, 0.0], "radius": 1.0, "start": 0.0, "sweep": 1.0}],
    "circle": [{"center": [0.0, 0.0], "radius": 1.0}],
    "ellipse": [{"center": [0.0, 0.0], "semi": [1.0, 2.0]}],
    "curve": [{"cosines": [[0.0, 0.0], [1.0, 0.0]], "sines": [[0.0, 0.0], [0.0, 1.0]]}],
    "polyline": [{"points": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]}],
    "box": [{"low": [0.0, 0.0], "high": [1.0, 1.0]}],
}
FLATLAND_SKIES = {
    "constant": [{"radiance": 1.0}],
    "gaussian": [{}],
    "row": [{"values": [0.0, 1.0, 1.0, 0.0]}, {"file": "picture.hdr"}],
}
_AXES = {"center": _AT, "axes": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}
SPACE = {
    "sphere": [{"center": _AT, "radius": 1.0}],
    "ellipsoid": [{"center": _AT, "semi": [1.0, 2.0, 3.0]}, _AXES],
    "box": [{"low": [0.0, 0.0, 0.0], "high": [1.0, 1.0, 1.0]}, _AXES],
    "cylinder": [{"base": _AT, "top": _UP, "radius": 1.0}, _AXES],
    "disc": [{"center": _AT, "normal": _AT, "radius": 1.0}, _AXES],
    "rectangle": [{"center": _AT, "u": _ONE, "v": [0.0, 1.0, 0.0]}, _AXES],
    "triangle": [{"corners": [_AT, _UP, _ONE]}, _AXES],
    "polygon": [{"vertices": [_AT, _ONE, _UP]}],
    "plane": [{"point": _AT, "normal": _AT}, _AXES],
}
MESHES = [{"file": "mesh.obj"}, {"vertices": [_AT, _UP, _ONE], "faces": [[0, 1, 2]]}]
SPACE_SKIES = {
    "constant": [{"radiance": 1.0}],
    "gaussian": [{}],
    "panorama": [{"values": _PICTURE}, {"file": "picture.hdr"}],
    "harmonic": [{"coefficients": [1.0]}],
}
CAMERAS = [{"eye": _UP, "look_at": [1.0, 0.0, 0.0], "gamma": 2.0},
           {"eye": _UP, "axes": _AXES["axes"], "gamma": 2.0}]  # fmt: skip
_WAVES = {"waves": [_ONE]}
MAPS = {
    ("texture", "picture"): [{"values": _PICTURE}, {"file": "picture.hdr"}],
    ("texture", "waves"): [_WAVES],
    ("bump", "picture"): [{"values": _PICTURE}, {"file": "picture.hdr"}],
    ("bump", "waves"): [_WAVES | {"size": 0.01}],
    ("normal_map", "picture"): [{"values": _COLOURS}, {"file": "picture.hdr"}],
    ("normal_map", "waves"): [{"lean": _ONE}, _WAVES | {"lean": _ONE}],
}
_DRAWN = {"width": "2", "height": "2", "r": "1", "rx": "1", "ry": "1", "points": "0,0 1,0 1,1",
          "d": "M 0 0 L 1 1"}  # fmt: skip


def pages() -> dict[str, str]:
    """The page."""
    parts = [_toml("Flatland", flatland_toml, flatland()), _toml("Space", space_toml, space())]
    parts += [_toml("Textures, bumps and normal maps", _surface_maps, surface_maps(), 3), _svg()]
    words = (
        "All that readers of scene files know: "
        f"{api.reference(_public('read_scene'))} and {api.reference(_public('read_space'))} read "
        "TOML, and the first one SVG too. What they do not know is an error that names the key "
        "that was meant. How files are written and drawn: [scenes](../scenes.md)."
    )
    return {"scene_files.md": md.page("Keys of scene files", words, *parts)}


def _public(name: str) -> Any:
    return api.public_names()[f"firstorder.io.{name}"]


# --- TOML ----------------------------------------------------------------------------------------


class Asked(TomlTable):
    """A table that notes what it is asked for: how a key is read, and its default."""

    def __init__(self, values: Mapping[str, Any]):
        super().__init__(values, Place("scene", None, "shape 1"), {}, "shape", 0)
        self.asked: dict[str, tuple[str, Any]] = {}

    def take(self, key: str, read: Callable[[Any], Any], default: Any = ...) -> Any:
        """A key's value, as `TomlTable.take`."""
        self.asked.setdefault(key, (_first(read), default))
        return super().take(key, read, default)

    def file(self, beside: Beside, key: str = "file") -> pathlib.Path:
        """A path, as `TomlTable.file`: more than the text that it is."""
        self.asked[key] = ("The name of a file below the scene's folder.", ...)
        return super().file(beside, key)

    def inner(self, key: str) -> TomlTable | None:
        """A table within this one, of which there is none here."""
        self.asked[key] = ("A table: textures, bumps and normal maps below.", None)
        return super().inner(key)


def _first(read: Callable[[Any], Any]) -> str:
    return (inspect.getdoc(read) or "").partition("\n")[0]


def keys_of(read: Callable[[Asked], Any], ways: list[dict[str, Any]], **more: str) -> dict:
    """What a reader asks for in all its ways: by the key, how it is read, and its default."""
    found: dict[str, tuple[str, Any]] = {}
    for values in ways:
        table = Asked(values | more)
        read(table)
        for key, (how, default) in table.asked.items():
            found.setdefault(key, (how, _instead(key, ways) if default is ... else default))
    return found


def _instead(key: str, ways: list[dict[str, Any]]) -> Any:
    """What may stand for a key in the other ways of a table; none if they do without."""
    others = [way for way in ways if key not in way]
    if len(others) in (0, len(ways)):
        return ...
    having = {k for way in ways if key in way for k in way}
    return Others(tuple(k for way in others for k in way if k not in having)) or None


class Others(tuple[str, ...]):
    """Keys of which one table has none or all."""


@functools.cache
def flatland() -> Tables:
    """Keys of a flatland scene."""
    light = [{"position": [0.0, 0.0], "intensity": 1.0}]
    kinds = {k: keys_of(flatland_toml._element, FLATLAND[k], kind=k) for k in _kinds(flatland_toml)}
    with _folder() as beside:
        skies = _skies_of(lambda table: flatland_toml._sky(table, beside), FLATLAND_SKIES)
    return {
        "[[shape]]": _by_kind(kinds),
        "[[light]]": _rows("", keys_of(flatland_toml._light, light)),
        "[environment]": _by_kind(skies),
    }


@functools.cache
def space() -> Tables:
    """Keys of a scene of space."""
    with _folder() as beside:
        kinds = {
            k: keys_of(lambda table: space_toml._thing(table, beside), SPACE[k], kind=k)
            for k in _kinds(space_toml)
        }
        meshes = keys_of(lambda table: space_toml._model(table, beside), MESHES)
        skies = _skies_of(lambda table: sky_of(table, beside), SPACE_SKIES)
    return {
        "[[shape]]": _by_kind(kinds),
        "[[mesh]]": _rows("", meshes),
        "[environment]": _by_kind(skies),
        "[camera]": _rows("", keys_of(space_toml._camera, CAMERAS)),
    }


@functools.cache
def surface_maps() -> Tables:
    """Keys of the tables within shapes and meshes of space."""
    readers = (_surface_maps._TEXTURE, _surface_maps._BUMP, _surface_maps._NORMALS)
    with _folder() as beside:
        return {
            f"[shape.{table}], [mesh.{table}]": _by_kind({
                kind: keys_of(lambda t, of=read: of(t, beside), MAPS[table, kind])
                for kind, read in kinds.items()
            })
            for table, kinds in zip(_surface_maps.TABLES, readers, strict=True)
        }  # fmt: skip


def _skies_of(read: Callable[[Asked], Any], ways: Mapping[str, list[dict[str, Any]]]) -> dict:
    return {kind: keys_of(read, of, kind=kind) for kind, of in ways.items()}


def _kinds(module: types.ModuleType) -> tuple[str, ...]:
    return tuple(vars(module)["_GEOMETRY"])


class _folder:
    """A folder with a picture and a mesh, for as long as readers look into it."""

    def __enter__(self) -> Beside:
        self._of = tempfile.TemporaryDirectory()
        folder = pathlib.Path(self._of.name)
        head = b"#?RADIANCE\n\n-Y 4 +X 4\n"
        (folder / "picture.hdr").write_bytes(head + bytes([100, 100, 200, 128]) * 16)
        (folder / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "utf-8")
        return Beside(folder)

    def __exit__(self, *_: object) -> None:
        self._of.cleanup()


def _by_kind(kinds: Mapping[str, dict[str, Any]]) -> list[Row]:
    """Keys that all kinds have, and then those of each."""
    first, *others = kinds.values()
    shared = {k: v for k, v in first.items() if all(of.get(k) == v for of in others)}
    kind = {"kind": (" or ".join(f"`{k}`" for k in kinds), ...)}
    rows = _rows("any", kind | {k: v for k, v in shared.items() if k != "kind"})
    for name, of in kinds.items():
        rows += _rows(name, {k: v for k, v in of.items() if k not in shared})
    return rows


def _rows(kind: str, keys: Mapping[str, tuple[str, Any]]) -> list[Row]:
    return [
        (kind, f"`{key}`", md.escaped(how.rstrip("."), cell=True), _left_out(default))
        for key, (how, default) in keys.items()
    ]


def _left_out(default: Any) -> str:
    """What stands for a key that is not there, as TOML writes it."""
    match default:
        case None:
            return "none"
        case str():
            return f"`{quoted(default)}`"
        case bool():
            return f"`{str(default).lower()}`"
        case int():
            return f"`{default}`"
        case float() | list():
            return f"`{exact_text(default)}`"
        case Others():
            return f"an error, unless there is {_listed(default)}"
    return "an error"


def _toml(title: str, module: types.ModuleType, tables: Tables, depth: int = 2) -> str:
    """What a reader's module says of its keys, and a table of those that it asks for."""
    said = told(inspect.getdoc(module) or "").replace("```text", "```toml")
    parts = [f"{'#' * depth} {title}", said]
    for header, rows in tables.items():
        # what has no kinds has no column of them
        first = 0 if any(row[0] for row in rows) else 1
        parts += [f"What may stand in `{header}`:".replace("], [", "]` or `["),
                  md.table(HEAD[first:], [row[first:] for row in rows])]  # fmt: skip
    return "\n\n".join(parts)


# --- SVG -----------------------------------------------------------------------------------------


class _Noted(dict[str, str]):
    """Attributes of an element that note which of them are asked for."""

    def __init__(self, attributes: Mapping[str, str], asked: dict[str, None]):
        super().__init__(attributes)
        self.asked = asked

    def get(self, key: str, default: Any = None) -> Any:
        """An attribute, as of any mapping."""
        self.asked[key] = None
        return super().get(key, default)

    def __contains__(self, key: object) -> bool:
        self.asked[str(key)] = None
        return super().__contains__(key)


@functools.cache
def attributes() -> dict[str, tuple[str, ...]]:
    """Attributes that are asked for, by the element, but for those that may be styles."""
    tags = [tag for tag in (*reader.SHAPES, *reader.GROUPS) if tag != "svg"]
    drawn = " ".join(f'{k}="{v}"' for k, v in _DRAWN.items())
    inner = "".join(
        f'<switch><{tag} href="#one" {drawn}><g id="one"/></{tag}></switch>' for tag in tags
    )
    # a symbol is walked where it is used
    source = f'<svg xmlns="{_xml.SVG}">{inner}<symbol id="two"/><use href="#two"/></svg>'
    root = _xml.tree(source.encode(), "drawing")
    asked: dict[str, dict[str, None]] = {tag: {} for tag in ("svg", *tags)}
    for node in root.walk():
        node.attributes = _Noted(node.attributes, asked[node.tag])
    made = reader._Reader(root, "drawing", None)
    list(made.walk(root, made.start, 0))
    return {tag: tuple(keys) for tag, keys in asked.items()}


def _svg() -> str:
    """What a drawing may say."""
    blocks = re.split(r"\n(?=\S)", (inspect.getdoc(reader) or "").partition("\n\n")[2])
    said = [
        f"### {head}\n\n{md.escaped(textwrap.dedent(words).strip())}"
        for head, _, words in (block.partition("\n") for block in blocks)
    ]
    root, asked = attributes()["svg"], attributes()
    inner = [of for tag, of in asked.items() if tag not in ("svg", "symbol")]
    any_element = [key for key in asked["g"] if all(key in of for of in inner)]
    elements = [
        (f"`<{tag}>`", _listed(key for key in keys if key not in (*any_element, "viewBox")))
        for tag, keys in asked.items()
        if tag != "svg"
    ]
    elements.insert(0, ("`<svg>`", _listed(key for key in root if key not in any_element)))
    elements += [
        ("any", _listed([*any_element, *sorted(_xml._READ), *_of_our_own()])),
        ("left out, with all in it", _listed(f"<{tag}>" for tag in sorted(reader.SILENT))),
    ]
    return "\n\n".join([
        "## SVG drawings",
        *said,
        "### Elements, attributes and classes",
        f"Classes that mean something are {_listed([*reader.CLASSES, *reader.DRAWN])}. Of a style "
        f"{_listed(sorted(_xml._READ))} are read, and of elements these attributes:",
        md.table(("element", "attributes"), elements),
    ])  # fmt: skip


def _of_our_own() -> list[str]:
    """Attributes that SVG does not have, but for those of the root."""
    return [f"data-{key}" for key in reader.DATA if f"data-{key}" not in attributes()["svg"]]


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
