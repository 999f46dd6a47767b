"""Time as a coordinate: what is claimed, less what the library derives. See README.md."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import sympy

from firstorder.checks.tolerance import normwise, rounding
from firstorder.conventions import Frame
from firstorder.fields import Constant, gaussian
from firstorder.laws import Integrate
from firstorder.ledger import Check, Counterexample, Row, na
from firstorder.symbolic import UnknownField, derive, event, frequencies_of
from firstorder.transport import Event, Texture, Travel


class Gathered(Event):
    """All light along a coordinate, from -half to half."""

    axis: str = eqx.field(static=True)
    half: Any = eqx.field(static=True, default=sympy.oo)

    def law(self, frame):
        """An integral."""
        return Integrate(self.axis, -self.half, self.half)


x, v, t = sympy.symbols("x v t", real=True)
s, s1, s2, a, c, p, q, z, D, T, B = sympy.symbols("s s1 s2 a c p q z D T B", positive=True)
IN_TIME, WITH_SLOPES = Frame(("x", "t")), Frame(("x", "v", "t"))
L, BELL = UnknownField("L", frame=IN_TIME), gaussian((0.2, 0.1), (0.5, 0.3), frame=IN_TIME)
SHUTTER = Texture(UnknownField("w", ("t",), IN_TIME)) >> Gathered("t")
F, W = (derive(f).spectrum for f in (L, UnknownField("w", frame=Frame(("t",)))))
Ox, Ot = frequencies_of(IN_TIME)
GRID = np.array(np.meshgrid(*[0.08 * np.arange(-64, 64)] * 2, indexing="ij"))  # metres, seconds
WAVES = np.array(np.meshgrid(*[np.fft.fftfreq(128, 0.08)] * 2, indexing="ij"))
EXACT = rounding(GRID.size)  # of sums over all samples
BOX = (GRID + 0.04) / 5.12  # middles of cells of a box from -1 to 1
OPEN = BOX[1, 0] / 2  # the instants of a shutter's second
ROWS = []


def row(kind="identity", **judges):
    """The row of a proof: its name, what it says, what it returns, and other judges."""
    judges = {"autodiff": na("spectral"), "brute_force": na("one route")} | judges

    def add(proof):
        name = f"motion.{proof.__name__}"
        ROWS.append(Row(name, kind, symbolic=proof, statement=proof.__doc__, **judges))

    return add


def moved(way):
    """The event by which light goes that way; its parameters stay symbols."""
    return event({x: x + way}, parameters={k: k for k in way.free_symbols - {v, t}})


def grating(speed, wave):
    """Lines in motion, so many a metre: light goes to their frame, through them, and back."""
    lines = event(factor=sympy.cos(2 * sympy.pi * wave * x), parameters={wave: wave})
    return moved(-speed * t) >> lines >> moved(speed * t)


def energy(events):
    """Where events put the energy of uniform light: pairs (Omega_x, Omega_t)."""
    waves = derive(L >> events).spectrum.expression.atoms(sympy.Function)
    return [[sympy.expand(o - k) for o, k in zip((Ox, Ot), w.args, strict=True)] for w in waves]


def seen(*gratings):
    """The same of gratings (speed, wave) through each other, by the FFT of a metre and a second."""
    x, t = np.meshgrid(*[np.arange(128) / 128] * 2, indexing="ij")
    light = np.prod([np.cos(2 * np.pi * k * (x - s * t)) for s, k in gratings], axis=0)
    return (np.argwhere(abs(np.fft.fft2(light)) > 1.0).T + 64) % 128 - 64


def crowd(excess):
    """The most of what is never positive where textures of speeds from 1/2 to 2 have energy."""
    pairs = [seen((s, k)) for s in (0.5, 1.0, 1.5, 2.0) for k in (2, 4, 8, 16)]
    return abs(np.max(excess(*np.hstack(pairs))))


def bell(x, t, s=1.3, a=0.0):
    """`BELL` in motion, in numbers."""
    away = (x - s * t - a * t**2 / 2 - 0.2) / 0.5
    return jnp.exp(-0.5 * (away**2 + ((t - 0.1) / 0.3) ** 2))


def exposed():
    """A photograph of it, with the soft shutter exp(-pi t^2)."""
    return np.sum(bell(*GRID) * np.exp(-np.pi * GRID[1] ** 2), axis=1)


def by_fft(light):
    """The transform of samples at the frequencies of an FFT."""
    return WAVES if light.ndim == 2 else WAVES[:1, :, 0], np.fft.fftn(np.fft.ifftshift(light))


def by_sums(light):
    """The same at any frequencies, by plain sums."""
    Omega = np.random.default_rng(0).uniform(-0.8, 0.8, (light.ndim, 9))
    places = GRID if light.ndim == 2 else GRID[:1, :, 0]
    waves = np.exp(-2j * np.pi * np.tensordot(Omega, places, (0, 0)))
    return Omega, np.tensordot(waves, light, light.ndim)


def spectrum_error(events, Omega, true):
    """Of the derived spectrum of `BELL` after events."""
    known = {"L_hat": BELL.spectrum(), "w_hat": lambda f: jnp.exp(-jnp.pi * f**2)}
    return normwise(derive(L >> events).spectrum.at(*Omega, s=1.3, **known), true * 0.08**2)


@row(
    fourier=Check(lambda: spectrum_error(moved(s * t), *by_fft(bell(*GRID))), EXACT),
    brute_force=Check(lambda: spectrum_error(moved(s * t), *by_sums(bell(*GRID))), EXACT),
)
def line():
    """What moves at the speed s has its energy on Omega_t = -s Omega_x: a shear of spectra."""
    sheared = derive(L >> moved(s * t)).spectrum.expression - F(Ox, Ot + s * Ox)
    return sheared, [Y + s * X for X, Y in energy(grating(s, p))]


def jet_error(how):
    """Of the derived gradient and Hessian of an accelerating bell, at a sample."""
    found, at = derive(L >> moved(s * t + a * t**2 / 2)), jnp.asarray(GRID[:, 68, 61])
    ours = (part.at(*at, s=1.3, a=0.7, L=BELL) for part in (found.gradient, found.hessian))
    return max(map(normwise, ours, how(lambda u: bell(*u, 1.3, 0.7), at)))


def by_waves(f, _):
    """Derivatives by the FFT: a wave's is 2 pi i Omega times it."""
    d, waves = 2j * np.pi * WAVES, np.fft.fft2(f(GRID))
    return [np.fft.ifft2(rate * waves)[..., 68, 61].real for rate in (d, d[:, None] * d)]


