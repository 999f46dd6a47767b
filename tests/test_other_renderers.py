"""Other people's renderers beside ours: Mitsuba 3 and Radiance, on two scenes.

They run where the packages are importable (`pip install mitsuba pyradiance`, neither is a
dependency) and are skipped elsewhere. Both are Monte Carlo: Mitsuba's values are judged by z-tests.
Radiance says nothing of its errors; its values are compared to a percent, and of its gradients the
directions alone, for their lengths are known to be short (J12 §7.2).

Scenes: a sphere over a plane under a uniform sky; the floor of J12's box (`library.j12_box`), whose
light is direct and reflected once by the left wall.
"""

import functools
import os
import pathlib
import subprocess

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.statistics import z_test
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.space import Receiver, geometry_term, receiver
from firstorder.space.bounces.radiosity import rectangle_irradiance
from firstorder.space.direct_lighting import irradiance
from firstorder.space.library._scenes import j12_box, sphere_over_plane

X = np.array([0.1, 0.25, 0.4, 0.6, 0.9])  # on the floor of the box, y = 0.35
Y = 0.35
BESIDE = np.array([0.0, 0.4, 1.0, 2.0])  # from below the sphere outwards
WHITE = {"type": "rgb", "value": 1.0}


# --- ours ----------------------------------------------------------------------------------------


@functools.cache
def box_light():
    """Direct and once reflected irradiance on the floor, and the gradient of the second."""
    scene = j12_box()
    t, w = gauss_legendre(48)
    y, z = (a.ravel() for a in np.meshgrid(0.5 + 0.5 * t, 0.5 + 0.5 * t))
    weight = jnp.asarray(np.outer(0.5 * w, 0.5 * w).ravel())
    wall = jnp.asarray(np.stack([0.0 * y, y, z], -1))
    right = jnp.array([1.0, 0.0, 0.0])
    (floor,) = scene.named("floor")
    lamp = jnp.array([(0.3, 0.3, 1.0), (0.3, 0.7, 1.0), (0.7, 0.7, 1.0), (0.7, 0.3, 1.0)])
    L = 0.5 / np.pi * jax.vmap(lambda p: rectangle_irradiance(p, right, lamp))(wall)

    def reflected(x):
        up, n = jnp.array([0.0, 0.0, 1.0]), jnp.broadcast_to(right, wall.shape)
        place = jnp.broadcast_to(jnp.append(x, 0.0), wall.shape)
        return jnp.sum(weight * L * geometry_term(place, jnp.broadcast_to(up, wall.shape), wall, n))

    def direct(x):
        return irradiance(scene, Receiver(jnp.append(x, 0.0), jnp.eye(3), jnp.zeros((2, 2)), floor))

    places = jnp.asarray(np.stack([X, np.full_like(X, Y)], -1))
    both = jax.jit(jax.vmap(lambda x: (direct(x), *jax.value_and_grad(reflected)(x))))
    return tuple(np.asarray(a) for a in both(places))


@functools.cache
def sphere_light():
    """Irradiance beside the sphere."""
    scene = sphere_over_plane()
    places = jnp.asarray(np.stack([BESIDE, 0.0 * BESIDE, 0.0 * BESIDE], -1))
    return np.asarray(jax.jit(jax.vmap(lambda x: irradiance(scene, receiver(x))))(places))


def test_ours_are_the_closed_form_and_lamberts_sum():
    """Before anybody else is judged by them."""
    truth = np.pi * (1.0 - 0.25 / (1.0 + BESIDE**2) ** 1.5)
    np.testing.assert_allclose(sphere_light(), truth, rtol=1e-12)
    corners = np.array([(0.3, 0.3), (0.3, 0.7), (0.7, 0.7), (0.7, 0.3)])
    for x, found in zip(X, box_light()[0], strict=True):
        p = np.concatenate([corners - (x, Y), np.ones((4, 1))], -1)
        q = np.roll(p, -1, 0)
        n = np.cross(p, q)
        cosine = np.sum(p * q, -1) / np.linalg.norm(p, axis=1) / np.linalg.norm(q, axis=1)
        lambert = np.sum(np.arccos(cosine) * n[:, 2] / np.linalg.norm(n, axis=1)) / 2.0
        assert abs(abs(lambert) - found) < 1e-12


