"""What holds for every field. A new field is one line of `FIELDS`.

Off-centre and correlated throughout, on grids of even and odd size that are not square.
"""

import dataclasses
import functools
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise, rounding
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Affine,
    BoxProfile,
    Constant,
    DiracProfile,
    Environment,
    Field,
    Function,
    Gaussian,
    GaussianProfile,
    Grid,
    HalfPlane,
    Harmonics,
    NearLight,
    Separable,
    SoftEdge,
    Spline,
    UniformProfile,
    autodiff_jet,
    covariance_of,
    covariance_of_samples,
    discrete_transform,
    gaussian,
    point_light,
    spot_light,
)
from firstorder.fields.apertures import Bars, Grating, SoftSlit
from firstorder.numerics._batching import batched
from firstorder.transport.events.travel import line_light

OFFSET, ANGLE = Frame(("x",)), Frame(("theta",))
GRID = Grid.spanning((96, 97), (5.0, 4.5))
WINDOW = Grid.spanning((400, 301), (2.0, 1.7), (0.3, -0.1))
WIDE = Grid.spanning((48, 49), (4.4, 4.2), (0.3, -0.1))
TILTED = [0.8, -0.5]


@dataclasses.dataclass(frozen=True)
class Entry:
    """A field and what it answers.

    Attributes:
        make: builds it, in the precision that is set.
        grid: samples that hold it and its spectrum; None if its spectrum must refuse.
        covariance: "finite" or "refused"; checked on the grid if it has one.
        window: box on which its series must reproduce it; None if that is not asked.
        values: False if even its value refuses.
        condition: of its jet in the coordinates of the ray.
        grid_error: stated error of the samples' transform, where it is not rounding.
        edges: whether it breaks.
        variant: the code of another entry at other settings; precision and parameters are not
            asked again.
    """

    make: Callable[[], Field]
    grid: Grid | None = None
    covariance: str = "refused"
    window: Grid | None = None
    values: bool = True
    condition: float = 10.0
    grid_error: float = 1e-9
    edges: bool = False
    variant: bool = False


def bell(frame=FLATLAND, amplitude=1.3):
    return gaussian((0.21, -0.13), (0.55, 0.4), 0.35, amplitude, frame)


def bell_4d():
    A = np.array([[1.0, 0.1, 0, 0.2], [0, 1.1, 0.2, 0], [0.1, 0, 1.0, 0], [0, 0.1, 0, 1.1]])
    return Gaussian([0.1, -0.2, 0.15, 0.05], A @ A.T, 0.8, SPACE)


def line(frame=FLATLAND):
    return Affine(TILTED, -0.1, frame)


def falloff(frame=FLATLAND_SLOPE):
    return GaussianProfile(0.3, frame.coordinates[1], frame, 0.8)


def table():
    """Samples that the spline's transform is closed under: a bell, but coarse."""
    return Spline.of(bell(), Grid.spanning((20, 21), (3.0, 2.6), (0.2, -0.1)))