@row(
    autodiff=Check(lambda: jet_error(lambda f, u: (jax.grad(f)(u), jax.hessian(f)(u))), EXACT),
    fourier=Check(lambda: jet_error(by_waves), EXACT),
    brute_force=na("two routes"),
)
def jet():
    """At a speed r(t), M = (1 -r; 0 1), the jet is M^T g and M^T H M - diag(0, r' g_x)."""
    way, r = s * t + a * t**2 / 2, s + a * t
    found, rest, M = derive(L >> moved(way)), derive(L), sympy.Matrix([[1, -r], [0, 1]])
    g, H = (sympy.Matrix(f(x - way, t)) for f in (rest.gradient, rest.hessian))
    hessian = M.T * H * M - sympy.diag(0, sympy.diff(r, t) * g[0])
    return sympy.Matrix(found.gradient.expression) - M.T * g, found.hessian.expression - hessian


def covariance_error(light, rates):
    """Of the derived covariance of `BELL` in motion, by its light and rates, or by their waves."""
    true = np.einsum("iab,jab->ij", rates, np.conj(rates)).real / np.sum(abs(light) ** 2)
    return normwise(derive(BELL >> moved(s * t)).covariance.at(0, 0, s=1.3), true)


def rates():
    """The bell's gradients at all samples, in cycles."""
    return np.array(jax.vmap(jax.vmap(jax.grad(bell, (0, 1))))(*GRID)) / (2 * np.pi)


@row(
    autodiff=Check(lambda: covariance_error(bell(*GRID), rates()), EXACT),
    fourier=Check(
        lambda: covariance_error(*(k * np.fft.fft2(bell(*GRID)) for k in (1, WAVES))), EXACT
    ),
    brute_force=na("two routes"),
)
def covariance():
    """The covariance of the spectrum of what moves at s is M^T Sigma M, with M = (1 -s; 0 1)."""
    S, M = derive(L).covariance.expression, sympy.Matrix([[1, -s], [0, 1]])
    return derive(L >> moved(s * t)).covariance.expression - M.T * S * M


@row(fourier=Check(lambda: crowd(lambda X, Y: (Y + 0.5 * X) * (Y + 2 * X)), 0.0))
def wedge():
    """Speeds s1..s2 have their energy where (Omega_t + s1 Omega_x) (Omega_t + s2 Omega_x) <= 0."""
    inside = (s - s1) * (s2 - s)
    return [(Y + s1 * X) * (Y + s2 * X) + inside * X**2 for X, Y in energy(grating(s, p))]


@row(
    fourier=Check(lambda: crowd(lambda X, Y: abs(X + 1.25 * Y) - 6 - 99 * (abs(Y) > 8)), 0.0),
    brute_force=Check(lambda: abs(np.mean(abs(16 * BOX[0] + 10 * BOX[1]) <= 6) - 1.5 / 4), 1 / 128),
)
def sheared_filter():
    """With |Omega_t| <= B, speeds s1..s2 fill a sheared box, (s2 - s1) / (2 s2) of the upright."""
    m, h = (1 / s1 + 1 / s2) / 2, (1 / s1 - 1 / s2) / 2
    inside = (1 / s1 - 1 / s) * (1 / s - 1 / s2)
    sides = [(X + m * Y) ** 2 - (h * Y) ** 2 + inside * Y**2 for X, Y in energy(grating(s, p))]
    periods = sympy.Matrix([[2 * h * B, 0], [-2 * m * B, 2 * B]])
    return sides, periods.det() - (s2 - s1) / (2 * s2) * (2 * B / s1) * (2 * B)


