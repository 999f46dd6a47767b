"""The shape of the house: imports run one way, every module has its test, every law its squares."""

import ast
import importlib
import inspect
import json
import os
import pathlib
import pkgutil
import re
import statistics
import subprocess
import sys

import pytest

import firstorder
from derivations import table
from firstorder import laws, transport
from firstorder.checks.registry import all_cases

ROOT = pathlib.Path(__file__).parent.parent
SOURCE = ROOT / "src" / "firstorder"

# Imports run from a layer to an earlier one. Names in one layer do not know each other.
LAYERS = (
    ("errors", "_on_demand"),
    ("_labelled", "_symbols"),
    ("_argument_checks", "conventions", "typing"),
    ("_display",),
    ("numerics", "session"),
    ("sampling",),
    ("fields",),
    ("laws",),
    ("transport",),
    ("symbolic", "visibility"),
    ("scene",),
    ("flatland", "space"),
    ("imaging", "models"),
    ("caching", "shadowfield", "bandwidth", "reconstruction"),
)
# These may import any of the above and each other; none of the above imports them.
ABOVE = ("checks", "ledger", "plotting", "io", "jobs", "rendering", "cli")
RANK = {name: rank for rank, layer in enumerate(LAYERS) for name in layer}

# Imports inside a function that run against the order or around a circle, each with its reason.
EXCEPTIONS: dict[tuple[str, str], str] = {
    ("_display", "symbolic._display"): "formulas are found when a notebook asks: SymPy stays lazy",
    ("_display", "plotting._plot_methods"): "pictures are drawn when asked: matplotlib stays lazy",
    ("_display", "plotting._notebooks"): "the same, when a notebook asks",
    ("_display", "plotting._plot_paths"): "the same, of a path",
    ("_display", "plotting._axes"): "the type of axes, imported by type checkers alone",
}
# Only io reads files (CONTRIBUTING): packages that do so, and that nobody else may import.
READERS = {"trimesh", "embreex", "OpenEXR", "imageio", "svgelements", "xml", "tomllib", "csv"}


def modules():
    """Dotted names of all modules below `firstorder`, without that prefix."""
    for info in pkgutil.walk_packages(firstorder.__path__, "firstorder."):
        yield info.name.removeprefix("firstorder."), info.ispkg


def path_of(name, is_package):
    base = SOURCE.joinpath(*name.split("."))
    return base / "__init__.py" if is_package else base.with_suffix(".py")