CIRCLE = Grid((64, 48), (0.1, 2.0 * np.pi / 48))
FIELDS = {
    "gaussian": Entry(bell, GRID, "finite", WIDE),
    "gaussian in space": Entry(
        bell_4d, Grid.spanning((24, 25, 24, 25), (6.5,) * 4), "finite", variant=True
    ),
    "constant": Entry(lambda: Constant(0.7), window=WIDE),
    "function": Entry(lambda: Function(lambda x, t: jnp.sin(x) * jnp.cos(t - x)), covariance=""),
    "sum": Entry(lambda: bell() + 0.4 * gaussian((-0.5, 0.4), (0.3, 0.5), -0.2), GRID, "", WIDE),
    "sum of edges": Entry(
        lambda: 0.5 * BoxProfile(0.4, "x") + 2.0 * HalfPlane(line(FLATLAND_SLOPE), 0, 1),
        covariance="",
        edges=True,
        variant=True,
    ),
    "gaussian profile": Entry(lambda: GaussianProfile(0.4, "theta", weight=0.9), covariance=""),
    "box": Entry(lambda: BoxProfile(0.4, "x"), edges=True),
    "flat": Entry(lambda: UniformProfile("v", height=0.4)),
    "dirac": Entry(lambda: DiracProfile("x"), values=False),
    "separable bell": Entry(
        lambda: Separable([0.2, -0.1], (GaussianProfile(0.5, "x"), GaussianProfile(0.4, "theta"))),
        GRID,
        "finite",
    ),
    "point light": Entry(lambda: point_light(0.2, falloff()), values=False),
    "spot light": Entry(
        lambda: spot_light(0.2, 0.5, falloff()),
        Grid((250, 61), (0.01, 0.1), (0.2, 0.0)),
        grid_error=2e-4,
        edges=True,
    ),
    "line light": Entry(
        lambda: line_light(bell(FLATLAND_SLOPE), 0.6), GRID, "finite", variant=True
    ),
    "line light in angles": Entry(lambda: line_light(bell(), 0.6), covariance="", variant=True),
    "spot light at a height": Entry(
        lambda: line_light(spot_light(0.2, 0.5, falloff()), 0.6),
        Grid((500, 61), (0.01, 0.1)),
        grid_error=2e-3,
        edges=True,
        variant=True,
    ),
    "harmonics": Entry(
        lambda: Harmonics([0.5, 0.3, -0.2, 0.1], [0.0, 0.4, 0.1, -0.3]),
        Grid((64,), (2 * np.pi / 64,)),
        "finite",
        Grid((64,), (2 * np.pi / 64,), (0.4,)),
    ),
    "environment": Entry(
        lambda: Environment(Gaussian([0.2], [[7.0]], frame=ANGLE)),
        None,
        "finite",
        Grid.spanning((8, 120), (2.0, 2.5), (0.3, 0.1)),
    ),
    "environment with edges": Entry(
        lambda: Environment(Bars(Affine([1.0], 0.0, ANGLE), [-0.4, 0.7], [0.2, 1.0, 0.0])),
        window=WINDOW,
        edges=True,
        variant=True,
    ),
    "circular environment": Entry(
        lambda: Environment(Harmonics([0.5, 0.3, -0.2], [0.0, 0.4, 0.1])),
        None,
        "finite",
        WINDOW,
        variant=True,
    ),
    "near light": Entry(
        lambda: NearLight([0.3, 1.2], Gaussian([0.05], [[9.0]], frame=OFFSET)), covariance=""
    ),
    "near light in slopes": Entry(
        lambda: NearLight([0.3, 1.2], Gaussian([0.05], [[9.0]], frame=OFFSET), FLATLAND_SLOPE),
        covariance="",
    ),
    "near disk": Entry(
        lambda: NearLight(
            [0.3, 1.2], Bars(Affine([1.0], 0.0, OFFSET), [-0.4, 0.4], [0.0, 1.0, 0.0])
        ),
        edges=True,
        variant=True,
    ),
    "sampled": Entry(
        table,
        Grid.spanning((160, 161), (4.0, 3.4)),
        "finite",
        Grid.spanning((160, 161), (4.4, 4.2)),
        grid_error=1e-5,
    ),
    "sampled on a circle": Entry(
        lambda: Spline.of(
            Function(lambda x, t: jnp.exp(-2 * x**2 + jnp.cos(t - 0.3 * x))),
            Grid((24, 16), (0.25, 2 * np.pi / 16)),
            ("zero", "periodic"),
        ),
        CIRCLE,
        covariance="",
        grid_error=1e-5,
        variant=True,
    ),
    "sampled open": Entry(
        lambda: Spline.of(bell(), Grid((24, 25), (0.2, 0.2)), "open"), variant=True
    ),
    "half-plane": Entry(lambda: HalfPlane(line(), 0.2, 0.9), window=WINDOW, edges=True),
    "half-plane along the angle": Entry(
        lambda: HalfPlane(Affine([0.0, 2.0], 0.3), 0.2, 0.9),
        window=WINDOW,
        edges=True,
        variant=True,
    ),
    "half-plane outside": Entry(
        lambda: HalfPlane(Affine([1.0, 0.0], 9.0), 0.2, 0.9),
        window=WINDOW,
        edges=True,
        variant=True,
    ),
    "soft edge": Entry(lambda: SoftEdge(line(), 0.15, 0.2, 0.9), window=WINDOW),
    "bars": Entry(
        lambda: Bars(line(), [-0.6, 0.1, 0.9], [0.3, 0.0, 1.0, 0.4]), window=WINDOW, edges=True
    ),
    "grating": Entry(lambda: Grating(line(), 0.7, 0.4, 0.1, 0.9, 1), window=WINDOW, edges=True),
    "soft slit": Entry(lambda: SoftSlit(line(), 0.7, 0.15), covariance="", window=WINDOW),
}

