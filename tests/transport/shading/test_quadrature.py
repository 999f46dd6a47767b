"""What light is weighted with, as entries, against autodiff of the weight itself."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import normwise, rounding
from firstorder.fields import GaussianProfile
from firstorder.transport import VaryingGaussian, wave
from firstorder.transport.brdf.general import Ggx
from firstorder.transport.brdf.lobes import MIRROR, NORMAL, Lobe
from firstorder.transport.shading._flat_jets import Normal
from firstorder.transport.shading._quadrature import center_of, has_cosine, local_center, weigh

X, THETA, T = jnp.array(0.2), jnp.array(0.3), jnp.array(0.15)


def n(x):
    return 0.5 * x - 0.2 * x**2


NORMAL_HERE = Normal(n(X), 0.5 - 0.4 * X, jnp.array(-0.4))


def six(function):
    u = jnp.stack([X, THETA])

    def of(u):
        return function(u[0], u[1])

    @jax.jit
    def both(u):
        return of(u), jax.grad(of)(u), jax.hessian(of)(u)

    value, slope, bend = both(u)
    return np.array([value, *slope, bend[0, 0], bend[0, 1], bend[1, 1]])


@pytest.mark.parametrize("argument", [MIRROR, NORMAL])
def test_the_centre_seen_from_the_normal(argument):
    lobe = Lobe(GaussianProfile(0.4), argument)
    turn, look, center = center_of(lobe, NORMAL_HERE, THETA)
    assert (turn, look) == (argument.turn, argument.look)
    assert center == argument.turn * NORMAL_HERE.value + argument.look * THETA
    ours = jnp.stack(local_center(lobe, NORMAL_HERE, THETA))
    assert normwise(ours, six(lambda x, t: argument.look * (t - n(x)))) < rounding()


@pytest.mark.parametrize("cosine", [False, True])
@pytest.mark.parametrize(
    "kernel", [GaussianProfile(0.4), VaryingGaussian(wave(0.5, 0.1, mean=0.4), 0.5)]
)
def test_the_weight_of_a_lobe_with_and_without_its_cosine(kernel, cosine):
    lobe = Lobe(kernel, MIRROR, cosine)
    assert has_cosine(lobe) is cosine
    *_, weight = weigh(lobe, NORMAL_HERE, X, THETA, 16)

    def truth(x, theta):
        incoming = MIRROR.look * (theta - n(x)) - T  # omega - n
        return lobe.kernel.at(jnp.stack([x, T])) * (jnp.cos(incoming) if cosine else 1.0)

    assert normwise(jnp.stack(weight(T)), six(truth)) < rounding(100)


def test_the_weight_of_a_brdf_is_what_it_reflects_times_the_cosine():
    *_, weight = weigh(rho := Ggx(0.4), NORMAL_HERE, X, THETA, 16)
    truth = six(lambda x, theta: rho(-T, theta - n(x)) * jnp.cos(T))
    assert normwise(jnp.stack(weight(T)), truth) < rounding(100)


def test_nodes_end_where_the_cosine_or_the_lobe_does():
    wide = GaussianProfile(2.0)
    low, high = (
        np.asarray(weigh(Lobe(wide, MIRROR, c), NORMAL_HERE, X, THETA, 64)[0])
        for c in (False, True)
    )
    center = float(MIRROR.look * (THETA - n(X)))
    assert np.max(np.abs(low)) > 0.9 * float(wide.half_width())
    assert np.all(np.abs(high - center) < 0.5 * np.pi)