def imports(tree):
    """Every module that a file imports, at its top or inside a function."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            module = node.module or ""
            if module == "firstorder":
                yield from (f"firstorder.{alias.name}" for alias in node.names)
            else:
                yield module


def all_imports():
    for name, is_package in modules():
        for target in imports(ast.parse(path_of(name, is_package).read_text(encoding="utf-8"))):
            yield name, target


def against_the_order(source, target):
    """Whether an import of one part of the package by another runs the wrong way."""
    a, b = source.split(".")[0], target.split(".")[0]
    if a == b or a in ABOVE:
        return False
    return b in ABOVE or RANK[b] >= RANK[a]


def test_every_part_of_the_package_has_a_place_in_the_order():
    assert {name.split(".")[0] for name, _ in modules()} <= set(RANK) | set(ABOVE)


def test_imports_run_one_way():
    inside = [(a, b.removeprefix("firstorder.")) for a, b in all_imports() if "firstorder." in b]
    wrong = {pair for pair in inside if against_the_order(*pair)}
    assert wrong - set(EXCEPTIONS) == set()
    assert set(EXCEPTIONS) <= wrong, "an exception that is no longer needed"


@pytest.mark.parametrize(
    ("source", "target", "wrong"),
    [
        ("laws.move", "fields.jet", False),
        ("fields.jet", "laws.move", True),
        ("transport.event", "checks.squares", True),
        ("checks.squares", "transport", False),
        ("flatland.scene", "space.scene", True),
        ("numerics._quadrature", "sampling.strata", True),
    ],
)
def test_the_order_is_what_it_should_be(source, target, wrong):
    assert against_the_order(source, target) is wrong


def test_an_import_inside_a_function_is_seen():
    tree = ast.parse("def f():\n    from firstorder.checks import squares\n")
    assert list(imports(tree)) == ["firstorder.checks"]


def test_only_io_imports_what_reads_files():
    found = {(a, b) for a, b in all_imports() if b.split(".")[0] in READERS}
    assert {a for a, _ in found if a.split(".")[0] != "io"} == set()


def test_only_plotting_imports_matplotlib():
    found = {a for a, b in all_imports() if b.split(".")[0] == "matplotlib"}
    assert {a for a in found if a.split(".")[0] not in ("plotting", "cli")} == set()


def test_one_module_knows_dask():
    """By name, in functions: the package is the extra `cluster`."""
    packages = r"(import_module\(.|_package\(.|import |from )(dask|distributed|cloudpickle)\b"
    found = {p for p in SOURCE.rglob("*.py") if re.search(packages, p.read_text("utf-8"))}
    assert found == {SOURCE / "jobs" / "_dask.py"}


# --- the stem law ------------------------------------------------------------------------------


def module_that_defines(dotted):
    """Name, below `firstorder`, of the module in which a dotted name is defined."""
    parts = dotted.split(".")
    for cut in range(len(parts), 0, -1):
        name = ".".join(parts[:cut])
        try:
            found = importlib.import_module(name)
        except ModuleNotFoundError:
            continue
        for attribute in parts[cut:]:
            found = getattr(found, attribute)
            if inspect.isclass(found) or inspect.isfunction(found):
                name = found.__module__
        return name.removeprefix("firstorder.")
    raise AssertionError(f"{dotted} does not exist")


def implementing():
    """Modules that implement ledger rows."""
    names = {row.implements for _, row in table().values()}
    named = {name for name in names if name.startswith("firstorder.")}
    return sorted({module_that_defines(name) for name in named})


def mirrored(name):
    """Where the derivation and the test of a module belong."""
    *folders, stem = (part.lstrip("_") for part in name.split("."))
    derivation = ROOT.joinpath("derivations", *folders, f"{stem}.py")
    return derivation, ROOT.joinpath("tests", *folders, f"test_{stem}.py")


# Conventions are decided and not derived; `checks` and what is above it judge and show.
UNDERIVED = ("conventions", *ABOVE)


@pytest.mark.parametrize("name", [n for n in implementing() if n.split(".")[0] not in UNDERIVED])
def test_a_module_that_implements_rows_has_its_derivation_and_its_test(name):
    missing = [str(path.relative_to(ROOT)) for path in mirrored(name) if not path.exists()]
    assert not missing


def public_names(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.ClassDef)
    return {n.name for n in tree.body if isinstance(n, kinds) and not n.name.startswith("_")}


@pytest.mark.parametrize("name", [name for name, is_package in modules() if not is_package])
def test_every_module_has_a_test(name):
    """One at the mirrored path, or a test or registered case that uses something it defines.

    A private module is tested through the modules of its chapter that import it.
    """
    if mirrored(name)[1].exists() or ".cases." in f".{name}.":
        return
    if name.rpartition(".")[2].startswith("_"):
        chapter, _, stem = f"firstorder.{name}".rpartition(".")
        wanted = [rf"from {chapter}\.{stem}\b", rf"from {chapter} import [^#]*?\b{stem}\b"]
        texts = [path_of(*module).read_text(encoding="utf-8") for module in modules()]
        assert any(re.search(w, text) for w in wanted for text in texts), "nobody imports it"
        return
    files = {*ROOT.glob("tests/**/*.py"), *SOURCE.glob("checks/cases/**/*.py")}
    files -= {pathlib.Path(__file__), *ROOT.glob("tests/probes/*.py")}  # they name everything
    words = set(re.findall(r"\w+", " ".join(f.read_text(encoding="utf-8") for f in files)))
    assert public_names(path_of(name, False)) & words


# --- the public surface ------------------------------------------------------------------------

# Classes of the same name in flatland and in space, on purpose: one teaches the other.
TWINS = {
    "ConstantSky",
    "GaussianSky",
    "Hits",
    "LightField",
    "Material",
    "PanoramaSky",
    "PhotonMap",
    "Photons",
    "Primitive",
    "Receiver",
    "Scene",
    "Strata",
}
MOST_IN_A_FOLDER = 20
# Functions that share the name of a module of their package, and the reason.
NAMESAKES = {("space", "receiver"): "the older spelling of `Receiver.at`, which many scripts call"}


def private(name):
    return any(part.startswith("_") for part in name.split("."))


def surface():
    """Public names by the public module that defines them."""
    for name, is_package in modules():
        if not (is_package or private(name) or ".cases." in name):
            for public in sorted(public_names(path_of(name, False))):
                yield name, public


def exported_above(name):
    """What the packages export that a module lies in; a root module exports what it defines."""
    folders = name.split(".")[:-1]
    packages = [".".join(folders[: i + 1]) for i in range(len(folders))]
    return {
        n
        for p in packages
        for n in getattr(importlib.import_module(f"firstorder.{p}"), "__all__", ())
    }


def test_every_public_name_is_exported_by_its_package():
    missing = [f"{m}.{n}" for m, n in surface() if "." in m and n not in exported_above(m)]
    assert missing == []


def test_no_class_name_stands_twice_but_for_the_twins_of_the_two_worlds():
    places = {}
    for module, name in surface():
        if name[0].isupper():
            places.setdefault(name, []).append(module.split(".")[0])
    twice = {name: sorted(where) for name, where in places.items() if len(where) > 1}
    assert {n for n, where in twice.items() if where != ["flatland", "space"]} == set()
    assert set(twice) <= TWINS


def test_no_function_takes_the_name_of_a_module_away():
    for name, is_package in modules():
        if is_package:
            package = importlib.import_module(f"firstorder.{name}")
            inside = {info.name for info in pkgutil.iter_modules(package.__path__)}
            taken = {
                n
                for n in inside & set(getattr(package, "__all__", ()))
                if not inspect.ismodule(getattr(package, n))
            }
            taken -= {n for package, n in NAMESAKES if package == name}
            assert not taken, f"{name}: {sorted(taken)}"


def test_a_folder_is_a_chapter():
    crowded = {
        folder: count
        for folder in (p.parent for p in SOURCE.rglob("__init__.py"))
        if (count := len([e for e in folder.iterdir() if e.name[:2] != "__"])) > MOST_IN_A_FOLDER
    }
    assert set(crowded) <= {SOURCE}, crowded


# --- one grammar of the two worlds -------------------------------------------------------------

WORLDS = ("flatland", "space")
# The order of options wherever several of them stand together: what is asked, of which light, how
# finely, and with which random numbers.
OPTIONS = (
    "frame", "out", "brdf", "mirrors", "transport", "where", "samples", "photons", "how", "weight",
    "s", "weights", "radiance", "axis", "nodes", "inner", "most", "cuts", "breaks", "halvings",
    "sliding", "azimuths", "rays", "size", "steps", "along", "points", "reach", "hidden", "count",
    "key", "paths", "branches", "runs", "bounces", "next_event", "survival", "scatter", "lanes",
    "with_error",
)  # fmt: skip
# Options of one name whose defaults differ, and the reason.
OWN_DEFAULTS = {
    (
        "light_field",
        "frame",
    ): "flatland's rays are over (x, theta), those of space over (x, y, v, w)"
}


def questions(world):
    """Signatures of a world's public functions of a scene, by name."""
    found = {}
    for package in [world, *(n for n, is_package in modules() if is_package)]:
        if package.split(".")[0] == world and not private(package):
            module = importlib.import_module(f"firstorder.{package}")
            for name in getattr(module, "__all__", ()):
                f = getattr(module, name)
                if (
                    inspect.isfunction(f)
                    and next(iter(inspect.signature(f).parameters), "") == "scene"
                ):
                    found[name] = inspect.signature(f)
    return found


