"""E, E', E'' across shadow edges, and autodiff through the scene, against closed forms.

The oracle is written on the lamp's line and not on angles: shadows of blockers are cast on it by
similar triangles, and `E = L sum F(end) - F(start)` over its visible pieces, with
`F(X) = (X - x) / sqrt((X - x)^2 + H^2)`. Derivatives are differences in 60 digits. It shares no
code with the library.
"""

import functools
import importlib

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.conventions import direction
from firstorder.flatland import (
    Circles,
    ConstantSky,
    PointLights,
    Receiver,
    Scene,
    Segments,
    derivatives,
    irradiance,
    nearest,
    primitive,
    receiver,
)
from firstorder.flatland.library._scenes import scene_a, scene_b
from firstorder.visibility import (
    VisibilityEdges,
    bracket_edges,
    shading_derivatives,
    tangent_points,
)

# --- the oracle ----------------------------------------------------------------------------------


def cast_segment(x, a, b, h, H):
    """The interval of the lamp's line that a segment from (a, h) to (b, h) hides from (x, 0)."""
    return tuple(sorted(x + (p - x) * H / h for p in (a, b)))


def cast_disc(x, cx, cy, r, H):
    """The same for a disc: both tangents from (x, 0), by solving for their points of contact."""
    w = (cx - x, cy)
    square = w[0] ** 2 + w[1] ** 2
    D = mp.sqrt(square - r**2)
    out = []
    for side in (1, -1):
        u = (D * w[0] + side * r * w[1], D * w[1] - side * r * w[0])  # turned by asin(r / |w|)
        out.append(x + H * u[0] / u[1])
    return tuple(sorted(out))


def lit(x, lamp, H, shadows):
    """E from a lamp of radiance 1 on y = H past shadows on its line."""
    pieces, total = [tuple(lamp)], mp.mpf(0)
    for low, high in shadows:
        cut = [
            (max(s, a), min(t, b)) for s, t in pieces for a, b in ((-mp.inf, low), (high, mp.inf))
        ]
        pieces = [p for p in cut if p[1] > p[0]]
    for start, stop in pieces:
        total += sum(
            sign * (X - x) / mp.sqrt((X - x) ** 2 + H**2) for sign, X in ((1, stop), (-1, start))
        )
    return total


def in_scene(name):
    """E(x) of scene A or B."""
    lamp = (mp.mpf("-0.5"), mp.mpf("0.5"))

    def E(x):
        blocker = [cast_segment(x, mp.mpf("-0.2"), mp.mpf("0.2"), mp.mpf("0.5"), mp.mpf(1))]
        return lit(x, lamp, mp.mpf(1), blocker if name == "B" else [])

    return E


def jet_of(E, x, side=0):
    """Value and two derivatives by differences of sixth order in 60 digits; `side` for kinks."""
    with mp.workdps(60):
        x, h = mp.mpf(float(x)), mp.mpf(10) ** -17
        x = x + side * 4 * h  # all points on one side
        f = [E(x + k * h) for k in range(-3, 4)]
        first = (-f[0] + 9 * f[1] - 45 * f[2] + 45 * f[4] - 9 * f[5] + f[6]) / (60 * h)
        second = (2 * (f[0] + f[6]) - 27 * (f[1] + f[5]) + 270 * (f[2] + f[4]) - 490 * f[3]) / (
            180 * h**2
        )
        return [float(v) for v in (f[3], first, second)]


# --- scenes A and B along the floor --------------------------------------------------------------

SCENES = {"A": scene_a(), "B": scene_b()}
# In scene B an end of the shadow passes an end of the lamp where x + 2 (p - x) = l.
KINKS = (-0.9, -0.1, 0.1, 0.9)


@functools.cache
def floor(name):
    """E, E', E'' by the library at many places on the floor, compiled once."""

    @jax.jit
    @jax.vmap
    def jets(x):
        scene = SCENES[name]
        at = receiver(scene, scene.named("floor")[0], 0.5 + 0.5 * x)
        d = derivatives(irradiance, scene, at, freedoms=("x",))
        return jnp.stack([d.value, d.first, d.second])

    return lambda x: np.asarray(jets(jnp.asarray(x)))


