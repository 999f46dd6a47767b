"""Radiosity: light that bounces between diffuse surfaces, solved and not sampled.

    E(x) = E_direct(x) + int K(x, y) rho(y) E(y) / 2 dl_y,      K = V cos_x cos_y / r   (J12 eq.
    25-26)

Nystrom's method: irradiance is kept at Gauss-Legendre nodes of panels (`_panels`) that are cut
where it is not smooth. A row of the matrix is the irradiance functional at a node (`_transfer`),
with the exact view. The same functional then gives E anywhere, with two derivatives.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal, overload

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import check_between, check_positive, is_concrete
from firstorder._display import Module
from firstorder.flatland.bounces._light_sampling import before, bounds
from firstorder.flatland.bounces._panels import Discretization, Panels, cut_into_panels
from firstorder.flatland.bounces._transfer import panel_irradiance
from firstorder.flatland.direct_lighting import irradiance, point_light_irradiance
from firstorder.flatland.discontinuities.events import VisualEvents
from firstorder.flatland.intersect import first_shape
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver
from firstorder.numerics._batching import in_batches
from firstorder.numerics._compiled import compiled
from firstorder.numerics._refinement import Approximation, approximated
from firstorder.scene._bands import by_band
from firstorder.scene._questions import check_shines

BLOCK = 64  # receivers worked on at a time


class RadiositySolution(Module):
    """The irradiance of all surfaces after any number of bounces; bands are the last axis.

    Call it as the `radiance` of `firstorder.flatland.irradiance`, or ask `irradiance`, which knows
    where its panels end and is exact to the solution's own error.

    Attributes:
        scene: the scene it solves.
        panels: where the surfaces are cut.
        E: irradiance at the nodes [W/m].
        direct: the part of it that comes straight from lights and emitters [W/m].
        gather: irradiance at the nodes of each unit of radiance at the nodes.
        events: the visual events at which panels are cut.
        glows: whether there is light other than from points.
    """

    BANDED: ClassVar = {"E": 2, "direct": 2}

    scene: Scene
    panels: Panels
    E: Float[Array, "p k ..."]
    direct: Float[Array, "p k ..."]
    gather: Float[Array, "m m"]
    events: VisualEvents = eqx.field(static=True)
    glows: bool = eqx.field(static=True, default=True)

    @property
    @by_band()
    def reflected(self) -> Float[Array, "p k *bands"]:
        """Reflected radiance at the nodes, `rho E / 2` [W/(m rad)]."""
        return 0.5 * _albedo(self.scene, self.panels)[:, None] * self.E

    @compiled
    @by_band()
    def __call__(
        self,
        index: Int[Array, ""],
        s: Float[Array, ""],
        front: Bool[Array, ""],
        toward: Float[Array, "2"],
    ) -> Float[Array, "*bands"]:
        """Radiance that a surface sends out, its own emission included [W/(m rad)]."""
        side = jnp.where(front, 0, 1)
        panel, there = self.panels.holding(2 * index + side, s)
        L = jnp.sum(self.panels.basis(panel, s)[0] * self.reflected[panel])
        return self.scene.material.emission[index, side] + jnp.where(there, L, 0.0)

    @compiled
    @by_band()
    def irradiance(self, at: Receiver) -> Float[Array, "*bands"]:
        """Irradiance at a receiver, direct and indirect [W/m]; differentiable in the receiver."""
        return _direct(self.scene, at, self.glows) + self.indirect(at)

    @compiled
    @by_band()
    def indirect(self, at: Receiver) -> Float[Array, "*bands"]:
        """Irradiance at a receiver of light that was reflected at least once [W/m]."""
        return panel_irradiance(self.scene, self.panels, self.reflected, at)

    def relit(self, albedo: Float[Array, "n 2 ..."]) -> RadiositySolution:
        """The solution for other albedos, one row for each shape; differentiable in them."""
        scene = eqx.tree_at(lambda s: s.material.albedo, self.scene, albedo)
        E = _balanced(scene, self.panels, self.gather, _Direct(self.direct))
        return eqx.tree_at(lambda s: (s.scene, s.E), self, (scene, E))

    @compiled
    @by_band()
    def flux(self) -> tuple[Float[Array, "*bands"], Float[Array, "*bands"]]:
        """Flux that lights and surfaces emit, and flux that surfaces absorb [W].

        In a closed scene the two are equal; of an open one the difference escapes. What lies under
        another surface in the same place, as a wall under a lamp drawn on it, does neither.
        """
        shape, side = self.panels.shape, self.panels.side
        seen = _seen(self.scene, self.panels)
        lengths = jnp.where(seen[:, None], _lengths(self.scene, self.panels), 0.0)
        emitted = 2.0 * jnp.pi * jnp.sum(self.scene.points.intensity)
        emitted += jnp.sum(2.0 * self.scene.material.emission[shape, side][:, None] * lengths)
        kept = 1.0 - self.scene.material.albedo[shape, side]
        return emitted, jnp.sum(kept[:, None] * self.E * lengths)


@overload
def solve_radiosity(
    scene: Scene, *, fineness: Discretization | None = None, with_error: Literal[False] = False
) -> RadiositySolution: ...


@overload
def solve_radiosity(
    scene: Scene, *, fineness: Discretization | None = None, with_error: Literal[True]
) -> Approximation: ...


def solve_radiosity(
    scene: Scene, *, fineness: Discretization | None = None, with_error: bool = False
) -> RadiositySolution | Approximation:
    """Solves for the light in a scene of diffuse surfaces.

    `E` is then smooth between the visual events of `RadiositySolution.events`, across which E' (at
    shadow edges of point lights, E itself) jumps; at corners E' does not exist: E behaves as `a + b
    x^alpha`, `rho m(alpha) = 1`, with alpha = 0.90 at right angles between walls of albedo 0.2.

    Of several bands the panels, which side light reaches and what nodes gather from each other are
    found once.

    Args:
        scene: concrete shapes that emit and reflect diffusely, on either side.
        fineness: how finely surfaces are cut; `Discretization().finer()` is one refinement.
        with_error: whether to give an `Approximation`: the solution, and a bound of the error of E
            at each node, in the shape of E [W/m]. It takes two more solutions, of one and of two
            refinements: the nodes of a panel converge geometrically and panels at corners are a
            hundred times smaller, so that little of the error is left in them.

    Raises:
        ValueError: if the scene is traced, something in it mirrors, shines or refracts, or its
            panels have more than 20,000 nodes, as in a gap that is far thinner than it is long.

    Reference: J12 §3.3, eqs. 25-26; §4.1 for scenes C and D.

    Example:
        >>> from firstorder.flatland import Scene, box, primitive
        >>> from firstorder.flatland.bounces import solve_radiosity
        >>> walls = primitive(box((0, 0), (1, 1), inward=True), emission=0.5, albedo=0.5)
        >>> furnace = solve_radiosity(Scene.of(walls))
        >>> round(float(furnace.E.min()), 12), round(float(furnace.E.max()), 12)  # L = 1: E = 2
        (2.0, 2.0)
    """
    if with_error:
        return _with_errors(scene, fineness or Discretization())
    if not is_concrete(scene):
        raise ValueError(
            "Argument `scene` must be concrete, but is traced; use `RadiositySolution.relit`."
        )
    for name in ("mirror", "specular", "ior"):
        if np.any(np.asarray(getattr(scene.material, name)) != 0.0):
            raise ValueError(
                f"Argument `scene` must be diffuse, but holds a surface with `{name}`."
            )
    check_shines(scene)
    panels, events = cut_into_panels(scene, fineness)
    glows = bool(np.any(np.asarray(scene.material.emission))) or scene.environment is not None
    direct, gather = _system(scene, panels, glows)
    direct = direct.reshape(panels.shape.shape[0], -1, *direct.shape[1:])
    E = _balanced(scene, panels, gather, _Direct(direct))
    return RadiositySolution(scene, panels, E, direct, gather, events, glows)


def _with_errors(scene: Scene, fineness: Discretization) -> Approximation:
    """A solution, and the errors of its E by solutions of finer panels."""
    once = fineness.finer()
    solution, *others = (
        solve_radiosity(scene, fineness=each) for each in (fineness, once, once.finer())
    )
    answers = [solution.E, *(_at_nodes(other, solution.panels) for other in others)]
    return Approximation(solution, approximated(lambda step: answers[step]).error)


@eqx.filter_jit
def _at_nodes(solution: RadiositySolution, panels: Panels) -> Float[Array, "p k *bands"]:
    """Irradiance of a solution at the nodes of other panels."""

    def one(sheet, s):
        k, _ = solution.panels.holding(sheet, s)
        return jnp.tensordot(solution.panels.basis(k, s)[0], solution.E[k], 1)

    sheets, s = 2 * panels.shape + panels.side, panels.rule()[0]
    return jax.vmap(lambda sheet, row: jax.vmap(lambda t: one(sheet, t))(row))(sheets, s)


def corner_exponent(albedo: float) -> float:
    """The power alpha in `E = a + b x^alpha` at a right-angled corner of two walls of one albedo.

    `rho B(1 + alpha/2, (1 - alpha)/2) / 4 = 1`, alpha in [0, 1): the kernel of two walls at right
    angles maps `x^alpha` to a multiple of itself. E' diverges at the corner as `x^(alpha - 1)`.

    Args:
        albedo: of both walls, in (0, 1].

    Returns:
        A number without unit, [1] for black walls.

    Raises:
        ValueError: if the albedo lies outside (0, 1].

    Example:
        >>> from firstorder.flatland.bounces import corner_exponent
        >>> round(corner_exponent(0.2), 3)
        0.903
    """
    check_positive("albedo", albedo)
    check_between("albedo", albedo, 0.0, 1.0)
    low, high = 0.0, 1.0
    for _ in range(52):
        alpha = 0.5 * (low + high)
        a, b = 1.0 + 0.5 * alpha, 0.5 * (1.0 - alpha)
        log = math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)
        if math.log(0.25 * albedo) + log < 0.0:
            low = alpha
        else:
            high = alpha
    return 0.5 * (low + high)


class _Direct(Module):
    """Direct light at the nodes of panels."""

    BANDED: ClassVar = {"E": 2}

    E: Float[Array, "p k ..."]


@by_band()
def _balanced(
    scene: Scene, panels: Panels, gather: Float[Array, "m m"], direct: _Direct
) -> Float[Array, "p k"]:
    """Light at the nodes after any number of bounces."""
    return _balance(gather, direct.E, scene, panels)


@eqx.filter_jit
def _balance(
    gather: Float[Array, "m m"], direct: Float[Array, "p k"], scene: Scene, panels: Panels
) -> Float[Array, "p k"]:
    """Solves `E = direct + gather (rho E / 2)`; differentiable in all three."""
    half = jnp.repeat(0.5 * _albedo(scene, panels), direct.shape[1])
    A = jnp.eye(gather.shape[0], dtype=gather.dtype) - gather * half
    return jnp.linalg.solve(A, direct.ravel()).reshape(direct.shape)


@eqx.filter_jit
def _system(scene, panels, glows):
    """Direct light at all nodes, and what they gather from one another."""
    s, _ = panels.rule()
    number = jnp.repeat(jnp.arange(panels.shape.shape[0]), panels.count)
    nothing = jnp.zeros_like(s)
    step = before(*bounds(scene))

    def row(k, s):
        at = _node(scene, panels, k, s)
        # Another wall in the place of this one lies behind, and not before it by rounding.
        at = eqx.tree_at(lambda a: a.position, at, at.position + step * at.normal)
        return _direct(scene, at, glows), jax.grad(
            lambda L: panel_irradiance(scene, panels, L, at, moving=False)
        )(nothing).ravel()

    return in_batches(lambda a: row(*a), (number, s.ravel()), BLOCK)


def _direct(scene: Scene, at: Receiver, glows: bool) -> Float[Array, "*bands"]:
    """Light from lights and emitters; without emitters no view is needed."""
    return irradiance(scene, at) if glows else point_light_irradiance(scene, at)


def _node(scene: Scene, panels: Panels, k, s) -> Receiver:
    """The receiver at a parameter of a panel, on the side of that panel."""
    frame = scene.frame(panels.shape[k], s)
    return Receiver(frame.position, frame.n + jnp.pi * panels.side[k], panels.shape[k])


@eqx.filter_jit
def _seen(scene: Scene, panels: Panels) -> Bool[Array, " p"]:
    """Whether panels are what is seen in their place."""
    at = jax.vmap(lambda k, s: _node(scene, panels, k, s))(
        jnp.arange(panels.shape.shape[0]), panels.ends.mean(1)
    )
    start = at.position + before(*bounds(scene)) * at.normal
    return first_shape(scene, start, -at.normal) == panels.shape


def _albedo(scene: Scene, panels: Panels) -> Float[Array, " p"]:
    return scene.material.albedo[panels.shape, panels.side]


def _lengths(scene: Scene, panels: Panels) -> Float[Array, "p k"]:
    """The weights of the nodes in metres."""
    s, w = panels.rule()
    speed = jax.vmap(lambda i, row: jax.vmap(lambda t: scene.frame(i, t).speed)(row))(
        panels.shape, s
    )
    return speed * w
