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
s, s1, s2, a, p, q, c, z, D, T, B = sympy.symbols("s s1 s2 a p q c z D T B", positive=True)
IN_TIME, WITH_SLOPES = Frame(("x", "t")), Frame(("x", "v", "t"))
L, BELL = UnknownField("L", frame=IN_TIME), gaussian((0.2, 0.1), (0.5, 0.3), frame=IN_TIME)
SHUTTER = Texture(UnknownField("w", ("t",), IN_TIME)) >> Gathered("t")
F, W = (derive(f).spectrum for f in (L, UnknownField("w", frame=Frame(("t",)))))
Ox, Ot = frequencies_of(IN_TIME)
M = sympy.Matrix([[1, -s], [0, 1]])
GRID = np.array(np.meshgrid(*[0.08 * np.arange(-64, 64)] * 2, indexing="ij"))  # metres, seconds
WAVES = np.array(np.meshgrid(*[np.fft.fftfreq(128, 0.08)] * 2, indexing="ij"))
CELLS = np.array(np.meshgrid(*[np.arange(128) / 128] * 2, indexing="ij"))  # a metre, a second
BOX = 2 * CELLS - 127 / 128  # middles of cells of a box from -1 to 1
EXACT = rounding(GRID.size)  # of sums over all samples
ROWS = []


def row(kind="identity", **judges):
    """The row of a proof: its name, what it says, what it returns, and other judges."""
    judges = {"autodiff": na("spectral"), "brute_force": na("one route")} | judges

    def add(proof):
        name, said = f"motion.{proof.__name__}", proof.__doc__
        ROWS.append(Row(name, kind, symbolic=proof, statement=said, **judges))

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
    light = np.prod([np.cos(2 * np.pi * k * (CELLS[0] - s * CELLS[1])) for s, k in gratings], 0)
    return (np.argwhere(abs(np.fft.fft2(light)) > 1.0).T + 64) % 128 - 64


def crowd(excess):
    """The most of what is never positive where textures of speeds from 1/2 to 2 have energy."""
    pairs = [seen((s, k)) for s in (0.5, 1.0, 1.5, 2.0) for k in (2, 4, 8, 16)]
    return abs(np.max(excess(*np.hstack(pairs))))


def bell(x, t, a=0.0):
    """`BELL` in motion at 1.3, in numbers."""
    away = (x - 1.3 * t - a * t**2 / 2 - 0.2) / 0.5
    return jnp.exp(-0.5 * (away**2 + ((t - 0.1) / 0.3) ** 2))


def spectrum_error(events, light, Omega):
    """Of the derived spectrum of `BELL` after events, by the FFT of samples."""
    known = {"L_hat": BELL.spectrum(), "w_hat": lambda f: jnp.exp(-jnp.pi * f**2)}
    found = derive(L >> events).spectrum.at(*Omega, s=1.3, **known)
    return normwise(found, np.fft.fftn(np.fft.ifftshift(light)) * 0.08**2)


@row(fourier=Check(lambda: spectrum_error(moved(s * t), bell(*GRID), WAVES), EXACT))
def line():
    """What moves at the speed s has its energy on Omega_t = -s Omega_x: a shear of spectra."""
    sheared = derive(L >> moved(s * t)).spectrum.expression - F(Ox, Ot + s * Ox)
    return sheared, [Y + s * X for X, Y in energy(grating(s, p))]


def jet_error():
    """Of the derived gradient and Hessian of an accelerating bell, by autodiff of the numbers."""
    found, at = derive(L >> moved(s * t + a * t**2 / 2)), jnp.asarray((-0.24, 0.32))
    ours = (part.at(*at, s=1.3, a=0.7, L=BELL) for part in (found.gradient, found.hessian))
    true = (d(lambda u: bell(*u, 0.7))(at) for d in (jax.grad, jax.hessian))
    return max(map(normwise, ours, true))


@row(autodiff=Check(jet_error, EXACT), fourier=na("no spectrum"))
def jet():
    """At a speed r(t), M = (1 -r; 0 1), the jet is M^T g and M^T H M - diag(0, r' g_x)."""
    way, now = s * t + a * t**2 / 2, M.subs(s, s + a * t)
    found, rest = derive(L >> moved(way)), derive(L)
    g, H = (sympy.Matrix(f(x - way, t)) for f in (rest.gradient, rest.hessian))
    hessian = now.T * H * now - sympy.diag(0, a * g[0])
    return sympy.Matrix(found.gradient.expression) - now.T * g, found.hessian.expression - hessian


