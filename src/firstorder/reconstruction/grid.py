"""Interpolation over a coarse grid of values and gradients, and of values alone.

A grid of h costs as much whether its gradients are used or not, and with them the error falls with
a higher power of h. `SCHEMES` lists what can be done with four corners; they differ in what they
need, in their order and in whether slopes agree across cells. Labels (which object a pixel shows,
what it sees) keep anything from being interpolated across an edge in the image.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import check_finite, is_concrete, nan_unless
from firstorder._display import Module
from firstorder.reconstruction._cells import cell_of
from firstorder.reconstruction.hermite import hermite_basis
from firstorder.typing import as_float


class _Scheme(NamedTuple):
    """Data per node, order and exactness of an interpolation scheme.

    Attributes:
        data: numbers needed at each node: 1 the value, 3 also the gradient.
        order: power of the cell's length in its error, for smooth functions.
        exact: what it reproduces.
        smooth: whether slopes are continuous across cells.
    """

    data: int
    order: int
    exact: str
    smooth: bool


SCHEMES = {
    "bilinear": _Scheme(1, 2, "1, x, y, xy", False),
    "bicubic": _Scheme(1, 3, "degree 2 in x and in y", True),
    "hermite": _Scheme(3, 4, "cubics; degree 3 in x and in y with given mixed derivatives", True),
    "hermite, no twist": _Scheme(3, 2, "p(x) + q(y) of degree 3", True),
    "serendipity": _Scheme(3, 4, "cubics, x^3 y, x y^3", False),
    "bezier": _Scheme(3, 3, "quadratics", False),
    "extrapolated": _Scheme(3, 2, "planes", False),
    "inverse distance": _Scheme(3, 2, "planes", False),
}


class GridInterpolant(Module):
    r"""Values between the nodes of a grid, by one of `SCHEMES`.

    With s, t the place in its cell, b_i the four bilinear weights, f_i the value, g_i the gradient
    at corner i and d_i the way there from the corner:

    - `bilinear`: `sum b_i f_i`.
    - `bicubic`: Hermite cubics whose slopes are those of parabolas through three nodes
      (Catmull-Rom on an even grid).
    - `hermite`: Hermite cubics in both directions. The mixed derivative f_xy is the fourth column
      of the data if there is one, else the mean of `d(f_x)/dy` and `d(f_y)/dx` by the same
      parabolas. Needs neighbours of the cell, and slopes agree across cells.
    - `hermite, no twist`: the same with `f_xy = 0` (Ferguson's patch). What it leaves out is of
      order h^2: it cannot even follow xy.
    - `serendipity`: Hermite cubics along the edges, blended linearly (Adini's twelve numbers). As
      exact as `hermite` from one cell alone; slopes across an edge do not agree.
    - `bezier`: `sum b_i (f_i + g_i . d_i / 2)`; along an edge the quadratic Bezier curve whose
      control point is the mean of both tangents' values in the middle. The half makes it exact
      for quadratics: to second order `f_i + g_i . d_i / 2` misses f by `-g(x) . d_i / 2`, and
      `sum b_i d_i = 0`.
    - `extrapolated`: `sum b_i (f_i + g_i . d_i)`. Its leading error is that of `bilinear` with
      the other sign, so on an even grid gradients so used gain nothing.
    - `inverse distance`: the same with weights `1 / |d_i|`, as caches use them.

    NaN outside of the grid, and where no corner of the cell has the label that is asked for. Where
    some corners have it, the weighted mean of their extrapolations (`inverse distance`; by the
    slopes of `bicubic`, and of their values where neither data nor scheme has gradients).

    Valid when: the function is smooth between nodes of one label. Wrong when an edge passes that
    no label shows.

    Args:
        x, y: positions of the nodes, in rising order [any units].
        data: for each node (first axis x, second y) the value, then df/dx and df/dy, then
            d2f/dxdy: one, three or four columns.
        scheme: one of `SCHEMES`.
        labels: an integer for each node; corners are used only where it is the one asked for.

    Raises:
        ValueError: if nodes do not rise or are fewer than two, the data do not fit, or the scheme
            is unknown or needs gradients that are not there.

    Reference: R07 §8.1, which names Ward and Heckbert 1992 and Annen et al. 2004, and "a quadratic
    Bezier curve" for its own; orders are measured in tests/reconstruction/test_grid.py.

    Example:
        >>> from firstorder.reconstruction import GridInterpolant
        >>> corners = [[[0.0], [0.0]], [[0.0], [2.0]]]
        >>> f = GridInterpolant([0.0, 1.0], [0.0, 2.0], corners, "bilinear")
        >>> f(0.5, 1.0).item()  # xy
        0.5
    """

    x: Float[Array, " n"] = eqx.field(converter=as_float)
    y: Float[Array, " m"] = eqx.field(converter=as_float)
    data: Float[Array, "n m k"] = eqx.field(converter=as_float)
    scheme: str = eqx.field(static=True, default="hermite")
    labels: Int[Array, "n m"] | None = eqx.field(
        default=None, converter=lambda a: None if a is None else jnp.asarray(a)
    )

    def __check_init__(self):
        """Refuse a grid that does not rise, and data that do not fit."""
        shape = (self.x.size, self.y.size)
        if self.scheme not in SCHEMES:
            known = ", ".join(repr(s) for s in SCHEMES)
            raise ValueError(f"Argument `scheme` must be one of {known}, but is {self.scheme!r}.")
        for name, nodes in (("x", self.x), ("y", self.y)):
            if nodes.ndim != 1 or nodes.size < 2:
                raise ValueError(f"Argument `{name}` must hold two or more nodes.")
            check_finite(name, nodes)
            if is_concrete(nodes) and not bool(jnp.all(jnp.diff(nodes) > 0)):
                raise ValueError(f"Argument `{name}` must be in rising order, but is not.")
        if (
            self.data.ndim != 3
            or self.data.shape[:2] != shape
            or self.data.shape[2] not in (1, 3, 4)
        ):
            raise ValueError(
                f"Argument `data` must have shape {shape} and 1, 3 or 4 columns, "
                f"but has shape {self.data.shape}."
            )
        if self.data.shape[2] < SCHEMES[self.scheme].data:
            raise ValueError(f"Argument `data` must hold gradients for the scheme {self.scheme!r}.")
        if self.labels is not None and self.labels.shape != shape:
            raise ValueError(
                f"Argument `labels` must have shape {shape}, but has {self.labels.shape}."
            )

    @staticmethod
    def of(
        function: Callable[[Array, Array], tuple[Array, ...]],
        x: ArrayLike,
        y: ArrayLike,
        scheme: str = "hermite",
    ) -> GridInterpolant:
        """Samples a function on the grid.

        Args:
            function: of arrays x and y; returns what is known: the value, or the value, df/dx and
                df/dy, or those and d2f/dxdy.
            x: positions of the nodes, shape (n,) [any unit].
            y: theirs along the other axis, shape (m,).
            scheme: one of `SCHEMES`.

        Raises:
            ValueError: as `GridInterpolant` does.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.reconstruction import GridInterpolant
            >>> x = jnp.arange(3.0)
            >>> f = GridInterpolant.of(lambda x, y: (x * y,), x, x, "bilinear")
            >>> f(0.5, 1.5).item()
            0.75
        """
        x, y = as_float(x), as_float(y)
        known = function(*jnp.meshgrid(x, y, indexing="ij"))
        return GridInterpolant(x, y, jnp.stack(known, -1), scheme)

    def __call__(
        self, x: ArrayLike, y: ArrayLike, label: ArrayLike | None = None
    ) -> Float[Array, "..."]:
        """The interpolated value.

        Args:
            x: where, an array of any shape.
            y: the other coordinate, of a shape that fits.
            label: that of the places asked for; needed if the nodes have labels.

        Raises:
            ValueError: if one of label and labels is there and the other is not.
        """
        if (label is None) != (self.labels is None):
            raise ValueError("Argument `label` must be given if and only if the nodes have labels.")
        x, y = jnp.broadcast_arrays(as_float(x), as_float(y))
        i, j = cell_of(self.x, x), cell_of(self.y, y)
        h = self.x[i + 1] - self.x[i], self.y[j + 1] - self.y[j]
        s, t = (x - self.x[i]) / h[0], (y - self.y[j]) / h[1]
        # In units of the cell, every derivative is a difference.
        units = jnp.stack([jnp.ones_like(h[0]), h[0], h[1], h[0] * h[1]], -1)
        at = i[..., None, None] + np.array([[0], [1]]), j[..., None, None] + np.array([[0, 1]])
        corners = self._completed()[at] * units[..., None, None, :]
        sound = _within(self.x, x) & _within(self.y, y)
        sound &= jnp.all(jnp.diff(self.x) > 0.0) & jnp.all(jnp.diff(self.y) > 0.0)
        if self.labels is None or label is None:
            return nan_unless(sound, _combined(self.scheme, s, t, corners))
        same = self.labels[at] == jnp.asarray(label)[..., None, None]
        corners = jnp.where(same[..., None], corners, 0.0)  # the others may be NaN
        some = _inverse_distance(s, t, corners, same)
        value = _combined(self.scheme, s, t, corners)
        value = jnp.where(jnp.all(same, (-2, -1)), value, some)
        return nan_unless(sound & jnp.any(same, (-2, -1)), value)

    def _completed(self) -> Float[Array, "n m 4"]:
        """Value, both slopes and the mixed derivative at each node, as the scheme wants them."""
        f, known = self.data[..., 0], self.data.shape[-1]
        if self.scheme == "bicubic":
            fx, fy = self._d_dx(f), self._d_dy(f)
            return jnp.stack([f, fx, fy, 0.5 * (self._d_dy(fx) + self._d_dx(fy))], -1)
        zero = jnp.zeros_like(f)
        if known == 1:
            return jnp.stack([f, zero, zero, zero], -1)
        _, fx, fy = (self.data[..., k] for k in range(3))
        fxy = zero
        if self.scheme == "hermite":
            differences = 0.5 * (self._d_dy(fx) + self._d_dx(fy)) if known == 3 else zero
            fxy = self.data[..., 3] if known == 4 else differences
        return jnp.stack([f, fx, fy, fxy], -1)

    def _d_dx(self, f: Float[Array, "n m"]) -> Float[Array, "n m"]:
        return _slopes(self.x, f, self.labels)

    def _d_dy(self, f: Float[Array, "n m"]) -> Float[Array, "n m"]:
        labels = None if self.labels is None else self.labels.T
        return _slopes(self.y, f.T, labels).T


# --- one cell ------------------------------------------------------------------------------------


def _combined(scheme: str, s: Array, t: Array, corners: Float[Array, "... 2 2 4"]) -> Array:
    """The value at (s, t) of the unit cell; derivatives at its corners are per cell."""
    everything = jnp.ones(corners.shape[:-1], bool)
    match scheme:
        case "bilinear":
            return _tensor(hermite_basis(s, 1), hermite_basis(t, 1), corners)
        case "bicubic" | "hermite" | "hermite, no twist":
            return _tensor(hermite_basis(s, 2), hermite_basis(t, 2), corners)
        case "serendipity":
            across, up = (hermite_basis(a, 1) for a in (s, t))
            cubic = _tensor(hermite_basis(s, 2), up, corners)
            cubic = cubic + _tensor(across, hermite_basis(t, 2), corners)
            return cubic - _tensor(across, up, corners)
        case "bezier" | "extrapolated":
            reach = 0.5 if scheme == "bezier" else 1.0
            ahead = _extrapolated(s, t, corners, reach)[..., None]
            return _tensor(hermite_basis(s, 1), hermite_basis(t, 1), ahead)
    return _inverse_distance(s, t, corners, everything)


def _tensor(across: Array, up: Array, corners: Float[Array, "... 2 2 c"]) -> Array:
    """`sum across[i, k] up[j, l] d^k/dx^k d^l/dy^l f(corner i j)`."""
    k, m = across.shape[-1], up.shape[-1]
    # Columns are f, f_x, f_y, f_xy: the index is k + 2 l.
    wanted = jnp.stack([corners[..., a + 2 * b] for a in range(k) for b in range(m)], -1)
    weights = across[..., :, None, :, None] * up[..., None, :, None, :]
    weights = weights.reshape(*weights.shape[:-2], k * m)
    return jnp.sum(weights * wanted, (-3, -2, -1))


def _offsets(s: Array, t: Array) -> tuple[Array, Array]:
    """Offsets from each corner to (s, t), shape (..., 2, 2) each."""
    ds = jnp.stack([s, s - 1.0], -1)[..., :, None]
    dt = jnp.stack([t, t - 1.0], -1)[..., None, :]
    ds, dt = jnp.broadcast_arrays(ds, dt)
    return ds, dt


def _extrapolated(s: Array, t: Array, corners: Float[Array, "... 2 2 4"], reach: float) -> Array:
    """Extrapolation from corners to (s, t): the value, plus `reach` of the gradient's term."""
    ds, dt = _offsets(s, t)
    return corners[..., 0] + reach * (corners[..., 1] * ds + corners[..., 2] * dt)


def _inverse_distance(
    s: Array, t: Array, corners: Float[Array, "... 2 2 4"], same: Bool[Array, "... 2 2"]
) -> Array:
    """Mean of the corners' extrapolations, weighted by the inverse of their distances in cells."""
    ds, dt = _offsets(s, t)
    tiny = jnp.finfo(ds.dtype).eps
    # Only ratios count: scaled so that the weights stay finite on a corner.
    weight = jnp.where(same, 1.0 / jnp.sqrt(ds * ds + dt * dt + tiny * tiny), 0.0)
    total = jnp.sum(weight, (-2, -1))
    ahead = jnp.sum(weight * _extrapolated(s, t, corners, 1.0), (-2, -1))
    return ahead / jnp.where(total > 0.0, total, 1.0)


# --- the grid ------------------------------------------------------------------------------------


def _within(nodes: Array, x: Array) -> Array:
    """Mask of places between the ends, rounding included."""
    slack = 8.0 * jnp.finfo(nodes.dtype).eps * jnp.maximum(jnp.abs(nodes[0]), jnp.abs(nodes[-1]))
    return (x >= nodes[0] - slack) & (x <= nodes[-1] + slack)


def _slopes(
    x: Float[Array, " n"], f: Float[Array, "n m"], labels: Int[Array, "n m"] | None
) -> Float[Array, "n m"]:
    """Slopes along the first axis: of parabolas through a node and two others of its label.

    Its two neighbours, else two on one side; a line to one neighbour where there is no third node,
    and zero where there is none.
    """
    n = x.shape[0]
    here = np.arange(n)
    step, known, slope = {}, {}, {}
    for k in (-2, -1, 1, 2):
        there = np.clip(here + k, 0, n - 1)
        exists = np.broadcast_to((here + k == there)[:, None], f.shape)
        known[k] = jnp.asarray(exists)
        if labels is not None:
            known[k] = known[k] & (labels[there] == labels)
        step[k] = jnp.where(here + k == there, x[there] - x, float(k))[:, None]
        slope[k] = (f[there] - f) / step[k]

    def parabola(a: int, b: int) -> Array:
        """Through the node and two others: slopes of chords, weighted by the other's distance."""
        apart = step[b] - step[a]
        return (step[b] * slope[a] - step[a] * slope[b]) / jnp.where(apart == 0.0, 1.0, apart)

    # From what is liked least to what is liked best.
    out = jnp.zeros_like(f)
    for k in (-1, 1):
        out = jnp.where(known[k], slope[k], out)
        out = jnp.where(known[k] & known[2 * k], parabola(k, 2 * k), out)
    return jnp.where(known[-1] & known[1], parabola(-1, 1), out)