def of_a_receiver(signature):
    """Whether the second thing that a function wants, or a keyword, is a receiver."""
    return any("Receiver" in str(p.annotation) for p in signature.parameters.values())


def ungrammatical(name, signature):
    """What is wrong with the signature of a question to a scene and a receiver."""
    first, second, *options = signature.parameters.values()
    wrong = [] if "Receiver" in str(second.annotation) else [f"{name}: no receiver after the scene"]
    wrong += [f"{name}({p.name})" for p in options if p.kind is not p.KEYWORD_ONLY]
    wrong += [
        f"{name}({p.name}) has no default" for p in (first, second) if p.default is not p.empty
    ]
    names = [p.name for p in options]
    wrong += [f"{name}: OPTIONS does not place {n}" for n in names if n not in OPTIONS]
    if not wrong and names != sorted(names, key=OPTIONS.index):
        wrong.append(f"{name}: {names} are not in the order of OPTIONS")
    return wrong


@pytest.mark.parametrize("world", WORLDS)
def test_after_scene_and_receiver_everything_is_named(world):
    asked = {n: s for n, s in questions(world).items() if of_a_receiver(s)}
    assert len(asked) > 8
    assert [w for n, s in asked.items() for w in ungrammatical(n, s)] == []


def test_what_both_worlds_answer_is_asked_alike():
    flat, space = (questions(world) for world in WORLDS)
    both = sorted(set(flat) & set(space))
    assert {"irradiance", "light_field", "nearest", "path_irradiance", "trace_strata"} <= set(both)
    for name in both:
        a, b = flat[name].parameters, space[name].parameters
        for option in (set(a) & set(b)) - {o for n, o in OWN_DEFAULTS if n == name}:
            assert a[option].kind == b[option].kind, (name, option)
            assert repr(a[option].default) == repr(b[option].default), (name, option)
        positional = [
            [p.name for p in each.values() if p.kind is not p.KEYWORD_ONLY] for each in (a, b)
        ]
        if not of_a_receiver(flat[name]):
            assert positional[0] == positional[1], name


