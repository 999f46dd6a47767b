"""A lobe of light is reflected by a curved glossy surface: every portrait of what leaves it."""

import jax.numpy as jnp

from firstorder import session
from firstorder.fields import GaussianProfile, gaussian
from firstorder.transport import Curvature, Mirror, Reflection

session.start()
light = gaussian(center=(0.2, 0.1), sigma=(0.5, 0.3))  # in place x [m] and direction theta [rad]
kappa = 0.4  # rad/m
glossy = Curvature(kappa) >> Mirror() >> Reflection(GaussianProfile(0.2))
B = (light >> glossy >> Curvature(kappa, back=True)).light

jet = B.jet(jnp.array([0.3, -0.1]))
print("value", jet.value)
print("gradient", jet.gradient)
print("hessian", jet.hessian.ravel())
print("integral", B.spectrum()(0.0, 0.0).real)
print("covariance of the spectrum", B.covariance().matrix.ravel())
