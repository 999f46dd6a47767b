import gc
import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import jaxlib
import pytest
from jax._src.lru_cache import LRUCache

from firstorder import session


@pytest.fixture(autouse=True)
def flags():
    """Puts back the flags that a test changes: they are global to the process."""
    names = (
        "jax_enable_x64",
        "jax_default_matmul_precision",
        "jax_compilation_cache_dir",
        "jax_persistent_cache_min_compile_time_secs",
        "jax_persistent_cache_min_entry_size_bytes",
    )
    before = {name: getattr(jax.config, name) for name in names}
    yield
    for name, value in before.items():
        jax.config.update(name, value)


@pytest.mark.smoke
@pytest.mark.parametrize(("x64", "dtype"), [(True, jnp.float64), (False, jnp.float32)])
def test_precision_is_the_one_asked_for(tmp_path, x64, dtype):
    session.start(x64=x64, cache=tmp_path)
    assert jnp.asarray(1.0).dtype == dtype


@pytest.mark.parametrize("product", [jnp.dot, lambda a, b: jnp.einsum("ij,jk->ik", a, b)])
def test_products_keep_all_bits_of_their_factors_on_any_device(tmp_path, product):
    session.start(cache=tmp_path)
    ones = jnp.ones((2, 2), jnp.float32)
    assert "precision = [HIGHEST, HIGHEST]" in jax.jit(product).lower(ones, ones).as_text()


@pytest.mark.parametrize(
    ("before", "after"),
    [((700, 10, 10), (10_000, 10, 10)), ((20_000, 5, 5), (20_000, 5, 5)), ((0, 10, 10),) * 2],
    ids=["Python's own", "seldom already", "never"],
)
def test_cycles_are_looked_for_once_in_ten_thousand_objects(tmp_path, before, after):
    ours = gc.get_threshold()
    try:
        gc.set_threshold(*before)
        session.start(cache=tmp_path)
        assert gc.get_threshold() == after
    finally:
        gc.set_threshold(*ours)


def test_settings_are_those_that_change_bits(tmp_path, monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_b=1 --xla_a --xla_dump_to=/tmp --xla_b=2")
    before = session.settings()
    assert before["XLA_FLAGS"] == "--xla_a= --xla_b=2"
    assert before["jaxlib"] == jaxlib.__version__
    monkeypatch.setenv("XLA_FLAGS", "--xla_dump_hlo_as_text --xla_b=2 --xla_a=")
    assert session.differing(before, session.settings()) == ""
    monkeypatch.setenv("XLA_FLAGS", "")
    with jax.enable_x64(False):
        words = session.differing(before, session.settings())
    assert words == "x64 True, now False; XLA_FLAGS --xla_a= --xla_b=2, now none"


def test_an_argument_wins_over_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("FIRSTORDER_CACHE", str(tmp_path / "environment"))
    assert session.start(cache=tmp_path / "argument") == tmp_path / "argument"
    assert session.start() == tmp_path / "environment"


def test_the_environment_wins_over_the_users_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("FIRSTORDER_CACHE", raising=False)
    assert session.start() == tmp_path / "firstorder" / "jax"
    monkeypatch.setenv("FIRSTORDER_CACHE", "off")
    assert session.start() is None
    assert jax.config.values["jax_compilation_cache_dir"] is None


def test_a_folder_that_cannot_be_made_costs_time_only(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    assert session.start(cache=tmp_path / "file" / "cache") is None


# A fresh process each time: this one remembers what it compiled.
PROGRAM = """
import sys
from firstorder import session
session.start(cache=sys.argv[1])
import jax
print(jax.jit(lambda x: x * 3.0)(2.0))
"""


def test_even_the_smallest_function_is_kept_for_the_next_process(tmp_path):
    def run() -> set[Path]:
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM, str(tmp_path)],
            check=True,
            capture_output=True,
            text=True,
        )
        assert done.stdout.strip() == "6.0"
        return {path for path in tmp_path.iterdir() if path.name.endswith("-cache")}

    first = run()
    assert any("lambda" in path.name for path in first)
    assert run() == first


def test_what_is_half_written_is_never_read(tmp_path, monkeypatch):
    """What a process leaves that dies while it writes has another name: no warning, no answer."""
    session.start(cache=tmp_path)

    def double():
        return jax.jit(lambda x: x * 2.0)(3.0)

    def dies(path, value):
        path.write_text("half")
        raise OSError("killed")

    # (JAX takes paths of etils where that is installed.)
    kind = type(LRUCache(str(tmp_path), max_size=-1).path)
    with monkeypatch.context() as patch:
        patch.setattr(kind, "write_bytes", dies)
        with pytest.warns(UserWarning, match="Error writing"):
            assert double() == 6.0
    assert list(tmp_path.iterdir())
    assert double() == 6.0
    assert double() == 6.0
    assert any("lambda" in path.name for path in tmp_path.glob("*-cache"))


