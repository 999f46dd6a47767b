"""R07 §3.1 and Appendix A: the five operators of Fig. 2, and the Fourier and gradient theorems."""

from __future__ import annotations

import functools

import jax.numpy as jnp
import sympy as sp

from derivations.derived.compare import (
    FLATLAND,
    Equation,
    L,
    L_hat,
    Ot,
    Ox,
    at_symbols,
    flat,
    hat,
    integral,
    oo,
    pi,
    rho,
    rho_hat,
    t,
    theta,
    unknown,
    x,
)
from firstorder.conventions import fourier_kernel
from firstorder.fields import gaussian
from firstorder.laws import Convolve, Integrate, Move, Multiply, Warp
from firstorder.laws.warp import Map
from firstorder.symbolic import UnknownField, UnknownLobe, derive
from firstorder.symbolic._programs.reading import array, read

u, Omega = sp.Matrix([x, theta]), sp.Matrix([Ox, Ot])
M = sp.Matrix(2, 2, sp.symbols("m_1:3_1:3", real=True))
c = sp.Matrix(sp.symbols("c_1:3", real=True))
CENTRE = sp.symbols("c_x c_theta", real=True)
WIDTHS = sp.symbols("sigma_x sigma_theta", positive=True)
g, g_hat = unknown("g", "x", "theta"), hat("g", "x", "theta")
s_x, s_t = sp.symbols("s_x s_theta", real=True)


class _UnknownMap(Map):
    """`(T_1(x, theta), T_2(x, theta))`."""

    components: tuple[UnknownField, ...] = tuple(
        UnknownField(name, frame=FLATLAND) for name in ("T_1", "T_2")
    )

    def __call__(self, u):
        """The components, unknown."""
        return jnp.stack([T.at(u) for T in self.components])


def _components(**along):
    return [unknown(name, "x", "theta")(x, theta, **along) for name in ("T_1", "T_2")]


def product():
    return derive(Multiply(UnknownField("g", frame=FLATLAND)), FLATLAND)


def slice_():
    return derive(Integrate("theta", -oo, oo))


def convolution():
    return derive(Convolve(UnknownLobe("rho")))


def moved():
    return derive(Move(M))


def affine():
    return derive(Move(M, list(c)))


def warped():
    return derive(Warp(_UnknownMap()))


def _gradient_at(*at):
    return sp.Matrix([L(*at, along=name) for name in ("x", "theta")])


def pulled_back():
    """`F(M^-T Omega) / |det M|`."""
    return L_hat(*(M.inv().T * Omega)) / sp.Abs(M.det())


def theorem_before_division():
    """R07 (53) is about `|det M| H(M^T Omega)`."""
    after = derive(Move(M)).spectrum(*(M.T * Omega))
    return sp.simplify(sp.Abs(M.det()) * after)


def kernel():
    """The kernel of `conventions`, under which every spectrum of the library is written."""
    return flat(read(fourier_kernel, array(Ox, Ot), array(x, theta)).entries[()])


@functools.cache
def bell():
    return derive(at_symbols(lambda *a: gaussian(a[:2], a[2:]), *CENTRE, *WIDTHS))


def wave():
    return sp.exp(-2 * pi * sp.I * (Ox * x + Ot * theta))


def transformed(light):
    """`int int light exp(-2 pi i Omega . u) du`, of a product of bells, by SymPy."""
    found = sp.Integer(1)
    for a, Omega, name in ((x, Ox, 0), (theta, Ot, 1)):
        part = sp.exp(-((a - CENTRE[name]) ** 2) / (2 * WIDTHS[name] ** 2))
        light = sp.simplify(light / part)
        wave = part * sp.exp(-2 * pi * sp.I * Omega * a)
        found *= sp.integrate(wave, (a, -oo, oo), conds="none")
    return light * found


def leibniz():
    return [
        L(x, theta) * g(x, theta, along=name) + g(x, theta) * L(x, theta, along=name)
        for name in ("x", "theta")
    ]


def convolved(**along):
    return integral(L(x, theta - t, **along) * rho(t))


PRODUCT = Equation(lambda: product().gradient, leibniz)
SLICE = Equation(lambda: slice_().gradient, lambda: [integral(L(x, t, along="x"))])
BLURRED = Equation(
    lambda: convolution().gradient, lambda: [convolved(along="x"), convolved(along="theta")]
)
MOVED = Equation(lambda: moved().value, lambda: L(*(M * u)))
MOVED_GRADIENT = Equation(lambda: moved().gradient, lambda: M.T * _gradient_at(*(M * u)))
MOVED_SPECTRUM = Equation(lambda: moved().spectrum, pulled_back)
WARPED = Equation(lambda: warped().value, lambda: L(*_components()))
WARPED_GRADIENT = Equation(
    lambda: warped().gradient,
    lambda: (
        sp.Matrix([_components(along=name) for name in ("x", "theta")])
        * _gradient_at(*_components())
    ),
)
# The transform of one field that has one in closed form, and the kernel under which it stands.
KERNEL = Equation(
    lambda: [bell().spectrum, kernel()],
    lambda: [transformed(bell().value.expression), wave()],
)

DERIVED = {
    "R07.fig2.multiply.primal": Equation(
        lambda: product().value, lambda: L(x, theta) * g(x, theta)
    ),
    "R07.fig2.multiply.gradient": PRODUCT,
    "R07.fig2.multiply.fourier": Equation(
        lambda: product().spectrum,
        lambda: sp.Integral(
            L_hat(Ox - s_x, Ot - s_t) * g_hat(s_x, s_t), (s_x, -oo, oo), (s_t, -oo, oo)
        ),
    ),
    "R07.fig2.integrate.primal": Equation(lambda: slice_().value, lambda: integral(L(x, t))),
    "R07.fig2.integrate.gradient": SLICE,
    "R07.fig2.integrate.fourier": Equation(lambda: slice_().spectrum, lambda: L_hat(Ox, 0)),
    "R07.fig2.convolve.primal": Equation(lambda: convolution().value, convolved),
    "R07.fig2.convolve.gradient": BLURRED,
    "R07.fig2.convolve.fourier": Equation(
        lambda: convolution().spectrum, lambda: L_hat(Ox, Ot) * rho_hat(Ot)
    ),
    "R07.fig2.move.primal": MOVED,
    "R07.fig2.move.gradient": MOVED_GRADIENT,
    "R07.fig2.move.fourier": MOVED_SPECTRUM,
    "R07.fig2.warp.primal": WARPED,
    "R07.fig2.warp.gradient": WARPED_GRADIENT,
    "R07.2": PRODUCT,
    "R07.3": SLICE,
    "R07.4": BLURRED,
    "R07.5": MOVED,
    "R07.6": MOVED_SPECTRUM,
    "R07.7": MOVED_GRADIENT,
    "R07.8": Equation(
        lambda: [warped().value, warped().gradient],
        lambda: [WARPED.printed(), WARPED_GRADIENT.printed()],
    ),
    "R07.52": KERNEL,
    "R07.53": Equation(theorem_before_division, lambda: L_hat(Ox, Ot)),
    "R07.54": Equation(
        lambda: affine().spectrum,
        lambda: sp.exp(2 * pi * sp.I * (Omega.T * M.inv() * c)[0]) * pulled_back(),
    ),
    "R07.55": MOVED_GRADIENT,
    "D05.1": KERNEL,
    "D05.s2.1b": Equation(
        lambda: [convolution().spectrum, product().spectrum],
        lambda: [
            DERIVED["R07.fig2.convolve.fourier"].printed(),
            DERIVED["R07.fig2.multiply.fourier"].printed(),
        ],
    ),
}
