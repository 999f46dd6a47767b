"""D05 Fig. 13: longitudes and latitudes about whichever equator a step of the shading needs.

The paper's drawing is lost but for the text that cites it: (b) the equator in the plane of
incidence, which holds the normal and the mirrored direction too; (c) the equator through the
mirrored and the outgoing direction; (a), here, axes that know of neither. Ours: light from 50
degrees off the normal, an outgoing direction 25 degrees from the mirrored one, across the plane of
incidence.

Measured beside it, on rings about a ray on both equators: how far a plane rotation of the angles is
off the rotation of the sphere between b and c, and how far differences of angles are off the angle
between a mirrored and an outgoing ray. "To a first-order approximation" means errors of the second
power of the distance: the differences have them, the rotation even the third, for the equator is a
line of symmetry.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import SPACE
from firstorder.laws import Move
from firstorder.transport.chain4d._equator import Turn, equator_angles, equator_direction

INCIDENCE, AZIMUTH, APART = np.deg2rad((50.0, 35.0, 25.0))
RADII = np.geomspace(0.02, 0.5, 12)
LOOK = np.array([0.25, -1.0, 0.75])  # from where the spheres are drawn


def draw(quick: bool) -> Drawing:
    n = 32 if quick else 128
    named, frames = _directions(), _frames()
    rotation = _rotation_errors(frames, n)
    apart = {k: _difference_errors(frames[k], named, n) for k in ("b", "c")}

    figure, axes = plotting.panels(1, 4, 3.5, 3.3)
    titles = ("a) axes of the surface", "b) equator: plane of incidence",
              "c) equator: mirrored and outgoing")  # fmt: skip
    for ax, (k, frame), title in zip(axes[0], frames.items(), titles, strict=False):
        _sphere(ax, frame, named, title)
        assert k
    ax = axes[0, 3]
    ax.loglog(RADII, rotation, "o-", markersize=3, label="plane rotation, b to c")
    ax.loglog(RADII, apart["c"], "s-", markersize=3, label="differences, equator c")
    ax.loglog(RADII, apart["b"], "^-", markersize=3, label="differences, equator b")
    ax.loglog(RADII, 0.1 * RADII**3, "k:", linewidth=0.8, label="third power")
    ax.set(title="d) largest error", xlabel="distance from the ray (rad)", ylabel="rad")
    ax.set_xticks([0.02, 0.1, 0.5], ["0.02", "0.1", "0.5"])
    ax.xaxis.minorticks_off()
    ax.legend(fontsize=6.5)
    curves = {"errors": {"radius": RADII, "rotation": rotation,
                         **{f"differences {k}": v for k, v in apart.items()}}}  # fmt: skip
    arrays = {"frames": np.stack(list(frames.values())), **named}
    claims = _claims(frames, named, rotation, apart)
    return Drawing(figure, arrays, claims, curves, f"{n} rays on each of {len(RADII)} rings")


def _directions() -> dict[str, np.ndarray]:
    """Unit vectors of the four neighbourhoods that meet in a reflection."""
    c, s = np.cos(AZIMUTH), np.sin(AZIMUTH)
    light = np.array([np.sin(INCIDENCE) * c, np.sin(INCIDENCE) * s, np.cos(INCIDENCE)])
    mirrored = light * (-1.0, -1.0, 1.0)
    across = np.array([s, -c, 0.0])
    out = np.cos(APART) * mirrored + np.sin(APART) * across
    return {"light": light, "normal": np.array([0.0, 0.0, 1.0]), "mirrored": mirrored,
            "outgoing": out}  # fmt: skip


def _frames() -> dict[str, np.ndarray]:
    """Axes (t, b, n) as columns; the equator runs through t and n."""
    named = _directions()
    return {
        "a": np.eye(3),
        "b": _axes(named["normal"], named["light"]),
        "c": _axes(named["mirrored"], named["outgoing"]),
    }


def _axes(middle: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Axes whose third is in the middle, and whose equator runs through both."""
    t = other - (other @ middle) * middle
    t = t / np.linalg.norm(t)
    return np.stack([t, np.cross(middle, t), middle], 1)