@pytest.mark.parametrize("name", ["A", "B"])
def test_value_and_derivatives_along_the_floor(name):
    """To 1e-12 of each quantity's largest magnitude, in the penumbra and away from it."""
    x = np.linspace(-0.97, 0.97, 60)
    truth = np.array([jet_of(in_scene(name), t) for t in x])
    error = np.max(np.abs(floor(name)(x) - truth), 0) / np.max(np.abs(truth), 0)
    assert np.all(error < 1e-12), error
    if name == "B":  # the shadow is there
        assert np.max(np.abs(truth - [jet_of(in_scene("A"), t) for t in x])) > 0.1


def test_beside_a_kink_each_side_has_its_own_derivatives():
    places = np.array([[t - 1e-13, t + 1e-13] for t in KINKS])
    truth = np.array([[jet_of(in_scene("B"), x) for x in pair] for pair in places])
    error = np.abs(floor("B")(places.ravel()) - truth.reshape(-1, 3))
    assert np.all(error < 1e-12 * np.max(np.abs(truth), (0, 1)))
    # E does not jump; E' jumps by the rates of the two edges, cos / D each, that are in line.
    jumps = truth[:, 1] - truth[:, 0]
    assert np.all(np.abs(jumps[:, 0]) < 1e-12)
    # cos^2 (1 / D_b - 1 / D) with the blocker half way, D_b = D / 2.
    lamp_end = np.array([0.5, 0.5, -0.5, -0.5])
    predicted = np.array([-1, 1, 1, -1]) / np.hypot(lamp_end - KINKS, 1.0) ** 3
    np.testing.assert_allclose(jumps[:, 1], predicted, rtol=1e-11)


@pytest.mark.parametrize("x", KINKS)
def test_on_a_kink_the_answer_is_one_of_the_two(x):
    """Or one for each of two edges that are in line there; never NaN."""
    (found,) = floor("B")(np.array([x]))
    sides = np.array([jet_of(in_scene("B"), x, side) for side in (-1, 1)])
    assert np.all(np.isfinite(found))
    assert abs(found[0] - sides[0, 0]) < 1e-12
    low, high = np.sort(sides[:, 1])
    assert low - 1e-9 <= found[1] <= high + 1e-9


def test_a_turn_of_the_receiver():
    """Whole lamp in view and a part: E = int L cos(w - n), differentiated in n."""
    scene = SCENES["B"]

    @jax.jit
    def turned(x):
        d = derivatives(irradiance, scene, receiver(scene, 0, 0.5 + 0.5 * x), freedoms=("n",))
        return jnp.stack([d.value, d.first, d.second])

    for x in (-0.6, 0.05, 0.3):
        value, first, second = turned(x)
        # By parts: dE/dn = int L sin(w) dw over what is seen, d2E/dn2 = -E.
        blocker = cast_segment(x, -0.2, 0.2, 0.5, 1.0)
        ends = np.clip([-0.5, *blocker, 0.5], -0.5, 0.5)
        cosines = 1.0 / np.hypot(ends - x, 1.0)
        sines = np.sum((cosines[1::2] - cosines[::2]) * 1.0)
        assert abs(first - sines) < 1e-14
        assert abs(second + value) < 1e-14


# --- autodiff through every leaf -----------------------------------------------------------------

LEAVES = (
    "x",
    "seg a",
    "seg b",
    "seg h",
    "disc x",
    "disc y",
    "radius",
    "lamp a",
    "lamp b",
    "H",
    "L",
)
PLACES = {
    "disc and segment overlap": (0.1, -0.35, -0.1, 0.55, -0.05, 0.6, 0.11, -1.0, 0.75, 1.2, 1.3),
    "disc alone in the lamp": (0.2, -1.6, -1.3, 0.5, 0.1, 0.7, 0.08, -0.6, 0.9, 1.0, 0.7),
    "lamp's end in penumbra": (-0.4, 0.3, 0.6, 0.5, -0.1, 0.4, 0.15, -0.5, 0.5, 1.1, 1.0),
}


