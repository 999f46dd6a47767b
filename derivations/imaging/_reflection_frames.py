"""Light in the frame of a curved surface: the library against autodiff and against differences."""

from __future__ import annotations

import functools

import numpy as np

from derivations.imaging import _surfaces as our
from firstorder.checks.tolerance import fitted_order, normwise


def arrays():
    import jax.numpy as jnp

    return [jnp.asarray(a) for a in (our.PLACE, our.AXES, our.S, our.LOCAL, our.TO_EYE)]


def jax_light(x, w):
    import jax.numpy as jnp

    return our.light(x, w, jnp)


def jax_moved(step):
    """Position and carried frame after a step (2,) on the ellipsoid, in JAX."""
    import jax.numpy as jnp

    x, axes, _, _, _ = arrays()
    y = x + axes[:, :2] @ step
    y = y / jnp.sqrt(jnp.sum((y / our.RADII) ** 2))
    m = y / our.RADII**2
    m, n = m / jnp.sqrt(m @ m), axes[:, 2]
    v = jnp.cross(n, m)
    return y, axes + jnp.cross(v[:, None], axes, axis=0) + jnp.cross(
        v[:, None], jnp.cross(v[:, None], axes, axis=0), axis=0
    ) / (1.0 + n @ m)


@functools.cache
def framed():
    """The library's gradient in the surface's frame, beside autodiff of the composition."""
    import jax
    import jax.numpy as jnp

    from firstorder.imaging._reflection import in_frame

    x, axes, S, w, _ = arrays()
    L_x, L_w = jax.grad(jax_light, (0, 1))(x, axes @ w)
    ours = in_frame(L_x, L_w, axes, S, w)

    def composed(step, turn):
        y, frame = jax_moved(step)
        v = w + turn
        return jax_light(y, frame @ (v / jnp.sqrt(v @ v)))

    spatial, angular = jax.jacfwd(composed, (0, 1))(jnp.zeros(2), jnp.zeros(3))
    return ours, spatial, angular


def frame_autodiff(part: str) -> float:
    """Gradient in the frame against autodiff through the ellipsoid."""
    ours, spatial, angular = framed()
    return normwise(getattr(ours, part), {"spatial": spatial, "angular": angular}[part])


def _frame_at(i, s):
    x, n = our.moved(i, s)
    return x, our.smallest_rotation(our.AXES[:, 2], n) @ our.AXES


@functools.cache
def frame_differences(part: str) -> float:
    """The same against differences of light traced in the carried frame."""
    w = our.LOCAL

    def along(i):
        return our.slope(lambda s: our.light(_frame_at(i, s)[0], _frame_at(i, s)[1] @ w))

    ours = framed()[0]
    if part == "spatial":
        return normwise(ours.spatial, np.array([along(0), along(1)]))
    e1 = our.unit(np.cross(w, [0.1, 0.2, 0.9]))
    turns = np.stack([e1, np.cross(w, e1)])
    true = [
        our.slope(lambda s, e=e: our.light(our.PLACE, our.AXES @ (w * np.cos(s) + e * np.sin(s))))
        for e in turns
    ]
    return normwise(turns @ np.asarray(ours.angular), np.array(true))


def principal():
    import jax.numpy as jnp

    from firstorder.imaging._reflection import turning_of_directions

    axes, kappas = our.principal_frame(our.PLACE)
    ours = turning_of_directions(*map(jnp.asarray, (axes, np.diag(kappas), our.LOCAL)))
    return axes, kappas, np.asarray(ours)


def principal_differences() -> float:
    """(60): how the carried principal frame turns a fixed direction, by differences."""
    axes, _, ours = principal()
    n = axes[:, 2]

    def turned(i, s):
        return our.smallest_rotation(n, our.moved(i, s, axes)[1]) @ axes @ our.LOCAL

    return normwise(ours, np.stack([our.slope(lambda s, i=i: turned(i, s)) for i in (0, 1)], 1))


def principal_columns() -> float:
    """(60), (62): `kappa P w` with columns, written out."""
    axes, kappas, ours = principal()
    t, b, n = axes.T
    w = our.LOCAL
    columns = np.stack([kappas[0] * (n * w[0] - t * w[2]), kappas[1] * (n * w[1] - b * w[2])], 1)
    return normwise(ours, columns)


def rotation_order() -> float:
    """(61): how far the order of what the library's `kappa P w` neglects is from 2."""
    axes, _, ours = principal()
    n, w = axes[:, 2], our.LOCAL
    sizes = np.array([0.004, 0.002, 0.001])

    def miss(s):
        turned = our.smallest_rotation(n, our.moved(0, s, axes)[1]) @ axes @ w
        rough = axes @ w + s * ours[:, 0]
        return abs(our.light(our.PLACE, turned) - our.light(our.PLACE, rough))

    return abs(fitted_order(sizes, [miss(s) for s in sizes]) - 2.0)
