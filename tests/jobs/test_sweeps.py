"""A table's rows, each once and in order, the same here and on workers that are killed."""

import pathlib
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.flatland import Circles, Receiver, Scene, Segments, irradiance, primitive
from firstorder.jobs import sweep
from tests.jobs.cluster import Cluster

FLOOR = (0.3, 0.0)


def light(radius, height):
    """Irradiance of a floor behind a disc, and its slope by the radius."""

    def behind(radius):
        lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
        disc = primitive(Circles(jnp.stack([0.1, height]), radius))
        return irradiance(Scene.of(lamp, disc), Receiver.at(FLOOR))

    E, slope = jax.value_and_grad(behind)(radius)
    return {"E": E, "dE": slope}


def columns(rows):
    rng = np.random.default_rng(3)
    return {"radius": rng.uniform(0.05, 0.1, rows), "height": rng.uniform(0.5, 0.7, rows)}


def test_the_table_comes_back_with_the_closed_form_of_a_disc_beside_it():
    table = columns(37)
    found = sweep(light, table, batch=8)
    assert list(found) == ["radius", "height", "E", "dE"]
    D = np.hypot(FLOOR[0] - 0.1, table["height"])
    np.testing.assert_array_equal(found["radius"], table["radius"])
    np.testing.assert_allclose(found["dE"], -2.0 * (table["height"] / D) / D, rtol=1e-9)


def test_the_script_of_the_page_sweeps_a_floor(capsys):
    page = pathlib.Path(__file__).parents[2] / "docs" / "many_machines.md"
    names = {}
    exec(re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)[0], names)
    assert capsys.readouterr().out == "['radius', 'x', 'E'] (100,)\n"
    x = names["found"]["x"]
    clear = (0.5 - x) / np.hypot(0.5 - x, 1.0) + (0.5 + x) / np.hypot(0.5 + x, 1.0)
    assert np.all(names["found"]["E"] <= clear + 1e-12)
    np.testing.assert_allclose(names["found"]["E"][0], clear[0], rtol=1e-12)  # beside the shadow


def test_rows_may_be_arrays_and_so_may_results():
    found = sweep(lambda at: {"turned": at[::-1], "sum": at.sum()}, {"at": np.eye(3)}, batch=2)
    np.testing.assert_array_equal(found["turned"], np.eye(3)[:, ::-1])
    np.testing.assert_array_equal(found["sum"], 1.0)
    assert sweep(lambda k: k, {"k": [1, 2, 3]})["value"].dtype == int


def test_a_table_of_pandas_is_a_table():
    frame = pytest.importorskip("pandas").DataFrame({"side": [1.0, 2.0]})
    assert sweep(lambda side: side**2, frame)["value"].tolist() == [1.0, 4.0]


def test_it_compiles_once():
    calls = []
    sweep(lambda k: calls.append(k) or k, {"k": np.arange(100.0)}, batch=7)
    assert len(calls) == 1


@pytest.mark.parametrize(
    ("table", "listed"),
    [({}, "nothing"), ({"a": []}, r"a \(0,\)"), ({"a": 1.0}, r"a \(\)"),
     ({"a": [1.0], "b": [1.0, 2.0]}, r"a \(1,\), b \(2,\)")],
)  # fmt: skip
def test_a_table_that_is_none_is_refused(table, listed):
    with pytest.raises(ValueError, match=f"columns of one length, with rows, but has {listed}"):
        sweep(lambda **row: 0.0, table)


def test_columns_of_one_name_are_refused():
    """The second took the place of the first."""
    with pytest.raises(ValueError, match="must hold each column once, but has two called '1'"):
        sweep(lambda **row: row["1"], {1: [1.0, 2.0], "1": [3.0, 4.0]})


def test_rows_of_several_lengths_are_no_column():
    with pytest.raises(ValueError, match="must hold arrays, but its column 'a' is none"):
        sweep(lambda a: a, {"a": [[1.0, 2.0], [3.0]]})


def test_a_sweep_wants_a_function():
    with pytest.raises(TypeError, match=r"`function` must be a function, but is a|type hint"):
        sweep(3, {"a": [1.0]})  # pyright: ignore[reportArgumentType]


def test_a_result_of_a_columns_name_is_refused():
    with pytest.raises(ValueError, match=r"other names than the columns, but one is 'a'\."):
        sweep(lambda a: {"a": a}, {"a": [1.0]})


@pytest.mark.parametrize(
    ("function", "kind"),
    [(lambda a: (a, a), "tuple"), (lambda a: {"b": [a]}, "list"), (lambda a: None, "NoneType")],
)
def test_a_result_that_is_no_array_is_refused(function, kind):
    with pytest.raises(TypeError, match=f"an array, or several by name, but gives a {kind}"):
        sweep(function, {"a": [1.0, 2.0]})


def test_columns_of_words_are_refused():
    with pytest.raises(ValueError, match="must hold numbers, but its column 'a' holds <U5"):
        sweep(lambda a: 0.0, {"a": ["floor", "wall"]})


@pytest.mark.filterwarnings("ignore:The scheduler at .* has no workers yet")
def test_on_workers_of_which_some_are_killed_it_is_the_same_to_the_bit(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    table = columns(60)
    here = sweep(light, table, batch=4)
    with Cluster(2, tmp_path) as cluster:
        from firstorder.jobs import sweeps

        plain, came = sweeps.run_jobs, []

        def killing(*given, **options):
            for result in plain(*given, **options):
                came.append(result[0])
                if len(came) in (2, 6):
                    cluster.kill_worker()
                yield result

        monkeypatch.setattr(sweeps, "run_jobs", killing)
        there = sweep(light, table, cluster.address, batch=4)
    assert sorted(came) == list(range(15))
    for name, values in here.items():
        assert there[name].tobytes() == values.tobytes()


@pytest.mark.parametrize("table", [[1.0, 2.0], np.zeros((3, 2)), None, 2.0])
def test_a_table_without_names_is_refused(table):
    kind = type(table).__name__
    with pytest.raises(TypeError, match=f"^Argument `table` must hold .* by name, but is a {kind}"):
        sweep(lambda a: a, table)
