"""Surface maps by primitive: bumps, normal maps and albedo textures.

Functions of the position, or pictures over (u, v); `imaging._textures` has some of both. What they
do to a point is in `imaging._interaction.apply_surface_maps`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from firstorder._display import Module
from firstorder.imaging._textures import height_slopes, normal_map_slopes

Height = Callable[[Int[Array, ""], Float[Array, "3"]], Float[Array, ""]]
Slopes = Callable[[Int[Array, ""], Float[Array, "3"]], Float[Array, "3"]]


class UVMaps(Module):
    """Surface maps over (u, v): functions of a primitive's number and of (u, v), or None.

    Attributes:
        height: of bumps [m]; twice differentiable.
        normals: of a tangent-space normal map, as `_textures.normal_map_slopes` takes them.
        albedo: factor of the diffuse albedo, not negative.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import UVMaps
        >>> halves = UVMaps(albedo=lambda index, uv: jnp.where(uv[0] > 0.5, 1.0, 0.25))
        >>> halves.albedo(0, jnp.array([0.75, 0.0])).item()
        1.0
    """

    height: Height | None = None
    normals: Slopes | None = None
    albedo: Height | None = None


class SurfaceMaps(Module):
    """Surface maps in space: functions of a primitive's number and of a position, or None.

    Attributes:
        height: of bumps [m].
        slopes: a normal map in space: what `_bumps.solid_tilted` takes, for fronts; from behind the
            same normals are seen from the other side, as those of bumps are.
        albedo: factor of the diffuse albedo, a texture; not negative.
        wrapped: pictures over (u, v), which add to these; factors multiply.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import SurfaceMaps
        >>> waves = SurfaceMaps(height=lambda index, x: 0.01 * jnp.sin(6.0 * x[0]))
        >>> waves.height(0, jnp.zeros(3)).item()
        0.0
    """

    height: Height | None = None
    slopes: Slopes | None = None
    albedo: Height | None = None
    wrapped: UVMaps | None = None

    def leanings(
        self,
        index: Int[Array, ""],
        uv: Callable[[Array], Array],
        up: Callable[[Array], Array],
    ) -> list[Callable]:
        """Slopes in space of one primitive, functions of position, each of which tilts the normal.

        Args:
            index: the primitive's number.
            uv: of a position on it.
            up: its unit normal there, without all this.
        """
        found = []
        if self.height is not None:
            rise = jax.grad(self.height, 1)
            found.append(lambda x: rise(index, x))
        if self.slopes is not None:
            tilt = self.slopes
            found.append(lambda x: tilt(index, x))
        over = UVMaps() if self.wrapped is None else self.wrapped
        if over.height is not None:
            found.append(height_slopes(functools.partial(over.height, index), uv))
        if over.normals is not None:
            found.append(normal_map_slopes(functools.partial(over.normals, index), uv, up))
        return found

    def factors(self, index: Int[Array, ""], uv: Callable[[Array], Array]) -> list[Callable]:
        """Factors of the albedo of one primitive, functions of the position; as `leanings`."""
        found: list[Callable] = []
        if self.albedo is not None:
            found.append(functools.partial(self.albedo, index))
        if self.wrapped is not None and (one := self.wrapped.albedo) is not None:
            found.append(lambda x: one(index, uv(x)))
        return found


class PerPrimitive(Module):
    """A function of a primitive's number and of a place, from one for each of some numbers.

    All of them are computed everywhere, and one is kept.

    Args:
        plain: what the others have.
        numbers: of primitives.
        worn: a function for each of these.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.imaging import PerPrimitive
        >>> only = PerPrimitive((1.0,), ((2, 3),), (lambda x: x[0],))
        >>> [only(jnp.array(k), jnp.array([0.5, 0.0])).item() for k in (1, 2, 3)]
        [1.0, 0.5, 0.5]
    """

    plain: tuple[float, ...] = eqx.field(static=True)
    numbers: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    worn: tuple[Callable, ...]

    def __call__(self, index: Int[Array, ""], place: Float[Array, " n"]) -> Array:
        """Value for a primitive at a place; `plain` of one number is a number, not a vector."""
        found = jnp.asarray(self.plain, place.dtype)
        found = found[0] if found.shape == (1,) else found
        for numbers, one in zip(self.numbers, self.worn, strict=True):
            here = jnp.any(jnp.asarray(numbers) == index)
            found = jnp.where(here, one(place), found)
        return found
