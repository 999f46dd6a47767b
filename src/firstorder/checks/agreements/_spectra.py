"""The spectrum of what arrives, and the mean square of its slope, each in several ways.

Two numbers of one scene are tied here that the papers treat apart. The windowed light field

    F(Omega) = int int L(x, v) g(x / sigma_x) g(v / sigma_v) exp(-2 pi i Omega . (x, v)) dx dv

with `g(t) = exp(-t^2 / 2)` is what laws, a transform of rays, and the exact visible intervals all
give. And Parseval's theorem says of the irradiance `f(x) = E(x) g(x / sigma_x)` that

    int |2 pi Omega F|^2 dOmega = int |f'|^2 dx

the second moment of D05's spectrum on the left, R07's gradient on the right: finite where E is
continuous, since a shadow's edge on a light of any size is a kink of E at worst.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.checks.agreements import _laws as laws
from firstorder.checks.agreements._exact import NODES, on_straight
from firstorder.checks.agreements._quadrature import adaptive
from firstorder.checks.agreements._record import Found, Row, attempted, judged
from firstorder.checks.agreements.sizes import Sizes
from firstorder.checks.tolerance import rounding
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.errors import Refused
from firstorder.fields import Grid, discrete_transform
from firstorder.fields.covariance import covariance_of_samples
from firstorder.flatland.direct_lighting import (
    irradiance,
    point_light_irradiance,
    weighted_irradiance,
)
from firstorder.flatland.light_fields.field import light_field
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.numerics._batching import host_blocks
from firstorder.scene._derivatives import derivatives
from firstorder.shadowfield import power_spectrum

ADAPTIVE = "intervals, adaptive in x"
REACH = 6.0  # half the window over x, in standard deviations
SLOPES = 8.0  # half the window over v


@dataclasses.dataclass(frozen=True)
class Window:
    """The Gaussian window under which a scene's light has a spectrum.

    Attributes:
        sigma_x: along the receiver's line [m].
        sigma_v: in slopes.
        Omega: the frequency that is asked for, (cycles/m, cycles per unit of slope).
    """

    sigma_x: float
    sigma_v: float
    Omega: tuple[float, float]

    @property
    def half(self) -> float:
        """Half the length of the line that is used [m]."""
        return REACH * self.sigma_x

    def over(self, x: np.ndarray) -> np.ndarray:
        """The window over x."""
        return np.exp(-0.5 * (x / self.sigma_x) ** 2)


def window_of(scene: Scene, at: Receiver, sizes: Sizes) -> Window:
    """A window about the receiver that ends before the receiver's own shape does.

    Raises:
        Refused: if the receiver lies on a curved shape.
    """
    on_straight(scene, at)
    half, number = sizes.window, int(at.on)
    if number >= 0:
        ends = [np.asarray(scene.frame(number, s).position) for s in (0.0, 1.0)]
        gaps = [float(np.hypot(*(end - np.asarray(at.position)))) for end in ends]
        half = min(half, 0.98 * min(gaps))
    if not half > 0.0:
        raise Refused("the receiver is at the end of its shape: there is no line around it")
    sigma_x, sigma_v = half / REACH, 0.25
    return Window(sigma_x, sigma_v, (0.15 / sigma_x, -0.15 / sigma_v))


def spectrum_rows(scene: Scene, at: Receiver, sizes: Sizes) -> tuple[Row, ...]:
    """Rows of the windowed spectrum and of the mean square slope.

    Args:
        scene: concrete shapes and lights.
        at: one receiver, around which the line and the window lie.
        sizes: how many samples.
    """
    names = ("Re F", "Im F", "int |f'|^2")
    window = attempted(lambda: window_of(scene, at, sizes))
    if isinstance(window, str):
        return tuple(Row(name, ADAPTIVE, reason=window) for name in names)
    asked = _ways(scene, at, window, sizes)
    rows: tuple[Row, ...] = ()
    said = {name: _parts(ask) for name, ask in asked[0].items()}
    for k in range(2):
        rows += judged(names[k], {name: two[k] for name, two in said.items()}, ADAPTIVE)
    squares = {name: attempted(ask) for name, ask in asked[1].items()}
    if isinstance(squares[ADAPTIVE], str):
        return rows + tuple(Row(names[2], name, reason=squares[ADAPTIVE]) for name in squares)
    return rows + judged(names[2], squares, ADAPTIVE)


def _parts(ask) -> tuple[Found | str, Found | str]:
    """Real and imaginary part of a number with its bound."""
    try:
        value, bound = ask()
    except Refused as refusal:
        return refusal.reason, refusal.reason
    return Found(float(np.real(value)), bound), Found(float(np.imag(value)), bound)


def _ways(scene: Scene, at: Receiver, window: Window, sizes: Sizes):
    """Ways to the spectrum, and to the mean square slope."""
    line = Line(scene, at)

    def kernel(x):
        return window.over(x) * np.exp(-2j * np.pi * window.Omega[0] * x)

    def seen(x):
        return kernel(x) * line.sensed(x, window)

    def by_laws(x):
        return kernel(x) * laws.windowed_along(
            scene, at, x, window.sigma_v, window.Omega[1]
        )  # fmt: skip

    def slope(three, x):
        E, E1 = three[0], three[1]
        return window.over(x) ** 2 * (E1 - E * x / window.sigma_x**2) ** 2

    def total(f, share=1):
        most = sizes.places // share
        found = adaptive(f, -window.half, window.half, sizes.tolerance, most)
        return found.value, found.bound

    def real(f, share=1):
        value, bound = total(f, share)
        return Found(float(np.real(value)), bound)

    def squared():
        refuse_jumps(line, window)
        return real(lambda x: slope(line.derivatives(x), x))

    spectrum = {
        ADAPTIVE: lambda: total(seen),
        "laws: multiply, integrate": lambda: _checked(scene, lambda: total(by_laws, 4)),
        "laws: multiply by a closed series": lambda: laws.by_series(
            scene,
            at,
            (window.sigma_x, window.sigma_v),
            (window.half, SLOPES * window.sigma_v),
            window.Omega,
        ),
        "transform of exact samples": lambda: sampled(seen, window, sizes.samples),
        "transform of traced rays": lambda: traced(scene, at, window, sizes),
    }
    squares = {
        ADAPTIVE: squared,
        "laws: jets of the integral": lambda: real(
            lambda x: slope(laws.jets_along(scene, at, x), x), 4
        ),
        "second moment of the spectrum": lambda: moment(line, window, sizes.samples),
    }
    return spectrum, squares


def _checked(scene: Scene, ask: Callable):
    laws.refuse_points(scene)
    return ask()


# --- one line ------------------------------------------------------------------------------------


class Line:
    """Light along the receiver's tangent, by exact intervals; compiled once."""

    def __init__(self, scene: Scene, at: Receiver):
        """Keep both."""
        self.scene, self.at = scene, at

    def irradiances(self, x: np.ndarray) -> np.ndarray:
        """E."""
        return self._each(lambda p: _values(irradiance, self.scene, self.at, p), x)

    def derivatives(self, x: np.ndarray) -> np.ndarray:
        """E and E', two rows."""
        return self._each(lambda p: _slopes(irradiance, self.scene, self.at, p), x).T

    def lit(self, x: np.ndarray) -> np.ndarray:
        """Irradiance from the point lights alone."""
        return self._each(lambda p: _lit(self.scene, self.at, p), x)

    def sensed(self, x: np.ndarray, window: Window) -> np.ndarray:
        """`int L(x, v) g(v / sigma_v) exp(-2 pi i Omega_v v) dv`."""
        numbers = window.sigma_v, window.Omega[1]
        return self._each(
            lambda p: _sensed(weighted_irradiance, self.scene, self.at, p, *numbers), x
        )

    def _each(self, ask: Callable, x: np.ndarray) -> np.ndarray:
        return host_blocks(ask, self._places(x), laws.PLACES)

    def _places(self, x):
        return np.asarray(self.at.position) + np.asarray(x)[:, None] * np.asarray(self.at.tangent)