def test_a_question_that_breaks_the_grammar_is_seen():
    class Receiver: ...

    def loose(scene, at: Receiver, nodes=16): ...
    def late(scene, nodes, at: Receiver): ...
    def mixed(scene, at: Receiver, *, nodes=16, radiance=None): ...

    for f in (loose, late, mixed):
        assert ungrammatical(f.__name__, inspect.signature(f))


# --- every law and event has its squares -------------------------------------------------------


def concrete(module, base):
    """Exported classes of a kind that can be made."""
    found = [getattr(module, name) for name in module.__all__]
    return [
        c for c in found if inspect.isclass(c) and issubclass(c, base) and not inspect.isabstract(c)
    ]


def stepped():
    """Classes of all steps that have squares; those of a chain each count."""
    steps = [case.step for case in all_cases().values()]
    events = [e for step in steps if isinstance(step, transport.Chain) for e in step.events]
    return {type(step) for step in [*steps, *events]}


@pytest.mark.parametrize(
    "step",
    [*concrete(laws, laws.Law), *concrete(transport, transport.Event)],
    ids=lambda step: step.__name__,
)
def test_every_exported_law_and_event_has_a_case(step):
    assert step in stepped()


def test_every_case_file_lies_in_a_folder_of_its_kind():
    folder = SOURCE / "checks" / "cases"
    assert {f.name for f in folder.glob("*.py")} == {"__init__.py"}
    assert {f.parent.name for f in folder.glob("*/*.py")} == {
        "laws",
        "moves",
        "products",
        "scenes",
        "space",
    }


# --- what a tolerance says ---------------------------------------------------------------------


def lax_tolerances(source):
    """Lines on which a tolerance is absolute in words, and NumPy adds a relative one of its own."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and len(node.args) < 3:
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            given = {keyword.arg for keyword in node.keywords}
            if name in ("allclose", "assert_allclose") and "atol" in given and "rtol" not in given:
                yield node.lineno


def test_an_absolute_tolerance_is_one():
    folder = pathlib.Path(__file__).parent
    found = {
        f"{file.relative_to(folder)}:{line}"
        for file in folder.rglob("*.py")
        for line in lax_tolerances(file.read_text(encoding="utf-8"))
    }
    assert not found
    assert [*lax_tolerances("np.allclose(a, b, atol=1e-9)")] == [1]


# --- what importing costs ----------------------------------------------------------------------


def in_a_fresh_process(program, **environment):
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | environment,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


FLAGS = """
import importlib, json, pkgutil
import jax
before = dict(jax.config.values)
import firstorder
for info in pkgutil.walk_packages(firstorder.__path__, "firstorder."):
    if not info.name.endswith("__main__") and ".checks.cases" not in info.name:
        importlib.import_module(info.name)
after = dict(jax.config.values)
changed = [k for k in after if k in before and repr(after[k]) != repr(before[k])]
print(json.dumps([changed, len(jax.live_arrays())]))
"""

# Processor time: on a busy machine the clock on the wall measures the others.
COST = """
import json, time
import jax
start = time.process_time()
import firstorder
print(json.dumps(time.process_time() - start))
"""


def test_importing_every_module_sets_no_jax_flag_and_makes_no_array():
    """An array made on import has the precision of before `session.start`, and wakes the device."""
    assert in_a_fresh_process(FLAGS) == [[], 0]
    assert in_a_fresh_process(FLAGS.replace("import firstorder\n", CHANGE)) == [
        ["jax_enable_x64"],
        1,
    ]


CHANGE = """import firstorder
jax.config.update("jax_enable_x64", True)
kept = jax.numpy.zeros(3)
"""


CONTENTS = """
import importlib, json, pkgutil
package = importlib.import_module("{package}")
public = [m.name for m in pkgutil.iter_modules(package.__path__) if m.name[0] != "_"]
public = [name for name in public if name != "cli"]  # that one is typed, not imported
shown = dir(package)
print(json.dumps([n for n in public if n not in shown or not getattr(package, n)]))
"""


@pytest.mark.parametrize("name", ["", ".flatland", ".space", ".checks"])
def test_every_part_is_an_attribute_and_shown_before_it_is_imported(name):
    assert in_a_fresh_process(CONTENTS.format(package=f"firstorder{name}")) == []


def test_importing_costs_little_on_top_of_jax(tmp_path):
    """From byte code, as an installed package is; the first run writes it."""
    own = {"PYTHONPYCACHEPREFIX": str(tmp_path), "PYTHONDONTWRITEBYTECODE": ""}
    _, *costs = (in_a_fresh_process(COST, **own) for _ in range(4))
    assert statistics.median(costs) <= 0.3
