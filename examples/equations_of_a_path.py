"""The equations of a path, read out of the code that computes its numbers: R07 (24), (25), D05."""

import sympy

from firstorder import session
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.fields import gaussian
from firstorder.symbolic import UnknownField, UnknownLobe, derive
from firstorder.transport import Bump, Mirror, Reflection, Travel

session.start()
n, rho = UnknownField("n", ("x",)), UnknownLobe("rho")
light = UnknownField("L", frame=FLATLAND)
reflected = light >> Bump(n) >> Mirror() >> Reflection(rho) >> Bump(n, back=True)
B = derive(reflected)
print("B:", B.value)
for name, entry in zip(["x", "theta"], B.gradient.expression, strict=True):
    print(f"B_{name}:", sympy.expand(entry))

d = sympy.Symbol("d", positive=True)
travel = derive(Travel(d), FLATLAND_SLOPE)
print("spectrum after travel:", travel.spectrum)
print("in LaTeX:", travel.gradient.latex)

bell = gaussian((0.0, 0.0), (1.0, 0.5), frame=FLATLAND_SLOPE)
shear = travel.gradient.lower(L=bell)  # a jitted function of x, v and d
print("gradient", shear(0.5, 0.2, d=2.0))