def _angles(frame: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Longitude and latitude of directions of the world."""
    return np.stack(equator_angles(jnp.asarray(w @ frame)), -1)


def _rings(n: int) -> np.ndarray:
    """Offsets of angles on rings, shape (radii, n, 2)."""
    t = 2.0 * np.pi * np.arange(n) / n
    return RADII[:, None, None] * np.stack([np.cos(t), np.sin(t)], -1)


def _rotation_errors(frames, n: int) -> np.ndarray:
    """On each ring: the rotation between two equators against its first order, a plane rotation."""
    R = jnp.asarray(frames["b"].T @ frames["c"])  # both hold the mirrored direction, at 0 in c
    move = Turn(R, at=jnp.zeros(())).law(SPACE)
    assert isinstance(move, Move)
    rings = _rings(n)
    w = np.asarray(equator_direction(*(jnp.asarray(a) for a in np.moveaxis(rings, -1, 0))))
    exact = np.stack(equator_angles(jnp.asarray(w @ np.asarray(R).T)), -1)
    M, c = (np.asarray(a) for a in (move.M, move.c))
    return np.max(np.linalg.norm(rings @ M[2:, 2:].T + c[2:] - exact, axis=-1), 1)


def _difference_errors(frame, named, n: int) -> np.ndarray:
    """On each ring about the mirrored ray: length of the angles' differences against the angle."""
    middle = _angles(frame, named["mirrored"])
    out = _angles(frame, named["outgoing"])
    errors = []
    for ring in _rings(n):  # pairs: a ray near the mirrored one, and one near the outgoing one
        near, far = middle + ring, out - ring
        w, v = (np.asarray(equator_direction(*(jnp.asarray(a) for a in u.T))) for u in (near, far))
        angle = np.arctan2(np.linalg.norm(np.cross(w, v), axis=-1), np.sum(w * v, -1))
        errors.append(np.max(abs(np.linalg.norm(near - far, axis=-1) - angle)))
    return np.array(errors)


# --- drawing -------------------------------------------------------------------------------------


def _sphere(ax, frame, named, title: str) -> None:
    """Lines of longitude and latitude every 15 degrees, the equator thick, and the directions."""
    look = LOOK / np.linalg.norm(LOOK)
    right = np.cross((0.0, 0.0, 1.0), look)
    right = right / np.linalg.norm(right)
    plane = np.stack([right, np.cross(look, right)], 1)
    full, half = np.linspace(-np.pi, np.pi, 361), np.linspace(-0.5 * np.pi, 0.5 * np.pi, 181)
    lines = [(full, 0.0 * full + a, a == 0.0) for a in np.deg2rad(np.arange(-75.0, 76.0, 15.0))]
    lines += [(0.0 * half + a, half, False) for a in np.deg2rad(np.arange(-180.0, 180.0, 15.0))]
    for theta, phi, equator in lines:
        local = np.asarray(equator_direction(jnp.asarray(theta), jnp.asarray(phi)))
        w = local @ frame.T
        p = np.where((w @ look > 0.0)[:, None], w @ plane, np.nan)
        style = dict(color="0.1", linewidth=1.8) if equator else dict(color="0.75", linewidth=0.5)
        ax.plot(*p.T, linestyle="-", **style)
    for k, (name, w) in enumerate(named.items()):
        x, y = w @ plane
        ax.plot(x, y, "o", color=plotting.COLOURS[1 + k], markersize=5)
        ax.annotate(name, (x, y), (4, 5), textcoords="offset points", fontsize=7)
    ax.set(title=title, xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), aspect="equal", xticks=[],
           yticks=[])  # fmt: skip
    for side in ax.spines.values():
        side.set_visible(False)


def _claims(frames, named, rotation, apart) -> list[Claim]:
    latitude = {
        k: {name: float(abs(_angles(f, w)[1])) for name, w in named.items()}
        for k, f in frames.items()
    }
    off = {k: max(v.values()) for k, v in latitude.items()}
    order = float(fitted_order(RADII[:6], rotation[:6]))
    at = int(np.argmin(abs(RADII - 0.1)))
    needs = max(latitude["b"][k] for k in ("light", "normal", "mirrored"))
    return [
        Claim("Four directions on one equator: farthest off, on a, b and c", "cannot be, in "
              "general", ", ".join(f"{v:.2f}" for v in off.values()), "rad",
              min(off.values()) > 0.1),
        Claim("Light, normal and mirrored direction off the equator of b", "near it", needs, "rad",
              needs < 1e-12),
        Claim("Mirrored and outgoing direction off the equator of c", "near it",
              max(latitude["c"]["mirrored"], latitude["c"]["outgoing"]), "rad",
              max(latitude["c"]["mirrored"], latitude["c"]["outgoing"]) < 1e-12),
        Claim("Order of what a plane rotation of the angles misses",
              "correct to first order, so 2 or more", order, "", order > 1.9),
        Claim("Plane rotation: largest error about 0.1 rad and 0.5 rad from the ray", None,
              f"{rotation[at]:.1e}, {rotation[-1]:.1e}", "rad"),
        Claim("Differences of angles for the angle between rays, about 0.1 rad: equator b over c",
              "approximated on c", float(apart["b"][at] / apart["c"][at]), "times",
              bool(apart["c"][at] < apart["b"][at])),
    ]  # fmt: skip
