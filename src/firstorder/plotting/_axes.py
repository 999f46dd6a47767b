"""Labels of axes from the names of coordinates."""

from __future__ import annotations

from matplotlib.axes import Axes

from firstorder.plotting.style import label


def label_axes(ax: Axes, names: tuple[str, str], spectrum: bool = False) -> None:
    """Puts the names of the two coordinates on the axes."""
    across, up = (f"Omega_{n}" if spectrum else n for n in names)
    ax.set_xlabel(label(across))
    ax.set_ylabel(label(up))
