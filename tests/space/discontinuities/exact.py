"""Exact derivatives of irradiance beside events on a line, where a line crosses a mesh, and where
the outline of a cylinder turns at the edge of another shape.
"""

import jax
import jax.numpy as jnp
import numpy as np

from firstorder.numerics import host_blocks
from firstorder.space import Receiver, irradiance, occluded
from firstorder.space.discontinuities import visual_events_along

START, WAY, REACH = np.array([-2.0, 0.03, 0.0]), np.array([1.0, 0.07, 0.0]), 4.0
TOUCH, PLANE = "outlines that touch", "two edges in a plane"
ROOT = np.array([-0.5, 0.0, 0.5, 1.0])  # powers of the distance in E'' where outlines touch
JUMP = np.array([0.0, 1.0, 2.0, 3.0])  # and elsewhere
SLOPE = np.array([0.0, 0.5, 1.0, 1.5])  # and in E', where E'' may grow like one over a root


def found(scene, start=START, way=WAY, reach=REACH, **options):
    return visual_events_along(scene, Receiver.at(start), along=way, reach=reach, **options)


@jax.jit
def _derivatives(scene, way, t):
    def slope(t):
        return jax.grad(lambda t: irradiance(scene, Receiver.at(jnp.asarray(START) + t * way)))(t)

    return jax.vmap(lambda t: jax.jvp(slope, (t,), (jnp.ones_like(t),)))(t)


def derivatives(scene, t, way=WAY):
    """Exact first and second derivatives along the line, by one program for all numbers of places.

    It takes much longer to compile than to run.
    """
    way = way / np.linalg.norm(way)
    return host_blocks(lambda t: _derivatives(scene, way, t), np.asarray(t), 64)


def beside(scene, table, powers, order=2, way=WAY, others=()):
    """Leading coefficients of a derivative before and after each event, by powers of distance.

    Within a hundredth of the way to the next event, or to any other place.
    """
    near = [np.append(np.delete(table.x, i), others) - x for i, x in enumerate(table.x)]
    reach = [min(2e-6, 0.01 * np.min(np.abs(each), initial=np.inf)) for each in near]
    return beside_places(scene, table.x, powers, np.array(reach), order, way)


def beside_places(scene, x, powers, reach, order=2, way=WAY):
    """The same beside places, within four times some distances."""
    s = np.broadcast_to(reach, x.shape)[:, None] * np.array([0.5, 1.0, 2.0, 4.0])
    t = np.stack([x[:, None] - s, x[:, None] + s])
    values = derivatives(scene, t.ravel(), way)[order - 1].reshape(*t.shape, 1)
    return [np.linalg.solve(s[..., None] ** powers, side)[:, 0, 0] for side in values]


def left_over(scene, table, step=5e-4, away_from_events=1e-2, others=()):
    """The largest change, from sample to sample, of E'' without jumps and roots of a table.

    A jump that the table does not have leaves itself here, unless it is at one of other places.
    """
    t = np.arange(0.0, REACH, step)
    away = t[:, None] - table.x
    roots = np.where(away > 0.0, table.root_after, table.root_before)
    rest = derivatives(scene, t)[1] - np.sum((away > 0.0) * table.jump_E2, axis=1)
    rest = rest - np.sum(roots / np.sqrt(np.abs(away)), axis=1)
    places = np.append(table.x, others)
    far = np.min(np.abs(t[1:-1, None] - places), axis=1, initial=np.inf) > away_from_events
    return np.max(np.abs(np.diff(rest, 2))[far])


def turns(start, end, radius, others):
    """Where, as the wall of a cylinder meets its rims, edges of other shapes are seen."""
    axis = (end - start) / np.linalg.norm(end - start)
    b = np.cross(axis, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(axis, [0.0, 0.0, 1.0]))
    frame = np.stack([b, np.cross(axis, b)])

    def hidden(t):
        eye = START + t[:, None] * WAY / np.linalg.norm(WAY)
        x, y = ((eye - start) @ frame.T).T
        half = np.arccos(radius / np.hypot(x, y))
        about = np.arctan2(y, x) + np.stack([half, -half])
        foot = radius * np.stack([np.cos(about), np.sin(about)], -1) @ frame
        seen = np.concatenate([start + foot, end + foot])  # the four places, for each eye
        rows = np.broadcast_to(eye, seen.shape).reshape(-1, 3), seen.reshape(-1, 3)
        return np.asarray(occluded(others, *rows)).reshape(seen.shape[:2])

    t = np.linspace(0.0, REACH, 4001)
    of, cell = np.nonzero(np.diff(hidden(t), axis=1))
    low, high = t[cell], t[cell + 1]
    before = hidden(low)[of, np.arange(len(of))]
    for _ in range(50):
        middle = 0.5 * (low + high)
        same = hidden(middle)[of, np.arange(len(of))] == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low


def told(table):
    """Sizes of what a table says of the lowest derivative that jumps."""
    second = table.jump_E2 + table.root_before + table.root_after
    return np.abs(np.where(table.kind == PLANE, table.jump_E1, second))


def crossings(mesh, kind, start=START):
    """Where the line crosses pieces of a mesh of one kind, and what they say of it there."""
    way = WAY[:2] / np.linalg.norm(WAY)
    across, hits = np.array([-way[1], way[0]]), []
    for number in np.flatnonzero(mesh.kind == kind):
        line, jumps = mesh.lines[number], mesh.jumps[number]
        off, along = ((line[:, :2] - start[:2]) @ v for v in (across, way))
        for k in np.flatnonzero(off[1:] * off[:-1] < 0.0):
            x = along[k] + off[k] / (off[k] - off[k + 1]) * (along[k + 1] - along[k])
            step = line[k + 1, :2] - line[k, :2]
            sine = abs(step @ across) / np.linalg.norm(step)  # of the line with the piece
            power = 1.5 if kind == TOUCH else mesh.order[number]
            share = off[k] / (off[k] - off[k + 1])
            hits.append((x, (jumps[k] + share * (jumps[k + 1] - jumps[k])) * sine**power))
    return np.array(sorted(hits)).reshape(-1, 2).T