def covariance_error():
    """Of the derived covariance of `BELL` in motion, by the power of its waves."""
    power = np.abs(np.fft.fft2(bell(*GRID))) ** 2
    true = np.einsum("iab,jab,ab->ij", WAVES, WAVES, power / np.sum(power))
    return normwise(derive(BELL >> moved(s * t)).covariance.at(0, 0, s=1.3), true)


@row(fourier=Check(covariance_error, EXACT))
def covariance():
    """The covariance of the spectrum of what moves at s is M^T Sigma M, with M = (1 -s; 0 1)."""
    sheared = M.T * derive(L).covariance.expression * M
    return derive(L >> moved(s * t)).covariance.expression - sheared


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


def shutter_error():
    """Of the spectrum of a photograph of `BELL` in motion, with the soft shutter exp(-pi t^2)."""
    photograph = np.sum(bell(*GRID) * np.exp(-np.pi * GRID[1] ** 2), axis=1)
    return spectrum_error(moved(s * t) >> SHUTTER, photograph, WAVES[:1, :, 0])


@row(fourier=Check(shutter_error, EXACT))
def photograph():
    """Of what moves at s a photograph keeps w_hat(s Omega_x): Omega_x up to the shutter's / s."""
    found = derive(L >> moved(s * t) >> SHUTTER).spectrum.expression
    (q,) = found.variables
    return found.function - F(Ox, s * Ox - q) * W(q)


@row(
    "over-claim",
    autodiff=na("no derivative"),
    fourier=na("one route"),
    brute_force=Check(lambda: abs(np.var(1.3 * BOX[1] / 2) - 1.3**2 / 12), 1 / 128**2),
    printed="the blur of a shutter open for T has the standard deviation s T",
    corrected="s T / sqrt(12); s T is how far it reaches",
    counterexample=Counterexample({"s": 1.3}, lambda s: s, lambda s: np.std(s * BOX[1] / 2)),
)
def blur():
    """A shutter open for T adds s^2 T^2 / 12 to the variance of what moves at s: to x^2, say."""
    square = Constant(1.0, IN_TIME) >> event(factor=x**2) >> moved(s * t)
    shot = derive(square >> Gathered("t", T / 2)).value.evaluated().expression
    return shot / T - x**2 - s**2 * T**2 / 12


def lamp_error():
    """Of the claim for a lamp from -0.2 to 0.4, by the FFT of sums over its points."""
    y, weights = np.polynomial.legendre.leggauss(32)
    x, t = CELLS[:, ..., None]
    shadow = np.cos(2 * np.pi * 4 * (x + (0.1 + 0.3 * y - x) * 0.5 / 2.0 - 0.5 * t)) @ weights
    f = -0.5 / (2.0 - 0.5) * 3  # where the lamp's transform is asked, for Omega_x = 3
    waves = np.fft.fft2(shadow) / shadow.size
    waves[3, -2] -= np.sinc(0.6 * f) * np.exp(-2j * np.pi * 0.1 * f)
    return np.max(abs(waves[:64]))


@row(fourier=Check(lamp_error, EXACT))
def lamp():
    """From z under a lamp at D a shadow moves at s D / (D - z), times l_hat(-z Ox / (D - z))."""
    under = Travel(D - z) >> grating(s, p) >> Travel(z) >> Gathered("v")
    waves = derive(UnknownField("l", frame=WITH_SLOPES) >> under).spectrum.expression
    found, far = [], D / (D - z)
    for place, slope, time in (wave.args for wave in waves.atoms(sympy.Function)):
        at = {p: far * (Ox - place).coeff(p) * Ox, Ot: -far * s * Ox}
        found += [e.subs(at) for e in (slope, time, place + z / (D - z) * Ox)]
    return found


def edge_error():
    """Of the speed of a shadow on a row of receivers: its edge at place 0.3 t, height 1 + t / 2."""
    x = np.linspace(0.0, 2.0, 20001)
    start, end = (x[np.argmax(x > 0.3 * t + 0.4 * (1 + 0.5 * t))] for t in (0.0, 1.0))
    return abs(end - start - (0.3 + 0.5 * 0.4))


@row(autodiff=na("no derivative"), fourier=na("no spectrum"), brute_force=Check(edge_error, 1e-4))
def rising():
    """The shadow, at the slope v, of what also rises at c moves at s + c v: slopes make a wedge."""
    path = UnknownField("V", ("x",), WITH_SLOPES) >> moved(s * t + v * (z + c * t))
    V_x, _, V_t = derive(path).gradient.expression
    return V_t + (s + c * v) * V_x
