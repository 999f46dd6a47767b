"""Sums over gathered rays and walls, by differences and by integrals along the walls."""

import itertools

import numpy as np

from firstorder.space.estimators._gather_sums import WallSweeps, jumps_across, surface_area_sums

RNG = np.random.default_rng(3)


def geometry_term(x, y, normal):
    """Of a point that is seen from a plane z = 0, on which x moves: `z cos / r^3`, to a factor."""
    way = np.append(x, 0.0) - y
    return -y[2] * 0.0 + y[2] * (normal @ way) / (way @ way) ** 2


def differences(f, h=1e-3):
    """Gradient and Hessian at 0 of a function of two numbers, of fourth order in the step."""
    k, e = np.array([-2.0, -1.0, 1.0, 2.0]), np.eye(2)
    a, b = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0, np.array([-1.0, 16.0, 16.0, -1.0]) / 12.0
    first = [sum(w * f(s * h * d) for s, w in zip(k, a, strict=True)) / h for d in e]
    second = np.empty((2, 2))
    for i in range(2):
        second[i, i] = (
            sum(w * f(s * h * e[i]) for s, w in zip(k, b, strict=True)) - 2.5 * f(0.0 * e[0])
        ) / h**2
    grid = [
        (wi * wj) * f(h * (si * e[0] + sj * e[1]))
        for si, wi in zip(k, a, strict=True)
        for sj, wj in zip(k, a, strict=True)
    ]
    second[0, 1] = second[1, 0] = sum(grid) / h**2
    return np.array(first), second


def test_light_moves_with_the_geometry_term():
    count = 4
    y = RNG.uniform(-1.0, 1.0, (count, 3)) + np.array([0.0, 0.0, 2.0])
    normal = RNG.normal(size=(count, 3)) - [0.0, 0.0, 3.0]
    r = np.linalg.norm(y, axis=1)
    G = np.array([geometry_term(np.zeros(2), *row) for row in zip(y, normal, strict=True)])
    L = RNG.uniform(1.0, 2.0, (3, count))
    u = (y / r[:, None])[:, :2].T
    n = (normal / np.sum(normal * -y / r[:, None], axis=1, keepdims=True))[:, :2].T
    first, second = surface_area_sums(L * G / r, (L[0] * G) / r**2, u, n)
    parts = [differences(lambda x, k=k: geometry_term(x, y[k], normal[k])) for k in range(count)]
    np.testing.assert_allclose(first, L @ np.array([p for p, _ in parts]), rtol=1e-8)
    np.testing.assert_allclose(second, np.tensordot(L[0], [p for _, p in parts], 1), rtol=1e-6)


def test_leading_axes_are_sums_of_their_own():
    near, nearer = RNG.normal(size=(2, 3, 5)), RNG.normal(size=(2, 5))
    u, n = RNG.normal(size=(2, 2, 2, 5))
    both = surface_area_sums(near, nearer, u, n)
    for k in range(2):
        one = surface_area_sums(near[k], nearer[k], u[k], n[k])
        for a, b in zip(both, one, strict=True):
            np.testing.assert_allclose(a[k], b, rtol=1e-12)


def test_jumps_are_what_is_beyond_a_wall_less_what_is_before_it():
    L = np.array([[1.0, 2.0, 4.0], [8.0, 16.0, 32.0], [64.0, 128.0, 256.0]])
    w = np.array([[0.1, 0.5, 0.3], [0.2, 0.4, 0.6], [0.7, 0.1, 0.2]])
    (circles, meridians), (over, beside) = jumps_across(L, w)
    assert circles.tolist() == [[7.0, 14.0, 28.0], [56.0, 112.0, 224.0]]
    assert meridians.tolist() == [[-3.0, 1.0, 2.0], [-24.0, 8.0, 16.0], [-192.0, 64.0, 128.0]]
    assert over.tolist() == [[0.2, 0.5, 0.6], [0.7, 0.4, 0.6]]
    assert beside.tolist() == [[0.3, 0.5, 0.5], [0.6, 0.4, 0.6], [0.7, 0.7, 0.2]]


def along_walls(theta, phi, circles, meridians):
    """The change of irradiance by a step, from the speed of each wall across itself.

    Directions w at the distance 1 move with `-d + (d . w) w`; a wall that moves towards its far
    side takes light from there away.
    """
    x, weight = np.polynomial.legendre.leggauss(12)
    total = np.zeros(2)
    for i, t in enumerate(theta[1:-1]):
        for j, (a, b) in enumerate(itertools.pairwise(phi)):
            f = 0.5 * (a + b) + 0.5 * (b - a) * x
            e_theta = np.stack([np.cos(t) * np.cos(f), np.cos(t) * np.sin(f)])
            length = 0.5 * (b - a) * np.sin(t) * weight
            total += circles[i, j] * np.cos(t) * (e_theta @ length)
    for i, (a, b) in enumerate(itertools.pairwise(theta)):
        t = 0.5 * (a + b) + 0.5 * (b - a) * x
        lengths = 0.5 * (b - a) * (weight @ np.cos(t))
        for j, f in enumerate(phi[:-1]):
            total += meridians[i, j] * lengths * np.array([-np.sin(f), np.cos(f)])
    return total


def test_walls_sweep_light_across_themselves():
    theta = np.array([0.0, 0.4, 0.9, 1.5])
    phi = np.array([0.0, 0.7, 2.0, 3.9, 2.0 * np.pi])
    circles, meridians = RNG.normal(size=(5, 2, 4)), RNG.normal(size=(5, 3, 4))
    found = WallSweeps.of(theta, phi).gradient(circles, meridians)
    true = [along_walls(theta, phi, *pair) for pair in zip(circles, meridians, strict=True)]
    np.testing.assert_allclose(found, true, rtol=1e-10)