@eqx.filter_jit
def _values(E, scene, at, places):
    return jax.vmap(lambda p: E(scene, Receiver(p, at.n, at.on), nodes=NODES))(places)


@eqx.filter_jit
def _slopes(E, scene, at, places):
    def one(p):
        d = derivatives(E, scene, Receiver(p, at.n, at.on), freedoms=("x",), nodes=NODES)
        return jnp.stack([d.value, d.first])

    return jax.vmap(one)(places)


@eqx.filter_jit
def _lit(scene, at, places):
    return jax.vmap(lambda p: point_light_irradiance(scene, Receiver(p, at.n, at.on)))(places)


@eqx.filter_jit
def _sensed(gather, scene, at, places, sigma, Omega):
    def part(p, wave):
        def weight(theta):
            v = jnp.tan(theta)
            near = jnp.abs(v) < SLOPES * sigma
            v = jnp.where(near, v, 0.0)
            return jnp.where(near, jnp.exp(-0.5 * (v / sigma) ** 2), 0.0) * (
                (1.0 + v**2) * wave(2.0 * np.pi * Omega * v)
            )

        return gather(scene, Receiver(p, at.n, at.on), weight=weight, nodes=2 * NODES)

    return jax.vmap(lambda p: part(p, jnp.cos) - 1j * part(p, jnp.sin))(places)