# --- Mitsuba -------------------------------------------------------------------------------------


def mitsuba_irradiance(world, places, depth, count):
    """Mean and standard error of what a white floor shows, times pi."""
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    scene = mi.load_dict({"type": "scene", **world(mi)})
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 1000})
    sampler = mi.load_dict({"type": "independent"})
    out = []
    for k, (x, y) in enumerate(places):
        sampler.seed(k)
        ray = mi.RayDifferential3f(mi.Ray3f([float(x), float(y), 1e-3], [0.0, 0.0, -1.0]))
        values = [float(integrator.sample(scene, sampler, ray)[0][0]) for _ in range(count)]
        out.append((np.pi * np.mean(values), np.pi * np.std(values) / np.sqrt(count)))
    return np.array(out).T


def diffuse(value):
    bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": value}}
    return {"type": "twosided", "bsdf": bsdf}


def test_mitsuba_beside_a_sphere():
    def world(mi):
        flat = mi.ScalarTransform4f().scale([100.0, 100.0, 1.0])
        return {
            "sky": {"type": "constant", "radiance": WHITE},
            "ball": {"type": "sphere", "center": [0, 0, 1], "radius": 0.5, "bsdf": diffuse(0.0)},
            "floor": {"type": "rectangle", "to_world": flat, "bsdf": diffuse(1.0)},
        }

    mean, error = mitsuba_irradiance(world, [(x, 0.0) for x in BESIDE], 2, 20000)
    found = z_test(mean, error, sphere_light())
    print("Mitsuba, sphere:", np.round(mean / sphere_light() - 1.0, 4), "worst z", found.worst)
    assert found.passed


def mitsuba_box(mi):
    """A rectangle of Mitsuba is [-1, 1]^2 facing +z."""
    T = mi.ScalarTransform4f

    def wall(x, turn, albedo):
        place = T().translate([x, 0.5, 0.5]).rotate([0, 1, 0], turn).scale(0.5)
        return {"type": "rectangle", "to_world": place, "bsdf": diffuse(albedo)}

    lamp = T().translate([0.5, 0.5, 1.0]).rotate([1, 0, 0], 180).scale(0.2)
    floor = T().translate([0.5, 0.5, 0.0]).scale(0.5)
    return {
        "floor": {"type": "rectangle", "to_world": floor, "bsdf": diffuse(1.0)},
        "left": wall(0.0, 90, 0.5),
        "right": wall(1.0, -90, 0.0),
        "lamp": {
            "type": "rectangle",
            "to_world": lamp,
            "bsdf": diffuse(0.0),
            "light": {"type": "area", "radiance": WHITE},
        },
    }


def test_mitsuba_in_the_box():
    """Depth 2 is direct light, depth 3 one more reflection; the floor's own comes at depth 4."""
    direct, reflected, _ = box_light()
    places = [(x, Y) for x in X]
    for depth, truth in ((2, direct), (3, direct + reflected)):
        mean, error = mitsuba_irradiance(mitsuba_box, places, depth, 20000)
        found = z_test(mean, error, truth)
        print(f"Mitsuba, box, depth {depth}:", np.round(mean / truth - 1.0, 4), found.worst)
        assert found.passed
    # The same numbers without the reflection are far off: the test can see it.
    assert not z_test(mean, error, direct).passed


# --- Radiance ------------------------------------------------------------------------------------

