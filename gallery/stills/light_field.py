"""A woven light field, and the wedge that its depths leave in the spectrum.

Left: what a line of flatland sees, place across and slope upwards; each disc is a ribbon whose lean
is its distance. Right: the spectrum of the same field; all of it lies between the two lines that
the nearest and the farthest disc allow, the wedge on which sheared filters rest.
"""

from __future__ import annotations

import jax.numpy as jnp
import matplotlib
import numpy as np

from firstorder.conventions import FLATLAND_SLOPE
from firstorder.flatland import Circles, Receiver, Scene, light_field, primitive
from gallery.frame import Frame, developed, drawn

NEAR, FAR, COUNT = 2.0, 10.0, 70


def scene() -> Scene:
    """Discs that glow in many colours between two depths."""
    random = np.random.default_rng(11)
    y = np.exp(np.linspace(np.log(NEAR), np.log(FAR), COUNT))
    x = random.uniform(-1.0, 1.0, COUNT) * (1.2 + 0.75 * y)
    r = random.uniform(0.04, 0.16, COUNT) * y / 3.0
    glow = matplotlib.colormaps["twilight_shifted"](random.uniform(0.1, 0.9, COUNT))[:, :3] ** 3.4
    glow = glow * random.uniform(0.3, 2.0, COUNT)[:, None] * 1.6
    return Scene.of(
        *(primitive(Circles(c, s), emission=g) for c, s, g in zip(np.stack([x, y], -1), r, glow,
                                                                  strict=True))
    )  # fmt: skip


def still(frame: Frame):
    world = scene()
    share = 0.62
    half_x, half_v = 2.2, 1.0
    bands = [light_field(world.band(k), Receiver((0.0, 0.0), 0.0), frame=FLATLAND_SLOPE)
             for k in range(3)]  # fmt: skip
    ground = jnp.array([0.012, 0.02, 0.05])

    def at(place):
        x = half_x * place[0]
        L = jnp.stack([field(x, half_v * place[1]) for field in bands])
        return jnp.where(jnp.sum(L) > 0.0, L, ground)

    whole = Frame(int(frame.width * share), frame.height, frame.folder, frame.key)
    field = whole.field(at, (-1.0, 1.0, -1.0, 1.0))
    picture, spectrum, lines = developed(field, 0.8), _spectrum(field), _wedge(half_x, half_v)

    ax = frame.canvas(None, (0.0, 1.0, 0.0, 1.0), "#05070d")
    left = ax.figure.add_axes((0.0, 0.0, share, 1.0))
    left.imshow(picture, extent=(-half_x, half_x, -half_v, half_v), aspect="auto", origin="upper",
                interpolation="bilinear")  # fmt: skip
    left.set_axis_off()
    right = ax.figure.add_axes((share + 0.012, 0.0, 1.0 - share - 0.012, 1.0))
    right.imshow(spectrum, cmap="magma", extent=(-1, 1, -1, 1), aspect="auto", origin="lower",
                 vmin=-3.6, vmax=-0.2, interpolation="bilinear")  # fmt: skip
    for slope in lines:
        right.plot([-1, 1], [-slope, slope], "-", color="#8fd3ff", linewidth=2.5 * frame.fine)
    right.set(xlim=(-1, 1), ylim=(-1, 1))
    right.set_axis_off()
    words = dict(color="white", fontsize=15 * frame.fine / 0.6, alpha=0.9)
    left.text(0.975, 0.03, "light field: place →, slope ↑", transform=left.transAxes, ha="right",
              **words)  # fmt: skip
    right.text(0.03, 0.03, "its spectrum, and the wedge", transform=right.transAxes, **words)
    return drawn(ax)


BAND = 14.0  # cycles per metre, and as many per unit of slope times the middle distance
MIDDLE = np.sqrt(NEAR * FAR)


def _spectrum(field: np.ndarray) -> np.ndarray:
    """Magnitude by powers of ten, shape (Omega_v, Omega_x), of the mean of the bands."""
    L = field.mean(-1)
    w, h = L.shape
    window = np.hanning(w)[:, None] * np.hanning(h)
    L = (L - np.sum(L * window) / np.sum(window)) * window
    F = np.abs(np.fft.fftshift(np.fft.fft2(L, (2 * w, 2 * h))))
    steps = 4.4 / w, 2.0 / h  # of x and of v
    Omega = [np.fft.fftshift(np.fft.fftfreq(2 * n, d)) for n, d in zip((w, h), steps, strict=True)]
    keep = [np.abs(o) <= b for o, b in zip(Omega, (BAND, BAND * MIDDLE), strict=True)]
    F = F[np.ix_(*keep)].T
    return np.log10(F / F.max() + 1e-9)


def _wedge(half_x, half_v) -> tuple[float, float]:
    """Slopes of the wedge's sides in the picture: Omega_v = d Omega_x for the distance d.

    A point at the distance d is seen from x at the slope v = (x - a) / d, so that its field varies
    along (d, 1) alone and not along it across: frequencies are along (1, -d).
    """
    return -NEAR / MIDDLE, -FAR / MIDDLE