def refuse_jumps(line: Line, window: Window) -> None:
    """Refuse a line on which a point light comes and goes: E jumps, and its slope is a Dirac.

    Raises:
        Refused: if one does.
    """
    x = np.linspace(-window.half, window.half, 257)
    step = np.abs(np.diff(line.lit(x)))
    # A step of 1/256 of the window changes smooth light by a few hundredths of it at most.
    if np.any(step > 0.2 * np.max(line.lit(x), initial=0.0)):
        raise Refused("a point light's shadow ends here: E jumps, and the mean of E'^2 is infinite")


# --- samples -------------------------------------------------------------------------------------


def sampled(f, window: Window, count: int) -> tuple[complex, float]:
    """The sum over even samples, with twice its change from half as many."""
    grids = [Grid.spanning((n,), (window.half,)) for n in (count, count // 2)]
    fine, coarse = (grid.cell * np.sum(f(np.asarray(grid.axis(0)))) for grid in grids)
    return fine, float(2.0 * abs(fine - coarse))


def traced(scene: Scene, at: Receiver, window: Window, sizes: Sizes) -> tuple[complex, float]:
    """The discrete transform of the windowed light field on a grid of traced rays.

    A row of n samples of spacing h errs by h times half its total variation at most; so does the
    sum over rows, each beside its exact integral over v. The variation is that of the samples.

    Raises:
        Refused: if there are point lights.
    """
    laws.refuse_points(scene)
    n = sizes.samples
    grid = Grid.spanning((n, n), (window.half, SLOPES * window.sigma_v))
    x, v = (np.asarray(grid.axis(i)) for i in range(2))
    L = radiances(scene, at, x, v)
    f = L * window.over(x)[:, None] * np.exp(-0.5 * (v / window.sigma_v) ** 2)
    Omega = (np.array([o]) for o in window.Omega)
    F = complex(np.asarray(discrete_transform(f, grid, *Omega))[0, 0])
    wave = np.exp(-2j * np.pi * window.Omega[1] * v)
    rows = np.sum(np.abs(np.diff(f * wave, axis=1)), 1)
    bound = 0.5 * grid.step[1] * grid.step[0] * np.sum(rows)
    # Over x what is summed is continuous: the rule of midpoints, by halving.
    line = f @ wave * grid.step[1] * np.exp(-2j * np.pi * window.Omega[0] * x)
    halved = grid.step[0] * abs(np.sum(line) - 2.0 * np.sum(line[::2]))
    return F, float(bound + 2.0 * halved)


def radiances(scene: Scene, at: Receiver, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Radiance of traced rays at places x along the tangent and in slopes v."""
    return np.asarray(_field(light_field, scene, at, jnp.asarray(x), jnp.asarray(v)))


@eqx.filter_jit
def _field(make, scene, at, x, v):
    L = make(scene, at, frame=FLATLAND_SLOPE)
    return jax.lax.map(lambda x: L(x, v), x)


def moment(line: Line, window: Window, count: int) -> Found:
    """`int |2 pi Omega F|^2` from the discrete spectrum of exact samples of irradiance.

    By D05's covariance of the spectrum, `M = 4 pi^2 Sigma int f^2`. A kink's spectrum falls as
    Omega^-2: what lies beyond the grid's last frequency is as much as what lies in the last octave
    before it, and half of what lies in the one before that. Samples fold it back, which may double
    it: the bound is three times the larger of both.

    Raises:
        Refused: if E jumps.

    Reference: D05 §5.3 (the bandwidth as a second moment).
    """
    refuse_jumps(line, window)

    grid = Grid.spanning((count,), (window.half,))
    x = np.asarray(grid.axis(0))
    f = window.over(x) * line.irradiances(x)
    square = float(np.sum(f**2)) * grid.cell
    if square == 0.0:
        return Found(0.0, 0.0)
    S = covariance_of_samples(jnp.asarray(f), grid, FLATLAND_SLOPE.without("v"))
    Omega = np.asarray(grid.frequencies(0))
    energy = (
        np.asarray(power_spectrum(f, grid, tapered=False, mean=True)) * (2.0 * np.pi * Omega) ** 2
    )
    beyond = [np.sum(energy[abs(Omega) > s * np.max(abs(Omega))]) for s in (0.5, 0.25)]
    octave = float(max(beyond[0], 0.5 * (beyond[1] - beyond[0])))
    value = 4.0 * np.pi**2 * float(S.matrix[0, 0]) * square
    return Found(value, 3.0 * octave + rounding(count) * value)
