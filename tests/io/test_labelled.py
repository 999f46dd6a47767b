"""Tables and data sets hold the numbers of the arrays to the bit, with their names and units."""

import importlib

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import flatland, space
from firstorder.caching import Cache, Candidates, circular_regions
from firstorder.checks.agreements import Agreements, Found, judged
from firstorder.conventions import Frame
from firstorder.fields import Grid, Jet, gaussian
from firstorder.imaging import GBuffer, RenderedImage, primary_hits
from firstorder.imaging.camera import pinhole
from firstorder.io import curve_to_pandas, layers_to_xarray
from firstorder.ledger import Check, Entry, Row, judge, na, results_to_pandas
from firstorder.plotting import curve_of, portraits
from firstorder.reconstruction import ShadedSamples, sample_image
from firstorder.scene import Derivatives
from firstorder.symbolic import effects
from firstorder.transport import Mirror, Travel

LAMP = flatland.primitive(flatland.Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)
FLOOR = flatland.primitive(flatland.Segments((-1.0, 0.0), (2.0, 0.0)), name="floor")
SCENE = flatland.Scene.of(LAMP, FLOOR)


def numbered(*shape):
    """Numbers that are all different, and none of them round."""
    return np.sqrt(2.0 + np.arange(np.prod(shape, dtype=int), dtype=float)).reshape(shape)


# --- derivatives and jets ------------------------------------------------------------------------


@pytest.mark.smoke
def test_derivatives_of_many_receivers_are_rows():
    parts = (jnp.asarray(numbered(*s)) for s in ((4,), (4, 3), (4, 3, 3)))
    d = Derivatives(*parts, ("x", "y", "n"))
    table = d.to_pandas("W/m")
    assert len(table) == 4
    np.testing.assert_array_equal(table.value, d.value)
    for i, a in enumerate(d.freedoms):
        np.testing.assert_array_equal(table[f"d_{a}"], d.gradient[:, i])
        for j, b in enumerate(d.freedoms):
            np.testing.assert_array_equal(table[f"d_{a}_{b}"], d.hessian[:, i, j])
    units = table.attrs["units"]
    assert [units[c] for c in ("value", "d_x", "d_n", "d_x_n")] == [
        "W/m", "W/m / m", "W/m / rad", "W/m / (m rad)",
    ]  # fmt: skip


def test_derivatives_of_one_receiver_are_one_row_and_no_axis():
    receiver = space.Receiver.at((0.1, 0.2, 0.0))
    ball = space.primitive(space.sphere((0.0, 0.0, 2.0), 0.5), emission=2.0)
    d = space.derivatives(space.irradiance, space.Scene.of(ball), receiver)
    assert d.to_pandas().shape == (1, 1 + 5 + 25)
    found = d.to_xarray("W/m^2")
    assert found.value.dims == ()
    assert found.gradient.sel(freedom="z").item() == float(d.gradient[2])
    np.testing.assert_array_equal(found.hessian, d.hessian)
    assert found.value.attrs["units"] == "W/m^2"
    assert found.unit_of_freedom.sel(freedom="tilt_x") == "rad"


def test_a_grid_of_receivers_keeps_its_axes():
    d = Derivatives(*(jnp.asarray(numbered(*s)) for s in ((2, 3), (2, 3, 1), (2, 3, 1, 1))), ("x",))
    found = d.to_xarray()
    assert found.hessian.dims == ("receiver_0", "receiver_1", "freedom", "freedom_2")
    np.testing.assert_array_equal(found.gradient[..., 0], d.gradient[..., 0])


def test_jets_have_the_names_of_their_frame():
    jet = Jet(*(jnp.asarray(numbered(*s)) for s in ((5,), (5, 2), (5, 2, 2))), Frame(("x", "v")))
    table, found = jet.to_pandas(), jet.to_xarray()
    np.testing.assert_array_equal(table.d_x_v, jet.hessian[:, 0, 1])
    assert table.attrs["units"]["d_x_v"] == "L / m"  # slopes have no unit
    np.testing.assert_array_equal(found.gradient.sel(coordinate="v"), jet.gradient[:, 1])
    assert found.hessian.dims == ("ray", "coordinate", "coordinate_2")