def built(p):
    """The scene of a vector of parameters."""
    _, a, b, h, cx, cy, r, l0, l1, H, L = p
    pair = lambda u, v: jnp.stack([u, v])  # noqa: E731
    lamp = primitive(Segments(pair(l1, H), pair(l0, H)), emission=L)
    return Scene.of(
        lamp, primitive(Segments(pair(a, h), pair(b, h))), primitive(Circles(pair(cx, cy), r))
    )


def exact_E(p):
    """Irradiance of a floor point."""
    return irradiance(built(p), Receiver(jnp.stack([p[0], 0.0 * p[0]]), 0.0 * p[0]))


def jets_of(E):
    """Value, gradient and Hessian, compiled as one."""

    def twice(p):
        value, gradient = jax.value_and_grad(E)(p)
        return gradient, (value, gradient)

    def all_of(p):
        hessian, (value, gradient) = jax.jacfwd(twice, has_aux=True)(p)
        return value, gradient, hessian

    return jax.jit(all_of)


through_the_scene = jets_of(exact_E)


def closed_E(p):
    x, a, b, h, cx, cy, r, l0, l1, H, L = p
    shadows = [cast_segment(x, a, b, h, H), cast_disc(x, cx, cy, r, H)]
    return L * lit(x, (l0, l1), H, shadows)


def differences(p, closed=closed_E):
    """Gradient and Hessian of the closed form in 60 digits."""
    with mp.workdps(60):
        p, h, k = [mp.mpf(v) for v in p], mp.mpf(10) ** -15, range(len(p))

        @functools.cache
        def at(i, di, j, dj):
            q = list(p)
            q[i] += di * h
            q[j] += dj * h
            return closed(q)

        first = [(at(i, 1, i, 0) - at(i, -1, i, 0)) / (2 * h) for i in k]
        second = np.zeros((len(p), len(p)))
        for i in k:
            for j in range(i + 1):
                cross = at(i, 1, j, 1) - at(i, 1, j, -1) - at(i, -1, j, 1) + at(i, -1, j, -1)
                second[i, j] = second[j, i] = float(cross / (4 * h**2))
        return float(closed(p)), np.array([float(v) for v in first]), second


@pytest.mark.parametrize("place", PLACES)
def test_gradient_and_hessian_in_every_leaf(place):
    """Occluder, radius, lamp and receiver together: 11 first and 66 second derivatives."""
    value, gradient, hessian = through_the_scene(jnp.array(PLACES[place]))
    E, first, second = differences(PLACES[place])
    assert abs(value - E) < 1e-14
    assert np.max(np.abs(gradient - first)) < 1e-12 * np.max(np.abs(first))
    assert np.max(np.abs(hessian - second)) < 1e-11 * np.max(np.abs(second))
    if "overlap" in place:
        assert abs(first[LEAVES.index("radius")]) > 0.1
        assert first[LEAVES.index("seg b")] == 0.0  # behind the disc: it hides nothing


@jax.jit
def twisted(speed, p):
    """E and its gradient with edges that move `speed` times as fast; compiled for all faults."""
    hemicircle = importlib.import_module("firstorder.flatland._hemicircle")
    true = hemicircle.sine_and_cosine

    def wrong(side, up):
        still = jax.lax.stop_gradient((side, up))
        return true(*(s + speed * (a - s) for s, a in zip(still, (side, up), strict=True)))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hemicircle, "sine_and_cosine", wrong)
        return jax.value_and_grad(lambda p: exact_E(p))(p)


@pytest.mark.parametrize(
    ("fault", "speed"),
    [
        ("none", 1.0),
        ("shadow edges do not move", 0.0),
        ("they move the other way", -1.0),
        ("they move twice as far", 2.0),
    ],
)
def test_a_fault_in_the_motion_of_edges_is_seen(fault, speed):
    """The value stays right and only derivatives tell."""
    p = PLACES["disc and segment overlap"]
    value, gradient = twisted(speed, jnp.array(p))
    E, first, _ = differences(p)
    assert abs(value - E) < 1e-14
    assert np.all(np.isfinite(gradient))
    error = np.max(np.abs(gradient - first))
    assert error < 1e-12 if fault == "none" else error > 1e-2


# --- a blocker that crosses the lamp --------------------------------------------------------------