BOX = """
void plastic grey 0 0 5 0.5 0.5 0.5 0 0
void plastic black 0 0 5 0 0 0 0 0
void light bright 0 0 3 1 1 1
grey polygon left 0 0 12  0 0 0  0 1 0  0 1 1  0 0 1
black polygon right 0 0 12  1 0 0  1 0 1  1 1 1  1 1 0
bright polygon lamp 0 0 12  0.3 0.3 1  0.3 0.7 1  0.7 0.7 1  0.7 0.3 1
"""
SPHERE = """
void plastic black 0 0 5 0 0 0 0 0
void glow bright 0 0 4 1 1 1 0
bright source sky 0 0 4 0 0 1 180
black sphere ball 0 0 4  0 0 1 0.5
"""
FINE = ["-as", "0", "-dj", "0", "-ds", "0.02", "-dt", "0", "-dc", "1"]


def radiance(tmp_path, world, places, *options):
    """Irradiance at places that face up, as `rtrace -I` gives it."""
    package = pathlib.Path(pytest.importorskip("pyradiance").__file__).parent
    environment = dict(os.environ, RAYPATH=str(package / "lib"))
    environment["PATH"] = f"{package / 'bin'}{os.pathsep}{environment['PATH']}"

    def run(*command, given=b""):
        program = str(package / "bin" / command[0])
        done = subprocess.run(
            [program, *map(str, command[1:])], input=given, capture_output=True, env=environment
        )
        assert done.returncode == 0, done.stderr.decode()
        return done.stdout

    (tmp_path / "world.rad").write_text(world)
    (tmp_path / "world.oct").write_bytes(run("oconv", tmp_path / "world.rad"))
    given = "".join(f"{x} {y} 0 0 0 1\n" for x, y in places).encode()
    lines = run("rtrace", "-h", "-I", *options, tmp_path / "world.oct", given=given)
    values = np.array([float(line.split()[0]) for line in lines.decode().splitlines()])
    stored = tmp_path / "cache.amb"
    table = run("lookamb", "-h", "-d", stored).decode() if stored.exists() else ""
    return values, np.array([line.split() for line in table.splitlines()], float)


def test_radiance_beside_a_sphere(tmp_path):
    options = ["-ab", "1", "-ad", "16384", "-aa", "0", *FINE]
    found, _ = radiance(tmp_path, SPHERE, [(x, 0.0) for x in BESIDE], *options)
    print("Radiance, sphere:", np.round(found / sphere_light() - 1.0, 4))
    np.testing.assert_allclose(found, sphere_light(), rtol=0.003)  # measured 0.0009


def test_radiances_direct_light_in_the_box(tmp_path):
    """Reflected light is judged with its records; without a cache (`-aa 0`) it is up to 5 % off."""
    direct, _, _ = box_light()
    places = [(x, Y) for x in X]
    only, _ = radiance(tmp_path, BOX, places, "-ab", "0", *FINE)
    print("Radiance, box, direct:", np.round(only / direct - 1.0, 4))
    np.testing.assert_allclose(only, direct, rtol=0.003)  # measured 0.0009


def test_directions_of_radiances_gradients(tmp_path):
    """Each place is a record: `lookamb -d` prints its gradient in its own tangents.

    Lengths are printed and not judged.
    """
    _, reflected, gradient = box_light()
    options = ["-ab", "1", "-ad", "16384", "-aa", "0.05", "-ar", "100", *FINE]
    options += ["-af", tmp_path / "cache.amb"]
    _, table = radiance(tmp_path, BOX, [(x, Y) for x in X], *options)
    assert len(table) >= len(X) - 1
    for row in table:
        k = int(np.argmin(np.hypot(X - row[0], Y - row[1])))
        u, n = row[6:9], row[3:6]
        value, along = row[13], row[16:18]
        found = (along[0] * u + along[1] * np.cross(n, u))[:2]
        cosine = found @ gradient[k] / np.linalg.norm(found) / np.linalg.norm(gradient[k])
        size = np.linalg.norm(found) * value * np.pi / np.linalg.norm(gradient[k])
        print(f"Radiance, x = {X[k]}: cosine {cosine:.4f}, length {size:.3f} of the true one,",
              f"value {np.pi * value / reflected[k]:.4f}")  # fmt: skip
        assert abs(np.pi * value / reflected[k] - 1.0) < 0.03
        assert cosine > 0.9