VALUED = [name for name, e in FIELDS.items() if e.values]
ORIGINAL = [name for name in VALUED if not FIELDS[name].variant]


@functools.cache
def rays(dims: int) -> np.ndarray:
    """Rays from above the line, |theta| < pi / 2: light named by slopes has no others."""
    return np.clip(np.random.default_rng(3).normal(size=(40, dims)) * 0.6, -1.5, 1.5)


@functools.cache
def field(name: str) -> Field:
    return FIELDS[name].make()


@functools.cache
def jets(name: str):
    """Closed-form jets, and those by autodiff of the value."""
    f = field(name)

    @eqx.filter_jit
    def both(f, u):
        return jax.vmap(lambda ray: (f.jet(ray), autodiff_jet(f.at, ray, f.frame)))(u)

    return both(f, jnp.asarray(rays(f.frame.dims)))


@pytest.mark.parametrize("name", VALUED)
def test_the_jet_is_the_derivative_of_the_value(name):
    assert bool(field(name).edges()) == FIELDS[name].edges
    ours, truth = jets(name)
    for part in ("value", "gradient", "hessian"):
        assert normwise(getattr(ours, part), getattr(truth, part)) < 1e-10, part


@pytest.mark.parametrize("name", ORIGINAL)
def test_single_precision_agrees_with_double(name):
    double, _ = jets(name)
    with jax.enable_x64(False):
        f = FIELDS[name].make()
        u = jnp.asarray(rays(f.frame.dims), jnp.float32)
        single = eqx.filter_jit(lambda f, u: batched(f.jet)(u))(f, u)
    bound = rounding(16, FIELDS[name].condition, jnp.float32)
    for part in ("value", "gradient", "hessian"):
        assert getattr(single, part).dtype == jnp.float32
        assert normwise(getattr(single, part), getattr(double, part)) < bound, part


@pytest.mark.parametrize("name", ORIGINAL)
def test_no_nan_in_derivatives_by_parameters(name):
    f = field(name)
    u = jnp.asarray(rays(f.frame.dims)[0])

    @eqx.filter_jit
    @eqx.filter_grad
    def slope(f):
        j = f.jet(u)
        return jnp.sum(j.value) + jnp.sum(j.gradient) + jnp.sum(j.hessian)

    leaves = jax.tree.leaves(eqx.filter(slope(f), eqx.is_inexact_array))
    assert all(np.all(np.isfinite(leaf)) for leaf in leaves)


@pytest.mark.parametrize("name", FIELDS)
def test_spectrum_is_the_transform_of_the_samples(name):
    entry, f = FIELDS[name], field(name)
    grid = entry.grid
    if grid is None:
        if entry.values:  # a Dirac has a spectrum and no samples: see the sources' tests
            with pytest.raises(Refused):
                f.spectrum()
        return
    Omega = [np.array(o) for o in ([-0.45, 0.0, 0.33], [-0.5, 0.05, 0.4], [0.2], [-0.1])]
    if "circle" in name or name == "harmonics":  # a period's transform, at its own harmonics
        Omega = [np.array([-1.0, 0.0, 3.0]) / (2 * np.pi)] * 2
    Omega = Omega[: f.frame.dims]
    samples = eqx.filter_jit(grid.sample)(f)
    truth = discrete_transform(samples, grid, *Omega)
    mesh = [jnp.asarray(w) for w in np.meshgrid(*Omega, indexing="ij")]
    ours = eqx.filter_jit(lambda f, mesh: f.spectrum()(*mesh))(f, mesh)
    assert normwise(ours, truth) < entry.grid_error