PIERCING = (0.05, -0.02, 0.8, 0.32, 1.25, 1.0)  # x of the receiver; two ends; the lamp's height


def pierced(p, crossings=None):
    x, ax, ay, bx, by, H = p
    lamp = primitive(Segments(jnp.stack([0.5, H]), jnp.stack([-0.5, H])), emission=1.0)
    slab = primitive(Segments(jnp.stack([ax, ay]), jnp.stack([bx, by])))
    scene = Scene.of(lamp, slab, crossings=crossings)
    return scene, Receiver(jnp.stack([x, 0.0 * x]), 0.0 * x)


def pierced_by_hand(p):
    """The slab hides the lamp between the shadow of its lower end and where it passes through."""
    x, ax, ay, bx, by, H = p
    through = ax + (bx - ax) * (H - ay) / (by - ay)
    low, high = sorted((x + (ax - x) * H / ay, through))
    return lit(x, (mp.mpf(-0.5), mp.mpf(0.5)), H, [(low, high)])


def test_where_blocker_and_lamp_cross_the_crossing_moves_with_them():
    """Traced shapes take their crossings from a concrete scene like them."""
    crossings = pierced(jnp.array(PIERCING))[0].crossings

    jets = jets_of(lambda p: irradiance(*pierced(p, crossings)))
    value, gradient, hessian = jets(jnp.array(PIERCING))
    E, first, second = differences(PIERCING, pierced_by_hand)
    assert abs(value - E) < 1e-14
    assert np.max(np.abs(gradient - first)) < 1e-12 * np.max(np.abs(first))
    assert np.max(np.abs(hessian - second)) < 1e-11 * np.max(np.abs(second))
    assert np.all(np.abs(first) > 1e-3)


# --- the scene moved as a whole ------------------------------------------------------------------

PLACE = st.floats(-0.9, 0.9)
TURN = st.floats(-3.0, 3.0)
SIZE = st.floats(0.1, 10.0)


def moved(points, turn, shift):
    c, s = jnp.cos(turn), jnp.sin(turn)
    return points @ jnp.array([[c, s], [-s, c]]) + shift


def everything_moved(x, turn=0.0, shift=(0.0, 0.0), scale=1.0, L=1.0, power=0.0, split=0.5):
    """All numbers as arrays: compiled once."""
    numbers = (x, turn, jnp.array(shift), scale, L, power, split)
    return np.array(_moved(*(jnp.asarray(n, float) for n in numbers)))


@jax.jit
def _moved(x, turn, shift, scale, L, power, split):
    """Jets of E by translation and rotation in a scene that is turned, shifted and scaled.

    A lamp, a blocker in two halves, a disc, a point light.
    """
    place = lambda p: moved(scale * jnp.asarray(p), turn, shift)  # noqa: E731
    a, b = jnp.array([0.25, 0.5]), jnp.array([-0.1, 0.7])
    m = a + split * (b - a)
    scene = Scene.of(
        primitive(Segments(place([0.6, 1.2]), place([-0.5, 1.0])), emission=L),
        primitive(Segments(place(jnp.stack([a, m])), place(jnp.stack([m, b])))),
        primitive(Circles(place([-0.4, 0.6]), 0.12 * scale)),
        points=PointLights(place([-0.1, 0.9]), power),
    )
    at = Receiver(place(jnp.stack([x, 0.0 * x])), turn + 0.2)
    E = lambda r: irradiance(scene, r)  # noqa: E731
    d = derivatives(E, at)
    parts = [d.translation(), d.rotation()]
    return jnp.stack([n for p in parts for n in (p.value, p.first, p.second)])