def beat(s1, s2, p, q):
    """The speed of the widest lines of two gratings, one seen through the other."""
    space, time = seen((s1, p), (s2, q))
    return -(time / space)[np.argmin(abs(space))]


@row(
    "over-claim",
    fourier=Check(lambda: abs(beat(1, 2, 3, 2) - (1 * 3 - 2 * 2) / (3 - 2)), 0.0),
    printed="what is seen of things of speeds s1..s2 moves at speeds s1..s2",
    corrected="p lines at s1 through q at s2 beat at (s1 p - s2 q) / (p - q)",
    counterexample=Counterexample({"s1": 1, "s2": 2, "p": 3, "q": 2}, lambda s1, **_: s1, beat),
)
def moire():
    """Things seen through each other have energy at all sums of theirs, within no wedge."""
    both = energy(grating(s1, p) >> grating(s2, q))
    return [Y + s1 * X.coeff(p) * p + s2 * X.coeff(q) * q for X, Y in both]


@row(
    fourier=Check(lambda: spectrum_error(moved(s * t) >> SHUTTER, *by_fft(exposed())), EXACT),
    brute_force=Check(lambda: spectrum_error(moved(s * t) >> SHUTTER, *by_sums(exposed())), EXACT),
)
def photograph():
    """Of what moves at s a photograph keeps w_hat(s Omega_x): Omega_x up to the shutter's / s."""
    found = derive(L >> moved(s * t) >> SHUTTER).spectrum.expression
    (q,) = found.variables
    return found.function - F(Ox, s * Ox - q) * W(q)


@row(
    "over-claim",
    autodiff=na("no derivative"),
    fourier=na("one route"),
    brute_force=Check(lambda: abs(np.var(1.3 * OPEN) - 1.3**2 / 12), 1 / OPEN.size**2),
    printed="the blur of a shutter open for T has the standard deviation s T",
    corrected="s T / sqrt(12); s T is how far it reaches",
    counterexample=Counterexample({"s": 1.3}, lambda s: s, lambda s: np.std(s * OPEN)),
)
def blur():
    """A shutter open for T adds s^2 T^2 / 12 to the variance of what moves at s: to x^2, say."""
    square = Constant(1.0, IN_TIME) >> event(factor=x**2) >> moved(s * t)
    shot = derive(square >> Gathered("t", T / 2)).value.evaluated().expression
    return shot / T - x**2 - s**2 * T**2 / 12


def lamp_error():
    """Of the claim for a lamp from -0.2 to 0.4, by the FFT of sums over its points."""
    y, weights = np.polynomial.legendre.leggauss(32)
    x, t, y = np.meshgrid(*[np.arange(32) / 32] * 2, 0.1 + 0.3 * y, indexing="ij")
    waves = np.fft.fft2(np.cos(2 * np.pi * 4 * (x + (y - x) * 0.5 / 2.0 - 0.5 * t)) @ weights)
    f = -0.5 / (2.0 - 0.5) * 3  # where the lamp's transform is asked, for Omega_x = 3
    waves[3, -2] -= 32**2 * np.sinc(0.6 * f) * np.exp(-2j * np.pi * 0.1 * f)
    return np.max(abs(waves[:16])) / 32**2


@row(fourier=Check(lamp_error, EXACT))
def lamp():
    """From z under a lamp at D a shadow moves at s D / (D - z), times l_hat(-z Ox / (D - z))."""
    events = Travel(D - z) >> grating(s, p) >> Travel(z) >> Gathered("v")
    found, far = [], D / (D - z)
    for wave in derive(UnknownField("l", frame=WITH_SLOPES) >> events).spectrum.expression.atoms(
        sympy.Function
    ):
        place, slope, time = wave.args
        at = {p: far * (Ox - place).coeff(p) * Ox, Ot: -far * s * Ox}
        found += [e.subs(at) for e in (slope, time, place + z / (D - z) * Ox)]
    return found


def lit(x, t):
    """What is seen past an edge at height 1 + t / 2 and place 0.3 t, at the slope 0.4."""
    return jnp.tanh(x - 0.4 * (1 + 0.5 * t) - 0.3 * t)


def edge_error():
    """Of the speed of its shadow on a row of receivers."""
    x = np.linspace(0.0, 2.0, 20001)
    start, end = (x[np.argmax(lit(x, t) > 0.0)] for t in (0.0, 1.0))
    return abs(end - start - 0.5)


@row(
    autodiff=Check(lambda: abs(np.divide(*jax.grad(lit, (1, 0))(0.7, 0.2)) + 0.5), EXACT),
    fourier=na("no spectrum"),
    brute_force=Check(edge_error, 1e-4),
)
def rising():
    """The shadow, at the slope v, of what also rises at c moves at s + c v: slopes make a wedge."""
    path = UnknownField("V", ("x",), WITH_SLOPES) >> moved(s * t + v * (z + c * t))
    V_x, _, V_t = derive(path).gradient.expression
    return V_t + (s + c * v) * V_x
