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

from figures.d05.shared.readings import EQUAL, equal
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least
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
    named = _directions()
    frames = _frames(named)
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
    claims = _claims(frames, named, rotation, apart, n)
    return Drawing(figure, arrays, claims, curves, f"{n} rays on each of {len(RADII)} rings")


def _directions(incidence=INCIDENCE, apart=APART) -> dict[str, np.ndarray]:
    """Unit vectors of the four neighbourhoods that meet in a reflection."""
    c, s = np.cos(AZIMUTH), np.sin(AZIMUTH)
    light = np.array([np.sin(incidence) * c, np.sin(incidence) * s, np.cos(incidence)])
    mirrored = light * (-1.0, -1.0, 1.0)
    across = np.array([s, -c, 0.0])
    out = np.cos(apart) * mirrored + np.sin(apart) * across
    return {"light": light, "normal": np.array([0.0, 0.0, 1.0]), "mirrored": mirrored,
            "outgoing": out}  # fmt: skip


def _frames(named) -> dict[str, np.ndarray]:
    """Axes (t, b, n) as columns; the equator runs through t and n."""
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


def _claims(frames, named, rotation, apart, n: int) -> list[Statement | Measurement]:
    latitude = {
        k: {name: float(abs(_angles(f, w)[1])) for name, w in named.items()}
        for k, f in frames.items()
    }
    order = float(fitted_order(RADII[:6], rotation[:6]))
    straight = float(fitted_order(RADII[:6], apart["c"][:6]))
    at = int(np.argmin(abs(RADII - 0.1)))
    on_b = max(latitude["b"][k] for k in ("light", "normal", "mirrored"))
    on_c = max(latitude["c"][k] for k in ("mirrored", "outgoing"))
    first = at_least(2.0 - 0.1, "'to first order': errors of the second power, fitted to a tenth")
    scanned = "outgoing directions 5 to 60 degrees off the mirrored one, light at 10 to 80"
    turns = f"{len(TRIED)} pairs of light and outgoing direction, all over the hemisphere"
    return [
        Statement("In general no equator lies near all four directions: share of reflections whose "
                  "best one is farther than 0.1 rad off", "in general", _no_equator(0.1),
                  at_least(0.5, "'in general': more often than not"), "D05 §5.2", scanned=turns),
        Statement("The equator of (b) lies near light, normal and mirrored direction: farthest off",
                  "near", on_b, equal(), "D05 §5.2 Fig. 13 (b)", "rad"),
        Statement("The equator of (c) lies near mirrored and outgoing direction: farthest off",
                  "near", on_c, equal(), "D05 §5.2 Fig. 13 (c)", "rad"),
        Statement("A rotation about an axis on the equator is a plane rotation of the angles to "
                  "first order: power of what that misses", "first order", order, first,
                  "D05 §5.2"),
        Measurement("... largest error about 0.1 rad from the ray", rotation[at], "rad"),
        Measurement("... about 0.5 rad", rotation[-1], "rad"),
        Statement("On (c) the angle between mirrored and outgoing rays is approximated by "
                  "differences: power of what these miss", "approximated", straight, first,
                  "D05 §5.2"),
        Statement("... share of reflections where (c) misses less than (b), 0.1 rad off", "(c)",
                  _better_on_c(n, at), at_least(1.0, "all"), "D05 §5.2", scanned=scanned),
    ]  # fmt: skip


TRIED = np.random.default_rng(0).uniform(size=(1000, 3))
POLES = 160_000


def _no_equator(limit: float) -> float:
    """Share of reflections of which no great circle is that near to all four directions."""
    height, turn, out = TRIED.T
    around = 2.0 * np.pi * turn
    light = np.stack([np.sqrt(1.0 - height**2), 0.0 * height, height], -1)
    flat = np.sqrt(1.0 - out**2)
    leaves = np.stack([flat * np.cos(around), flat * np.sin(around), out], -1)
    normal = np.broadcast_to([0.0, 0.0, 1.0], light.shape)
    four = np.stack([light, normal, light * (-1.0, 1.0, 1.0), leaves], 1)
    k = np.arange(POLES) + 0.5  # evenly over the half sphere, 0.006 rad apart
    up, phi = k / POLES, np.pi * (1.0 + 5.0**0.5) * k
    poles = np.stack([np.sqrt(1 - up**2) * np.cos(phi), np.sqrt(1 - up**2) * np.sin(phi), up])
    best = [np.min(np.max(abs(w @ poles), 0)) for w in four]
    return float(np.mean(np.arcsin(best) > limit))


def _better_on_c(n: int, at: int) -> float:
    """Share of reflections where differences of angles miss less on equator c than on b."""
    found = []
    for apart in np.deg2rad((5.0, 15.0, 30.0, 45.0, 60.0)):
        for incidence in np.deg2rad((10.0, 30.0, 50.0, 65.0, 80.0)):
            named = _directions(incidence, apart)
            frames = _frames(named)
            b, c = (_difference_errors(frames[k], named, n)[at] for k in ("b", "c"))
            found.append(c < b + EQUAL)
    return float(np.mean(found))
