"""Five events from expressions; `firstorder check examples/own_events.py` judges them."""

import sympy

from firstorder import session
from firstorder.symbolic import event, explain, lobe
from firstorder.transport import Chain, Reflection

session.start()
x, theta, v, t, f, sigma, n, d, w, a = sympy.symbols("x theta v t f sigma n d w a")

lens = event({theta: theta - x / f}, parameters={f: 0.5})

haze = event(factor=sympy.exp(-sigma * d / sympy.cos(theta)), parameters={sigma: 0.3, d: 2.0})

satin = Reflection(lobe(sympy.cos(t) ** 8 * (1 + a * t**2), t, parameters={a: 0.3}))

glass = event({theta: sympy.asin(sympy.sin(theta) / n)}, parameters={n: 1.5})

blocker = event(
    factor=1 / (1 + sympy.exp((x - v * d - w) / sigma)),
    parameters={d: 0.7, w: 0.1, sigma: 0.2},
)

if __name__ == "__main__":
    for name, one in (("lens", lens), ("haze", haze), ("glass", glass), ("blocker", blocker)):
        print(f"{name}: {explain(Chain((one,))).steps[1].formula}")
    limit = satin.lobe.band_limit(0.01)
    print("satin: 1 % of the energy lies beyond", limit.Omega, "give or take", limit.error)
