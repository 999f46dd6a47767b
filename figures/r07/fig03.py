"""R07 Fig. 3: the light field and both its gradients through the four shading steps.

The paper gives no numbers. Ours: a Gaussian source of 0.5 m and 0.35 rad about (0.2 m, 0.5 rad), a
valley of curvature 0.6 rad/m, a Gaussian BRDF of 0.3 rad. The source is off-centre, so that the
mirror step shows.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Drawing
from figures.verdicts import OURS, Statement, at_most, near
from firstorder import plotting
from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND
from firstorder.fields import GaussianProfile, gaussian
from firstorder.transport import Curvature, Mirror, Reflection

KAPPA, SIGMA = 0.6, 0.3
STEPS = ("source", "rotation", "mirror", "BRDF", "inverse rotation")
ROWS = ("L", "L_x", "L_theta")


def draw(quick: bool) -> Drawing:
    n = 49 if quick else 145
    x, theta = np.linspace(-1.8, 1.8, n), np.linspace(-1.8, 1.8, n)
    path = (
        gaussian((0.2, 0.5), (0.5, 0.35))
        >> Curvature(KAPPA)
        >> Mirror()
        >> Reflection(GaussianProfile(SIGMA, frame=FLATLAND.turned()), nodes=64)
        >> Curvature(KAPPA, back=True)
    )
    jets = [eqx.filter_jit(lambda f: f.jets(x[:, None], theta[None, :]))(f) for f in path.steps]
    data = [[j.value, j.gradient[..., 0], j.gradient[..., 1]] for j in jets]
    figure, axes = plotting.panels(3, 5, 2.35, 2.2)
    words = ("$L$", r"$\partial L/\partial x$", r"$\partial L/\partial\theta$")
    for c, (step, rows) in enumerate(zip(STEPS, data, strict=True)):
        for r, values in enumerate(rows):
            limit = max(float(np.max(np.abs(d[r]))) for d in data)
            plotting.show_light_field(
                axes[r, c],
                np.asarray(values),
                x,
                theta,
                signed=r > 0,
                limit=limit,
                equal=True,
                title=f"{'abcde'[c]}) {step}" if r == 0 else words[r],
            )
            axes[r, c].label_outer()
    arrays = {
        f"{row}_{c}": np.asarray(values)
        for c, rows in enumerate(data)
        for row, values in zip(ROWS, rows, strict=True)
    }
    arrays |= {"x": x, "theta": theta}
    return Drawing(figure, arrays, _claims(path, jets, x, theta), size=f"{n} x {n} rays, 64 nodes")


def _claims(path, jets, x, theta) -> list[Statement]:
    source, rotated = path.steps[0], jets[1]
    there = source.jets(x[:, None], theta[None, :] + KAPPA * x[:, None])
    sheared = there.gradient[..., 0] + KAPPA * there.gradient[..., 1]
    shear = normwise(rotated.gradient[..., 0], sheared)
    flipped = normwise(jets[2].gradient[..., 1], -jets[1].gradient[..., ::-1, 1])
    widths = [_spread(path.steps[i]) for i in (2, 3)]
    blur = np.sqrt(widths[1] ** 2 - widths[0] ** 2)
    rays = jnp.array([[0.3, 0.2], [-0.4, -0.1], [0.1, 0.4]])
    oracle = eqx.filter_jit(lambda f: jax.vmap(jax.grad(f.at))(rays))(path.light)
    closed = eqx.filter_jit(lambda f: jax.vmap(f.jet)(rays))(path.light).gradient
    blurred = (path.source >> Mirror() >> path.events[2]).light  # L (*) rho, read at 2 k x - theta
    r = jnp.stack([rays[:, 0], -(2.0 * KAPPA * rays[:, 0] - rays[:, 1])], -1)
    g = eqx.filter_jit(lambda f: jax.vmap(f.jet)(r))(blurred).gradient
    formula = jnp.stack([g[:, 0] - 2.0 * KAPPA * g[:, 1], g[:, 1]], -1)
    against_autodiff, against_formula = normwise(closed, oracle), normwise(closed, formula)
    return [
        _identity("Rotation: L^s_x = L_x + k L_theta at the sheared ray", shear, "R07 (11)"),
        _identity("Mirror: the angular gradient is reflected and negated", flipped, "R07 (12)"),
        Statement(
            "Convolving with the BRDF blurs along the angle, by the BRDF's own width",
            "some blurring",
            blur,
            near(SIGMA, 1e-9, "widths of Gaussians add by squares"),
            "R07 §4.1, Fig. 3(d)",
            "rad",
        ),
        _identity("Gradients of the final light field are those of autodiff", against_autodiff),
        _identity(
            "B_x = L_x (*) rho + 2 k L_theta (*) rho at the reflected direction",
            against_formula,
            "R07 (25)",
        ),
    ]


def _identity(words: str, error: float, source: str = OURS) -> Statement:
    """An identity, to the precision of the ledger; normwise."""
    rule = at_most(1e-10, "an identity, to the ledger's precision")
    return Statement(words, "exact" if source != OURS else None, error, rule, source)


def _spread(field) -> float:
    """Standard deviation over the angle at x = 0.2, where the light is centred."""
    angle = np.linspace(-4.0, 4.0, 161)
    column = np.asarray(eqx.filter_jit(lambda f: f(0.2, angle))(field))
    mean = np.sum(column * angle) / np.sum(column)
    return float(np.sqrt(np.sum(column * (angle - mean) ** 2) / np.sum(column)))
