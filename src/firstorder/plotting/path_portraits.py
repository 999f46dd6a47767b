"""A path at a glance: its steps from left to right, their portraits from top to bottom."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from firstorder._labelled import UNITS, Dataset, Variable, data_set
from firstorder.errors import Refused
from firstorder.fields import Field, Grid, discrete_transform
from firstorder.plotting.light import show_light_field, show_spectrum
from firstorder.plotting.overlays import covariance_ellipse
from firstorder.plotting.style import label, panels, share_labels

ROWS = ("value", "gradient", "spectrum")


@dataclasses.dataclass(frozen=True)
class Portraits:
    """The portraits of one light field, as arrays.

    Attributes:
        title: what the step is called.
        names: names of its coordinates.
        x: sample positions [m].
        theta: sample directions [rad, or slopes].
        Omega_x: frequencies of the spectrum.
        Omega_theta: frequencies of the spectrum.
        value: radiance, shape (len(x), len(theta)).
        gradient: derivatives along both coordinates, shape (len(x), len(theta), 2).
        spectrum: complex, shape (len(Omega_x), len(Omega_theta)).
        covariance: of the power spectrum, or None where the field has none.
        sampled: whether the spectrum is a transform of the samples, for want of a closed form.
    """

    title: str
    names: tuple[str, str]
    x: np.ndarray
    theta: np.ndarray
    Omega_x: np.ndarray
    Omega_theta: np.ndarray
    value: np.ndarray
    gradient: np.ndarray
    spectrum: np.ndarray
    covariance: np.ndarray | None
    sampled: bool

    def to_xarray(self, unit: str = "L") -> Dataset:
        """A data set over the two coordinates and their frequencies, `Omega_x` and so on.

        The gradient has an axis `along`, the covariance `along` and `along_2`; `attrs` hold the
        title, and whether the spectrum was sampled.

        Args:
            unit: of the radiance.

        Raises:
            ModuleNotFoundError: without the extra `tables`.
        """
        first, second = self.names
        light, waves = (first, second), (f"Omega_{first}", f"Omega_{second}")
        lengths = [UNITS.get(name, "1") for name in light]
        area = " ".join(length for length in lengths if length != "1")
        variables: dict[str, Variable] = {
            "value": (light, self.value, unit),
            "gradient": ((*light, "along"), self.gradient, f"{unit} per unit of the coordinate"),
            "spectrum": (waves, self.spectrum, f"{unit} {area}".strip()),
        }
        if self.covariance is not None:
            variables["covariance"] = (("along", "along_2"), self.covariance, "")
        values = (self.x, self.theta), (self.Omega_x, self.Omega_theta)
        coordinates: dict[str, Variable] = {
            name: ((name,), list(light), "") for name in ("along", "along_2")
        }
        for i, length in enumerate(lengths):
            coordinates[light[i]] = ((light[i],), values[0][i], length)
            cycles = "cycle" if length == "1" else f"cycle/{length}"
            coordinates[waves[i]] = ((waves[i],), values[1][i], cycles)
        return data_set(variables, coordinates, title=self.title, sampled=self.sampled)


@eqx.filter_jit
def _jets(field: Field, rays):
    jets = field.jets(*jnp.moveaxis(rays, -1, 0))
    return jets.value, jets.gradient


@eqx.filter_jit
def _spectrum(field: Field, Omega):
    return field.spectrum()(*Omega)


def portraits(title: str, field: Field, grid: Grid, Omega_x, Omega_theta) -> Portraits:
    """Draws every portrait of a light field in flatland.

    The spectrum in closed form where there is one; otherwise it is the discrete transform of the
    samples, which must then hold the field.

    Args:
        title: what the step is called.
        field: light over two coordinates.
        grid: where radiance and gradient are shown.
        Omega_x: frequencies of the spectrum across.
        Omega_theta: frequencies of the spectrum up.

    Raises:
        ValueError: if the field is not over two coordinates.

    Example:
        >>> import numpy as np
        >>> from firstorder.fields import Grid, gaussian
        >>> from firstorder.plotting import portraits
        >>> light = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> step = portraits("source", light, Grid((4, 4), (0.5, 0.5)), np.arange(3), np.arange(3))
        >>> step.gradient.shape, step.sampled
        ((4, 4, 2), False)
    """
    value, gradient = _jets(field, jnp.asarray(grid.points()))
    Omega_x, Omega_theta = np.asarray(Omega_x), np.asarray(Omega_theta)
    sampled = False
    try:
        mesh = np.meshgrid(Omega_x, Omega_theta, indexing="ij")
        F = _spectrum(field, [jnp.asarray(m) for m in mesh])
    except Refused:
        sampled = True
        F = discrete_transform(value, grid, Omega_x, Omega_theta)
    try:
        covariance = None if field.edges() else np.asarray(field.covariance().matrix)
    except Refused:
        covariance = None
    names = field.frame.coordinates[0], field.frame.coordinates[1]
    axes = grid.axis(0), grid.axis(1), Omega_x, Omega_theta
    arrays = np.asarray(value), np.asarray(gradient), np.asarray(F)
    return Portraits(title, names, *axes, *arrays, covariance, sampled)


def portrait_strip(
    steps: Sequence[Portraits],
    rows: Sequence[str] = ROWS,
    *,
    decades: float = 6.0,
    common: bool = True,
    width: float = 2.3,
    height: float = 2.1,
) -> Figure:
    """Draws steps from left to right and portraits from top to bottom.

    Args:
        steps: what `portraits` returned for each step.
        rows: of "value", "gradient" (along the position, then along the direction), "dx",
            "dtheta" and "spectrum" (with the covariance's ellipse).
        decades: dynamic range of the spectra.
        common: every row has one scale.
        width: of one panel, in inches.
        height: of one panel, in inches.

    Raises:
        ValueError: if a row is none of these.

    Example:
        >>> import numpy as np
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import Grid, gaussian
        >>> from firstorder.plotting import portrait_strip, portraits
        >>> light = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE)
        >>> step = portraits("source", light, Grid((4, 4), (0.5, 0.5)), np.arange(3), np.arange(3))
        >>> len(portrait_strip([step], ("value", "spectrum")).axes)
        2
    """
    rows = [r for row in rows for r in (("dx", "dtheta") if row == "gradient" else (row,))]
    figure, axes = panels(len(rows), len(steps), width, height)
    for axs, row in zip(axes, rows, strict=True):
        top = max(_most(_data(s, row)) for s in steps) if common else None
        for ax, step in zip(axs, steps, strict=True):
            _panel(ax, step, row, top, decades)
    for ax, step in zip(axes[0], steps, strict=True):
        ax.set_title(step.title, loc="left", fontweight="bold")
    share_labels(axes)
    return figure


def _most(data: np.ndarray) -> float:
    """Largest magnitude of what is a number."""
    return float(np.max(np.abs(data[np.isfinite(data)]), initial=0.0))


def _data(step: Portraits, row: str) -> np.ndarray:
    match row:
        case "value":
            return step.value
        case "dx":
            return step.gradient[..., 0]
        case "dtheta":
            return step.gradient[..., 1]
        case "spectrum":
            return step.spectrum
    raise ValueError(f"Argument `rows` must hold value, dx, dtheta or spectrum, but has {row!r}.")


def _panel(ax, step: Portraits, row: str, top: float | None, decades: float) -> None:
    data = _data(step, row)
    if row == "spectrum":
        show_spectrum(
            ax,
            data,
            step.Omega_x,
            step.Omega_theta,
            decades=decades,
            reference=top,
            names=step.names,
            title="spectrum (sampled)" if step.sampled else "spectrum",
        )
        if step.covariance is not None:
            covariance_ellipse(ax, step.covariance)
        return
    title = ""
    if row != "value":
        name = step.names[0 if row == "dx" else 1]
        title = rf"$\partial L / \partial {label(name, unit=False).strip('$')}$"
    show_light_field(
        ax,
        data,
        step.x,
        step.theta,
        signed=row != "value" or None,
        limit=top,
        names=step.names,
        title=title,
    )