# --- portraits and images ------------------------------------------------------------------------


@pytest.mark.parametrize("frame", [Frame(("x", "theta")), Frame(("x", "v"))])
def test_portraits_are_over_coordinates_and_frequencies(frame):
    grid = Grid((4, 6), (0.5, 0.25))
    light = gaussian((0.1, 0.2), (1.0, 0.5), frame=frame)
    found = portraits("light", light, grid, np.array([-1.0, 0.0, 2.0]), np.array([0.0, 0.5]))
    labelled = found.to_xarray("W/(m rad)")
    x, direction = frame.coordinates
    assert labelled.value.dims == (x, direction)
    assert labelled.spectrum.dims == (f"Omega_{x}", f"Omega_{direction}")
    for name in ("value", "gradient", "spectrum", "covariance"):
        np.testing.assert_array_equal(labelled[name], getattr(found, name))
    np.testing.assert_array_equal(labelled[direction], grid.axis(1))
    np.testing.assert_array_equal(labelled[x], grid.axis(0))
    assert labelled[f"Omega_{x}"].values.tolist() == [-1.0, 0.0, 2.0]
    assert labelled[f"Omega_{direction}"].values.tolist() == [0.0, 0.5]
    assert labelled[f"Omega_{x}"].attrs["units"] == "cycle/m"
    assert labelled[direction].attrs["units"] == {"theta": "rad", "v": "1"}[direction]
    assert labelled.attrs == {"title": "light", "sampled": False}


def test_an_image_is_over_its_pixels():
    px, py = numbered(3), numbered(2)
    image = RenderedImage(px, py, numbered(3, 2), numbered(3, 2, 2), np.arange(6).reshape(3, 2))
    found = image.to_xarray()
    assert found.value.dims == ("px", "py")
    assert found.value.sel(px=px[2], py=py[1]) == image.value[2, 1]
    np.testing.assert_array_equal(found.gradient.sel(along="py"), image.gradient[..., 1])
    np.testing.assert_array_equal(found.label, image.label)
    assert found.value.attrs["units"] == "W/(m^2 sr)"


def test_hits_are_over_an_image_or_over_pixels():
    scene = space.Scene.of(space.primitive(space.sphere((0.0, 0.0, 0.0), 1.0)))
    camera = pinhole((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), gamma=2.0)
    hits = primary_hits(scene, camera, (3, 2))
    found = hits.to_xarray()
    assert found.position.dims == ("px", "py", "axis")
    np.testing.assert_array_equal(found.px, hits.p[:, 0, 0])
    np.testing.assert_array_equal(found.py, hits.p[0, :, 1])
    for name in ("position", "normal", "to_eye", "distance", "cosine", "S", "index", "label"):
        np.testing.assert_array_equal(found[name], getattr(hits, name))
    some = primary_hits(scene, camera, p=hits.p.reshape(-1, 2)).to_xarray()
    assert some.position.dims == ("pixel", "axis")
    np.testing.assert_array_equal(some.py, hits.p.reshape(-1, 2)[:, 1])
    names = ("position", "normal", "to_eye", "distance", "cosine", "S")
    bare = GBuffer(*(getattr(hits, name) for name in names)).to_xarray()
    assert set(bare.coords) == {"axis"}
    assert bare.S.attrs["units"] == "1/m"


def test_layers_are_over_u_and_v():
    layers = {"value": numbered(4, 2), "grad.u": numbered(4, 2) + 1.0}
    found = layers_to_xarray(layers, half_width=2.0)
    assert found.u.values.tolist() == [-1.5, -0.5, 0.5, 1.5]
    assert found.v.values.tolist() == [-0.5, 0.5]
    for name, a in layers.items():
        np.testing.assert_array_equal(found[name], a)
    with pytest.raises(ValueError, match="`layers` must hold arrays of one shape"):
        layers_to_xarray({"a": numbered(2, 2), "b": numbered(2, 3)})


# --- tables --------------------------------------------------------------------------------------


def test_a_curve_is_a_table_with_units():
    curve = curve_of(SCENE, "floor", lambda at: flatland.irradiance(SCENE, at), 5)
    table = curve_to_pandas(curve)
    assert list(table) == list(curve)
    for name, column in curve.items():
        np.testing.assert_array_equal(table[name], column)
    assert table.attrs["units"]["d2E"] == "W/m^3"