@pytest.mark.parametrize("name", FIELDS)
def test_covariance_both_ways(name):
    entry, f = FIELDS[name], field(name)
    if entry.covariance == "refused":
        with pytest.raises(Refused):
            f.covariance()
    if entry.covariance != "finite" or entry.grid is None:
        return
    ours, grid = f.covariance().matrix, entry.grid
    samples = eqx.filter_jit(grid.sample)(f)
    by_frequency = covariance_of_samples(samples, grid, f.frame).matrix
    by_gradient = eqx.filter_jit(covariance_of)(f, grid).matrix
    for other in (by_frequency, by_gradient):
        assert normwise(ours, other) < 30 * entry.grid_error  # two derivatives of the same samples


@pytest.mark.parametrize("name", [n for n, e in FIELDS.items() if e.window is not None])
def test_series_reproduces_the_field_on_its_window(name):
    window, f = FIELDS[name].window, field(name)
    assert window is not None
    series = eqx.filter_jit(lambda f: f.series(window))(f)
    inner = np.random.default_rng(5).uniform(-0.46, 0.46, (60, len(window.size)))
    u = jnp.asarray(np.array(window.center) + inner * np.array(window.extent))
    levels = [np.asarray(batched(e.level.at)(u)) for e in f.edges()] if name != "grating" else []
    waves = np.exp(2j * np.pi * np.asarray(u) @ np.asarray(series.frequencies).T)
    ours, truth = waves @ np.asarray(series.coefficients), np.asarray(batched(f.at)(u))
    if not f.edges() and name != "soft edge":  # whose period ends in a jump, as for a hard edge
        assert normwise(ours, truth) < max(1e-6, FIELDS[name].grid_error)
        return
    # At a distance s from an edge, a series cut off at frequency N errs by less than 1/(pi^2 N s).
    clear = np.all([np.abs(lv) > 0.05 for lv in levels] or [np.full(len(u), True)], axis=0)
    assert np.mean(clear) > 0.5
    missed = np.abs(ours - truth)[clear]
    assert np.median(missed) < 4e-3
    assert np.mean(missed < 0.04) > 0.95


@pytest.mark.parametrize("name", [n for n in VALUED if FIELDS[n].edges])
def test_a_jump_is_the_difference_of_its_sides(name):
    f = field(name)
    u = jnp.asarray(rays(f.frame.dims)[:12])
    ends = jnp.array(-1.5), jnp.array(1.5)

    def sides(edge, axis, ray):
        place = edge.crossing(ray, axis, *ends).value
        on = ray.at[axis].set(place)
        g = edge.level.jet(on).gradient
        step = 1e-6 * g / jnp.linalg.norm(g)
        jump = edge.jump.jet(on)
        return place < ends[1], f.at(on + step) - f.at(on - step), jump.value, jump.hessian

    edges = f.edges()
    axes = [int(np.argmax(np.abs(e.level.jet(u[0]).gradient))) for e in edges]

    @jax.jit
    def walk(u):
        return [
            jax.vmap(lambda ray, e=e, a=a: sides(e, a, ray))(u)
            for e, a in zip(edges, axes, strict=True)
        ]

    parts = [np.concatenate(p) for p in zip(*walk(u), strict=True)]
    met, difference, jump, bend = (np.asarray(p) for p in parts)
    np.testing.assert_allclose(difference[met], jump[met], rtol=0.0, atol=1e-4)
    assert np.all(np.isfinite(bend[met]))
    assert np.any(met) != (name == "half-plane outside")
