"""Commands on paths and laws: their jets, and the table of the squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import tyro

Pair = tuple[float, float]


@dataclass(frozen=True)
class Jet:
    """Print value, gradient and Hessian of light at one ray, at every step of a path.

    A Gaussian light travels, passes a half-plane (if there is one), travels on, and is reflected
    by a curved glossy receiver. Every step is asked at the same two numbers.
    """

    at: Pair = (0.3, 0.1)
    """The ray: position in metres, and slope or angle in radians."""
    center: Pair = (0.1, -0.05)
    """Where the source is brightest: metres, slope."""
    sigma: Pair = (0.5, 0.3)
    """Its standard deviations."""
    d: float = 1.0
    """Distance travelled to the blocker, in metres."""
    edge: float | None = None
    """The half-plane blocks x < edge; without one, nothing is blocked."""
    d_after: float = 0.7
    """Distance travelled from there to the receiver, in metres."""
    kappa: float = 0.4
    """Curvature of the receiver in radians per metre, positive in a valley."""
    roughness: float = 0.2
    """Standard deviation of its Gaussian lobe, in radians."""

    def path(self) -> Any:
        """The path in words of the library."""
        import jax.numpy as jnp

        from firstorder._argument_checks import check_finite, check_not_negative, check_positive
        from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
        from firstorder.fields import Affine, GaussianProfile, gaussian
        from firstorder.laws import Hemisphere
        from firstorder.transport import (
            Curvature,
            Mirror,
            Reflection,
            ToAngle,
            Travel,
            half_plane_blocker,
        )

        for name in ("at", "center", "edge"):
            if getattr(self, name) is not None:
                check_finite(name, jnp.asarray(getattr(self, name)))
        check_not_negative("d_after", self.d_after)
        check_positive("roughness", self.roughness)
        path = gaussian(self.center, self.sigma, frame=FLATLAND_SLOPE) >> Travel(self.d)
        if self.edge is not None:
            path = path >> half_plane_blocker(self.edge, FLATLAND_SLOPE)
        # Light that had a slope comes from above the base line, which in the mirrored local frame
        # is the hemisphere about kappa x; beyond it the tangent would begin anew.
        above = Hemisphere(Affine([self.kappa, 0.0], 0.0, FLATLAND.turned()))
        shine = Mirror() >> Reflection(GaussianProfile(self.roughness), above)
        turned = path >> Travel(self.d_after) >> ToAngle() >> Curvature(self.kappa)
        return turned >> shine >> Curvature(self.kappa, back=True)

    def run(self) -> int:
        """One line for each step."""
        import equinox as eqx
        import jax.numpy as jnp

        from firstorder.transport import Path

        path = self.path()
        u = jnp.asarray(self.at)
        jets = eqx.filter_jit(Path.jets)(path, u)
        names = ["source", *(type(event).__name__.lower() for event in path.events)]
        print(f"{'step':12}" + "".join(f"{head:>12}" for head in _HEADS))
        for name, jet in zip(names, jets, strict=True):
            H = jet.hessian
            numbers = (jet.value, *jet.gradient, H[0, 0], H[0, 1], H[1, 1])
            print(f"{name:12}" + "".join(f"{number:12.5g}" for number in numbers))
        print("1 is x; 2 is the slope v up to the second travel, and the angle theta after it.")
        return 0


_HEADS = ("value", "d/d1", "d/d2", "d2/d1d1", "d2/d1d2", "d2/d2d2")


@dataclass(frozen=True)
class Table:
    """Print what each law and event does to each portrait, with the measured error.

    Exit code 1 if a square is not as it is declared.
    """

    names: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="NAMES")] = ()
    """How the names of laws and events begin, such as travel; or all. The laws, if left out."""

    def run(self) -> int:
        """One line for each law or event, and the reasons of refusals."""
        from firstorder.checks.registry import all_cases
        from firstorder.checks.table import LAWS, as_text, measure

        known = all_cases()
        lost = [n for n in self.names if n != "all" and not any(k.startswith(n) for k in known)]
        if lost:
            raise ValueError(
                f"Argument `names` must begin names that `table all` prints, but has {lost[0]!r}."
            )
        chosen = [k for k in known if k.startswith(self.names)] if self.names else LAWS
        table = measure(known if "all" in self.names else chosen)
        print(as_text(table))
        squares = [(name, s) for name, row in table.items() for s in row.values()]
        return int(any(s.verdict != known[n].expected.get(s.portrait, "equal") for n, s in squares))