def test_a_cache_is_its_table_and_comes_back_from_it():
    places = jnp.asarray(numbered(3, 2))
    records = Candidates.from_function(lambda x: jnp.cos(x[0]) + x[1] ** 2, places)
    cache = Cache.of(records, circular_regions(jnp.array([0.8, 0.5, 0.3]), 0.1, 1.0, dims=2))
    table = cache.to_pandas()
    for name, column in cache.columns().items():
        np.testing.assert_array_equal(table[name], column)
    again = Cache.from_columns({name: table[name].to_numpy() for name in table})
    np.testing.assert_array_equal(again.records.hessian, records.hessian)
    units = table.attrs["units"]
    assert (units["E"], units["dE_dx"], units["d2E_dxdy"]) == ("W/m^2", "W/m^3", "W/m^4")
    line = Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
    line = Cache.of(line, circular_regions(jnp.array([0.8, 0.8]), 0.1, 1.0)).to_pandas()
    assert line.attrs["units"]["E"] == "W/m"


@pytest.mark.parametrize("slopes", [True, False])
def test_samples_of_an_image_are_rows(slopes):
    def shade(p):
        return ShadedSamples(np.sin(p[:, 0]), np.cos(p) if slopes else None, None)

    samples = sample_image(shade, 8, 8, 20, metric=lambda cells: cells.size)
    table = samples.to_pandas()
    np.testing.assert_array_equal(table.value, samples.value)
    np.testing.assert_array_equal(table[["px", "py"]], samples.p)
    np.testing.assert_array_equal(table.leaf, samples.leaf)
    assert ("d_py" in table) is slopes
    if samples.gradient is not None:
        np.testing.assert_array_equal(table.d_py, samples.gradient[:, 1])


def test_agreements_and_effects_are_rows():
    ways = {"closed form": Found(1.0, 1e-15), "differences": Found(1.001, 1e-6), "rays": "none"}
    table = Agreements("a scene", judged("E", ways, "closed form")).to_pandas()
    assert table.verdict.tolist() == ["reference", "differs", "refused"]
    assert table.value[1] == 1.001
    assert table.value.isna()[2]
    found = effects({"travel": Travel(2.0), "mirror": Mirror()})
    table = found.to_pandas()
    assert table.step.tolist() == ["travel", "mirror"]
    assert table.light.tolist() == [str(row.light) for row in found.rows]


def test_judged_rows_have_a_column_for_each_route():
    row = Row(
        "T.1",
        "identity",
        symbolic=lambda: 0,
        autodiff=Check(lambda: 1e-3, 1e-6),
        fourier=na("no spectrum"),
        brute_force=na("one route"),
    )
    table = results_to_pandas([judge(Entry("T.1", "A number."), row)])
    assert table.status.tolist() == ["fail"]
    assert (table.autodiff[0], table.autodiff_error[0]) == ("fail", 1e-3)
    assert table.fourier[0] == "not applicable"
    assert "derived" not in table


# --- without the packages ------------------------------------------------------------------------


@pytest.mark.parametrize(("package", "method"), [("pandas", "to_pandas"), ("xarray", "to_xarray")])
def test_a_missing_package_is_one_sentence_that_names_the_extra(package, method, monkeypatch):
    right = importlib.import_module

    def absent(name, *args):
        if name == package:
            raise ModuleNotFoundError(name)
        return right(name, *args)

    monkeypatch.setattr(importlib, "import_module", absent)
    d = Derivatives(*(jnp.asarray(numbered(*s)) for s in ((2,), (2, 1), (2, 1, 1))), ("x",))
    with pytest.raises(ModuleNotFoundError, match=rf"need the package {package}, which .*tables"):
        getattr(d, method)()


def test_what_is_traced_is_not_tabulated():
    """Tables are of the host: under `jit` JAX says so itself."""
    jet = gaussian((0.0, 0.0), (1.0, 1.0)).jets
    with pytest.raises(jax.errors.TracerArrayConversionError):
        jax.jit(lambda x: jet(x, x).to_xarray())(0.1)
