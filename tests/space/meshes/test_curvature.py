"""Curvatures of meshes against those of the sphere and the torus: order measured, both meshes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.space.meshes.curvature import curvatures_from_normals, fitted_curvatures
from firstorder.space.meshes.triangle_mesh import mesh

SIDE = 11
BIG, SMALL = 1.0, 0.4
INNER = np.arange(SIDE**2).reshape(SIDE, SIDE)[3:-3, 3:-3].ravel()
JITTER = np.random.default_rng(1).uniform(-0.25, 0.25, (2, SIDE, SIDE))


def patch(surface, h, jitter):
    """A piece of a surface over parameters (a, b) that are h apart; always the same triangles."""
    i, j = np.mgrid[:SIDE, :SIDE] - SIDE // 2 + (JITTER if jitter else 0.0)
    a, b = 0.3 + h * i.ravel(), 0.5 + h * j.ravel()
    k = np.arange(SIDE**2).reshape(SIDE, SIDE)
    p, q, r, s = (x.ravel() for x in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    faces = np.concatenate([np.stack([p, q, r], -1), np.stack([p, r, s], -1)])
    vertices, normals, kappa, along = surface(a, b)
    return mesh(vertices, faces), normals, kappa, along


def torus(a, b):
    out = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], -1)
    around = np.stack([np.cos(a), np.sin(a), 0 * a], -1)
    kappa = np.stack([-np.cos(b) / (BIG + SMALL * np.cos(b)), 0.0 * b - 1.0 / SMALL], -1)
    along = np.stack([-np.sin(a), np.cos(a), 0 * a], -1)
    return BIG * around + SMALL * out, out, kappa, along


def sphere(a, b):
    out = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], -1)
    return SMALL * out, out, np.full((len(a), 2), -1.0 / SMALL), None


def errors(estimate, surface, jitter, steps=(0.1, 0.025)):
    """Errors of curvature (RMS over the inner vertices: their largest jumps about), by step."""
    found = []
    for h in steps:
        m, normals, kappa, _ = patch(surface, h, jitter)
        wrong = (np.asarray(estimate(m, jnp.asarray(normals)).kappa) - kappa)[INNER]
        found.append(np.sqrt(np.mean(wrong**2)))
    return np.array(found)


ESTIMATES = {
    "degree 3": lambda m, _: fitted_curvatures(m, 3),
    "degree 4": lambda m, _: fitted_curvatures(m, 4),
    "true normals": curvatures_from_normals,
    "own normals": lambda m, _: curvatures_from_normals(m),
}
# Orders in the edges' length on a mesh that is (regular, jittered), each less 0.25; as derived for
# jets (degree - 1, and one more where odd terms cancel) and for differences of exact normals.
ORDERS = {"degree 3": (2, 2), "degree 4": (4, 3), "true normals": (2, 1)}


@pytest.mark.parametrize("jitter", [False, True])
@pytest.mark.parametrize("name", ORDERS)
def test_the_error_on_a_torus_falls_as_it_should(name, jitter):
    coarse, fine = errors(ESTIMATES[name], torus, jitter)
    assert np.log2(coarse / fine) / 2.0 > ORDERS[name][jitter] - 0.25
    assert fine < {"degree 3": 0.02, "degree 4": 4e-4, "true normals": 0.02}[name]


def test_normals_of_an_irregular_mesh_are_not_good_enough():
    coarse, fine = errors(ESTIMATES["own normals"], torus, True)
    assert np.log2(coarse / fine) / 2.0 < 0.5


@pytest.mark.parametrize("jitter", [False, True])
def test_a_sphere(jitter):
    assert errors(ESTIMATES["true normals"], sphere, jitter).max() < 1e-11
    coarse, fine = errors(ESTIMATES["degree 4"], sphere, jitter)
    assert fine < 2e-3
    assert np.log2(coarse / fine) / 2.0 > 2.75


@pytest.mark.smoke
def test_principal_directions_of_a_torus():
    m, normals, _, along = patch(torus, 0.05, True)
    found = fitted_curvatures(m)
    np.testing.assert_allclose(found.normal[INNER], normals[INNER], atol=1e-4)
    np.testing.assert_allclose(np.abs(np.sum(found.directions[:, 0] * along, -1))[INNER], 1.0,
                               atol=1e-4)  # fmt: skip
    t = np.asarray(found.directions)
    np.testing.assert_allclose(np.cross(found.normal, t[:, 0]), t[:, 1], atol=1e-12)
    np.testing.assert_allclose(found.gauss, np.prod(found.kappa, -1), rtol=1e-12)
    np.testing.assert_allclose(found.mean, np.mean(found.kappa, -1), rtol=1e-12)


def test_scale_and_orientation():
    m, _, _, _ = patch(torus, 0.1, True)
    turned = mesh(m.vertices, m.faces[:, ::-1])
    once, large, back = (
        fitted_curvatures(m, 3),
        fitted_curvatures(m.at(3.0 * m.vertices), 3),
        fitted_curvatures(turned, 3),
    )
    np.testing.assert_allclose(3.0 * large.kappa, once.kappa, atol=1e-9)
    np.testing.assert_allclose(back.kappa, -once.kappa[:, ::-1], atol=1e-9)


def test_few_neighbours_and_flat_faces_are_finite_with_their_derivatives():
    corners = jnp.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    m = mesh(corners, [[0, 1, 2], [0, 1, 3]])  # the second has no area

    def total(v):
        return sum(jnp.sum(f(m.at(v)).kappa) for f in (fitted_curvatures, curvatures_from_normals))

    value, slope = jax.value_and_grad(total)(corners)
    assert np.isfinite(value)
    assert np.all(np.isfinite(slope))


def test_a_bad_degree_is_one_sentence():
    m, _, _, _ = patch(torus, 0.1, False)
    with pytest.raises(ValueError, match=r"^Argument `degree` must be 2, 3 or 4, but is 5\.$"):
        fitted_curvatures(m, 5)
    with pytest.raises(ValueError, match="Argument `normals` must have shape"):
        curvatures_from_normals(m, m.vertices[:3])