@given(PLACE, TURN, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_rigid_motion_of_the_scene_changes_nothing(x, turn, up, side):
    rest = everything_moved(x, power=0.3)
    ours = everything_moved(x, turn, (up, side), power=0.3)
    assert np.all(np.isfinite(rest))
    if not near_event(x):
        np.testing.assert_allclose(ours, rest, rtol=0.0, atol=1e-11 * (1.0 + np.abs(rest).max()))


@given(PLACE, SIZE)
def test_derivatives_scale_with_the_scene(x, scale):
    """Area light: k-th derivative as s^-k; point light: s^-(k + 1); turns have no length."""
    if near_event(x):
        return
    for fall, L, power in ((0, 1.0, 0.0), (1, 0.0, 1.0)):
        one = everything_moved(x, L=L, power=power)
        two = everything_moved(x, scale=scale, L=L, power=power)
        factor = scale ** -(np.array([0, 1, 2, 0, 0, 0]) + float(fall))
        np.testing.assert_allclose(two, one * factor, rtol=1e-10, atol=1e-12 * factor.max())


@given(PLACE, st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_lights_add(x, L, power):
    both = everything_moved(x, L=L, power=power)
    lamp, point = everything_moved(x), everything_moved(x, L=0.0, power=1.0)
    np.testing.assert_allclose(
        both, L * lamp + power * point, rtol=0.0, atol=1e-12 * (1 + abs(both).max())
    )


@given(PLACE, st.floats(0.0, 1.0))
def test_a_blocker_split_in_two_is_the_same_blocker(x, share):
    whole, parts = everything_moved(x, split=1.0), everything_moved(x, split=share)
    assert np.all(np.isfinite(parts))
    if not near_event(x):
        np.testing.assert_allclose(parts, whole, rtol=0.0, atol=1e-11 * (1.0 + np.abs(whole).max()))


def near_event(x):
    """Whether two events are in line at x, where derivatives jump and rounding picks a side.

    Corners and the point light in pairs by similar triangles; the disc by its tangents.
    """
    corners = [(0.6, 1.2), (-0.5, 1.0), (0.25, 0.5), (-0.1, 0.7), (-0.1, 0.9)]
    angles = [np.arctan2(x - px, py) for px, py in corners]
    w = np.array([-0.4 - x, 0.6])
    middle, half = np.arctan2(-w[0], w[1]), np.arcsin(0.12 / np.hypot(*w))
    angles = np.sort([*angles, middle - half, middle + half])
    return np.min(np.diff(angles)) < 1e-6


# --- the image-space route -----------------------------------------------------------------------


@jax.jit
def under_a_sky(x):
    """Jets of E under a white sky: from silhouettes, and from 256 rays with R07's formulas."""
    slab, disc = Segments((0.5, 0.8), (0.1, 0.9)), Circles((-0.3, 0.7), 0.2)
    scene = Scene.of(primitive(slab), primitive(disc), environment=ConstantSky(1.0))
    at = Receiver(jnp.stack([x, 0.0 * x]), 0.0 * x)

    def hit(angle):
        along = direction(angle.ravel())
        t = nearest(scene, jnp.broadcast_to(at.position, along.shape), along).t
        return t.reshape(angle.shape)

    found = bracket_edges(lambda a: jnp.isfinite(hit(a)), jnp.linspace(-1.57, 1.57, 256), size=4)
    edges = VisibilityEdges(tangent_points(hit, found).edges().along(), jnp.array(1.0))
    traced = shading_derivatives(lambda p, w: jnp.cos(w), x[None], edges)
    exact = derivatives(irradiance, scene, at, freedoms=("x",))
    rays = (traced.value, traced.gradient.total[0], traced.hessian.total[0, 0])
    return jnp.stack(rays), jnp.stack([exact.value, exact.first, exact.second])


@pytest.mark.parametrize("x", [-0.8, -0.25, 0.2, 0.9])
def test_edges_found_by_rays_give_the_same_derivatives(x):
    rays, exact = under_a_sky(x)
    np.testing.assert_allclose(rays[0], exact[0], rtol=1e-14)
    np.testing.assert_allclose(rays[1], exact[1], rtol=1e-8)
    np.testing.assert_allclose(rays[2], exact[2], rtol=1e-5)


# --- degenerate scenes ---------------------------------------------------------------------------

# Ends of two segments, a disc, and the place of the receiver on y = 0.
DEGENERATE = {
    "plain": ((0.2, 0.5, -0.1, 0.6), (-0.5, 0.5, -0.6, 0.7), (0.6, 0.5, 0.1), 0.0),
    "touching ends": ((0.2, 0.5, 0.0, 0.6), (0.0, 0.6, -0.3, 0.5), (0.6, 0.5, 0.1), 0.1),
    "the same twice": ((0.2, 0.5, 0.0, 0.6), (0.2, 0.5, 0.0, 0.6), (0.6, 0.5, 0.1), 0.1),
    "seen edge on": ((0.0, 0.3, 0.0, 0.7), (-0.5, 0.5, -0.6, 0.7), (0.6, 0.5, 0.1), 0.0),
    "end on the receiver": ((0.1, 0.0, 0.3, 0.6), (-0.5, 0.5, -0.6, 0.7), (0.6, 0.5, 0.1), 0.1),
    "along the floor": ((0.3, 0.0, -0.3, 0.0), (-0.5, 0.5, -0.6, 0.7), (0.6, 0.5, 0.1), 0.1),
    "on the lamp": ((0.2, 1.0, -0.1, 1.0), (-0.5, 0.5, -0.6, 0.7), (0.6, 0.5, 0.1), 0.0),
    "disc on the receiver": ((0.2, 0.5, -0.1, 0.6), (-0.5, 0.5, -0.6, 0.7), (0.1, 0.2, 0.2), 0.1),
    "in the disc": ((0.2, 0.5, -0.1, 0.6), (-0.5, 0.5, -0.6, 0.7), (0.1, 0.1, 0.3), 0.1),
    "tangent at the lamp": ((2.0, 0.5, 2.1, 0.6), (-2.0, 0.5, -2.1, 0.7), (0.4, 0.5, 0.1), 0.5),
    "discs and ends in line": ((0.4, 0.4, 0.9, 0.4), (-0.5, 0.5, -0.6, 0.7), (0.3, 0.8, 0.1), 0.4),
}  # fmt: skip


def in_degenerate(numbers):
    one, two, disc, x = (numbers[:4], numbers[4:8], numbers[8:11], numbers[11])
    scene = Scene.of(
        primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=jnp.asarray(1.0, numbers.dtype)),
        primitive(Segments(jnp.stack([one[:2], two[:2]]), jnp.stack([one[2:], two[2:]]))),
        primitive(Circles(disc[:2], disc[2])),
    )
    return irradiance(scene, Receiver(jnp.stack([x, 0.0 * x]), 0.0 * x))


@functools.cache
def degenerate_jets(bits):
    with jax.enable_x64(bits == 64):
        numbers = jnp.array([[*a, *b, *c, x] for a, b, c, x in DEGENERATE.values()], f"float{bits}")
        found = jax.jit(jax.vmap(jax.value_and_grad(in_degenerate)))(numbers)
        return [np.asarray(leaf) for leaf in found]


def degenerate_truth(a, b, disc, x):
    """E by the shadows on the lamp's line, one shape after the other."""
    shadows = []
    for p, q in ((a[:2], a[2:]), (b[:2], b[2:])):
        if p[1] > 0 and q[1] > 0 and min(p[1], q[1]) < 1.0:
            shadows.append(tuple(sorted(x + (e[0] - x) / e[1] for e in (p, q))))
    cx, cy, r = disc
    if np.hypot(cx - x, cy) <= r:
        return 0.0
    shadows.append(cast_disc(x, cx, cy, r, 1.0))
    return float(lit(x, (-0.5, 0.5), 1.0, shadows))


@pytest.mark.parametrize("bits", [64, 32])
def test_degenerate_scenes_have_no_nan(bits):
    value, gradient = degenerate_jets(bits)
    assert value.dtype == gradient.dtype == f"float{bits}"
    for name, E, g in zip(DEGENERATE, value, gradient, strict=True):
        assert np.isfinite(E), name
        assert np.all(np.isfinite(g)), name


def test_degenerate_scenes_have_the_value_that_they_should():
    """A shape in the plane of the lamp is not decided: which of the two is nearer is rounding."""
    value, _ = degenerate_jets(64)
    for (name, numbers), E in zip(DEGENERATE.items(), value, strict=True):
        if name != "on the lamp":
            assert abs(E - degenerate_truth(*numbers)) < 1e-12, name


def test_single_precision_is_close():
    for one, two in zip(degenerate_jets(32), degenerate_jets(64), strict=True):
        np.testing.assert_allclose(one[0], two[0], rtol=1e-4, atol=1e-5)