BROADCAST_SUM = """
import jax
import jax.numpy as jnp
from firstorder import session
session.start(cache="off")
matrices = jnp.sin(jnp.arange(27.0)).reshape(3, 3, 3)
centers = jnp.cos(jnp.arange(9.0)).reshape(3, 3)
def times(a):
    return jnp.sum(matrices * (jnp.broadcast_to(a, (10_000, 3))[:, None] - centers)[:, :, None], -1)
a = jnp.array([0.3, -0.2, 0.7])
print(float(jnp.max(jnp.abs(times(a) - jax.jit(times)(a)))) < 1e-12)
"""


def test_sums_of_broadcast_products_are_right():
    """Seven lines that jaxlib 0.10.2 to 0.12 get wrong by 1 if left alone."""
    done = subprocess.run([sys.executable, "-c", BROADCAST_SUM], capture_output=True, text=True)
    assert done.stdout.strip() == "True", done.stderr


def test_flags_that_are_given_stay(monkeypatch):
    monkeypatch.setattr("jaxlib.__version__", "0.11.1")
    monkeypatch.setenv("XLA_FLAGS", "--xla_a=1")
    for _ in range(2):
        session._give(session._missing(optimize=True))
    assert os.environ["XLA_FLAGS"] == f"--xla_a=1 {session.flags_of('0.11.1')[0]}"
    own = "--xla_cpu_experimental_ynn_fusion_type=reduce"
    monkeypatch.setenv("XLA_FLAGS", own)
    session._give(session._missing(optimize=True))
    assert os.environ["XLA_FLAGS"] == own


@pytest.mark.parametrize("version", ["0.7.2", "0.13.0"])
def test_versions_that_want_no_flag_get_none(monkeypatch, version):
    monkeypatch.setattr("jaxlib.__version__", version)
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    session._give(session._missing(optimize=True))
    assert "XLA_FLAGS" not in os.environ


QUICK = """
import os, sys
from firstorder import session
session.start(cache="off", optimize=False)
import jax
assert jax.jit(lambda x: x * 3.0)(2.0) == 6.0
print(os.environ["XLA_FLAGS"])
"""


@pytest.mark.parametrize(("given", "level"), [("", "0"), ("1", "1")])
def test_a_program_may_compile_without_optimisation(given, level):
    flag = session.EFFORT
    environment = os.environ | {"XLA_FLAGS": f"{flag}={given}" if given else ""}
    done = subprocess.run(
        [sys.executable, "-c", QUICK], capture_output=True, text=True, env=environment
    )
    assert [f for f in done.stdout.split() if flag in f] == [f"{flag}={level}"], done.stderr


def test_a_level_that_comes_too_late_is_said(tmp_path, monkeypatch):
    assert float(jnp.ones(())) == 1.0  # JAX runs
    monkeypatch.setenv("XLA_FLAGS", " ".join(session.flags_of(jaxlib.__version__)))
    with pytest.warns(UserWarning, match="too late for the flag .*level=0 that compiles without"):
        session.start(cache=tmp_path, optimize=False)


def test_importing_the_library_sets_no_flag():
    program = (
        "import gc, jax; before = dict(jax.config.values), gc.get_threshold();"
        "import firstorder; assert (dict(jax.config.values), gc.get_threshold()) == before"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize(
    ("version", "names"),
    [
        ("0.7.2", []),
        ("0.10.1", ["use_fusion_emitters", "parallel_codegen_split_count"]),
        (
            "0.10.2",
            ["experimental_ynn_fusion_type", "use_fusion_emitters", "parallel_codegen_split_count"],
        ),
        (
            "0.11.0",
            ["experimental_ynn_fusion_type", "use_fusion_emitters", "parallel_codegen_split_count"],
        ),
        ("0.11.1", ["experimental_ynn_fusion_type"]),
        ("0.12.0.1", ["experimental_ynn_fusion_type"]),
        ("0.13.0", []),
    ],
)
def test_flags_are_chosen_by_version(version, names):
    """A version that does not know a flag ends the program; these were tried one by one."""
    found = [flag.split("=")[0].removeprefix("--xla_cpu_") for flag in session.flags_of(version)]
    assert found == names
