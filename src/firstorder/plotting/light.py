"""Light fields and spectra as pictures: position across, direction up, as the papers draw them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from firstorder._argument_checks import check_not_negative, check_positive, check_real
from firstorder.plotting._axes import label_axes
from firstorder.plotting.overlays import print_scale
from firstorder.plotting.style import MAGNITUDE, RADIANCE, SIGNED


def show_light_field(
    ax: Axes,
    values,
    x,
    theta,
    *,
    signed: bool | None = None,
    limit: float | None = None,
    names: tuple[str, str] = ("x", "theta"),
    title: str = "",
    equal: bool = False,
    scale: bool = True,
) -> AxesImage:
    """Shows samples of a light field, or of one of its derivatives.

    Signed data have symmetric limits and the diverging map; radiance runs from 0 up. Where there is
    no number the ground of the axes is seen.

    Args:
        ax: where to draw.
        values: samples, shape (len(x), len(theta)), as `Grid.sample` returns them.
        x: sample positions across, evenly spaced (metres).
        theta: sample positions up, evenly spaced (radians, or slopes).
        signed: whether zero is in the middle of the scale; left out, if any value is negative.
        limit: largest magnitude of the scale; left out, that of the data.
        names: names of the two coordinates, for the labels.
        title: written above.
        equal: one unit across is as long as one unit up.
        scale: print the scale at the upper right.

    Returns:
        The image; its `set_data(values.T)` redraws it.

    Raises:
        ValueError: if the samples do not have that shape.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import panels, show_light_field
        >>> figure, axes = panels()
        >>> image = show_light_field(axes[0, 0], np.eye(3) - 0.5, np.arange(3), np.arange(3))
        >>> image.get_clim()
        (-0.5, 0.5)
    """
    values = _checked(values, x, theta)
    check_real("values", values)
    values = values.astype(float)
    known = values[np.isfinite(values)]
    signed = bool(np.any(known < 0)) if signed is None else signed
    if limit is not None:
        check_not_negative("limit", limit)
    top = float(np.max(np.abs(known), initial=0.0)) if limit is None else float(limit)
    top = top if top > 0 else 1.0
    image = _image(ax, values, x, theta, equal)
    image.set_cmap(SIGNED if signed else RADIANCE)
    image.set_clim(-top if signed else 0.0, top)
    label_axes(ax, names)
    ax.set_title(title, loc="left")
    if scale:
        print_scale(ax, f"±{top:.3g}" if signed else f"0 to {top:.3g}")
    return image


def show_spectrum(
    ax: Axes,
    F,
    Omega_x,
    Omega_theta,
    *,
    decades: float = 6.0,
    reference: float | None = None,
    names: tuple[str, str] = ("x", "theta"),
    title: str = "",
    equal: bool = False,
    scale: bool = True,
) -> AxesImage:
    """Shows the magnitude of a spectrum on a logarithmic scale of stated range.

    Args:
        ax: where to draw.
        F: spectral densities, shape (len(Omega_x), len(Omega_theta)); complex, or magnitudes.
        Omega_x: frequencies across, evenly spaced (cycles per metre).
        Omega_theta: frequencies up, evenly spaced (cycles per radian).
        decades: dynamic range; what is fainter is drawn as faint as the range ends.
        reference: magnitude at the top of the scale; left out, the largest one.
        names: names of the two coordinates, for the labels.
        title: written above.
        equal: one unit across is as long as one unit up.
        scale: print the scale at the upper right.

    Returns:
        The image, in powers of ten of the reference.

    Raises:
        ValueError: if the spectral densities do not have that shape.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import panels, show_spectrum
        >>> figure, axes = panels()
        >>> image = show_spectrum(axes[0, 0], np.eye(3), np.arange(3), np.arange(3), decades=4.0)
        >>> image.get_clim()
        (-4.0, 0.0)
    """
    magnitude = np.abs(_checked(F, Omega_x, Omega_theta))
    if reference is not None:
        check_not_negative("reference", reference)
    known = magnitude[np.isfinite(magnitude)]
    top = float(np.max(known, initial=0.0)) if reference is None else float(reference)
    top = top if top > 0 else 1.0
    image = _image(ax, log_magnitude(magnitude, top, decades), Omega_x, Omega_theta, equal)
    image.set_cmap(MAGNITUDE)
    image.set_clim(-decades, 0.0)
    label_axes(ax, names, spectrum=True)
    ax.set_title(title, loc="left")
    if scale:
        print_scale(ax, f"{top:.2g}, {decades:g} decades")
    return image


def log_magnitude(F, reference: float, decades: float) -> np.ndarray:
    """Decimal logarithm of |F| / reference, cut off below `-decades`.

    Args:
        F: an array, complex or of magnitudes.
        reference: magnitude of which the logarithm is 0.
        decades: below which it is cut off.

    Returns:
        An array of the shape of F.

    Raises:
        ValueError: if the reference or the decades are not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.plotting import log_magnitude
        >>> log_magnitude(np.array([10.0, 0.1, 0.0]), 10.0, 6.0).tolist()
        [0.0, -2.0, -6.0]
    """
    check_positive("reference", reference)
    check_positive("decades", decades)
    with np.errstate(over="ignore", divide="ignore"):
        return np.maximum(np.log10(np.abs(F) / reference), -decades)


def _checked(values, x, y) -> np.ndarray:
    values = np.asarray(values)
    if not values.size:
        raise ValueError(
            f"Argument `values` must hold at least one sample, but has shape {values.shape}."
        )
    if values.shape != (len(x), len(y)):
        raise ValueError(
            f"Argument `values` must have shape {(len(x), len(y))}, but has {values.shape}."
        )
    return values


def _image(ax: Axes, values: np.ndarray, x, y, equal: bool) -> AxesImage:
    """Image whose cells are centred on the samples."""
    return ax.imshow(
        values.T,
        origin="lower",
        extent=(*_ends(x), *_ends(y)),
        aspect="equal" if equal else "auto",
        interpolation="nearest",
    )


def _ends(samples) -> tuple[float, float]:
    samples = np.asarray(samples, dtype=float)
    half = 0.5 * (samples[-1] - samples[0]) / (len(samples) - 1) if len(samples) > 1 else 0.5
    return float(samples[0] - half), float(samples[-1] + half)
