"""The same batches on the processor and on an accelerator, in float64 and float32.

    python -m benchmarks.devices --out benchmarks/devices.md
    python -m benchmarks.devices --quick        small batches, to see that it runs

For each kind of device that JAX finds and each precision, in a process of its own: the time of an
item of a batch, and the error of the first items. The reference is the processor in float64, and an
error is divided by the largest number of its column. It is given at ninety-nine items in a hundred
and at the worst, as float32 moves some receivers over the edge of a shadow.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import pathlib
import platform as host
import sys
import tempfile

import numpy as np

from benchmarks.one_core import answer, best
from figures.claims import markdown_table

ITEMS, QUICK = 1 << 16, 1 << 8
HEAVY = 16  # the dearest calls have batches that much smaller
COMPARED = 1 << 12
PRECISIONS = 64, 32
ONE = "one"
PLATFORMS = {"gpu": "cuda"}  # JAX's names of a platform where they are not those of its devices


# --- in a process of its own ---------------------------------------------------------------------


def batches(items):
    """What is called, with arrays of as many items, by name."""
    import jax
    import jax.numpy as jnp

    from firstorder import flatland, space
    from firstorder.flatland.intersect import first_shape
    from tests import first_calls as entry

    rng = np.random.default_rng(0)
    x, turn = jnp.asarray(rng.uniform(-1.0, 1.0, items)), jnp.asarray(rng.uniform(0.0, 6.28, items))
    pairs = jnp.asarray(rng.uniform(-0.5, 0.5, (items, 2)))
    directions = jnp.stack([jnp.cos(turn), jnp.sin(turn)], -1)
    radius = jnp.full(items, 0.1)
    few = max(items // HEAVY, 1)
    light, world, discs = entry.path(), entry.lamp_ball_box(), lamp_over_discs(rng)
    receiver = space.Receiver.at((0.1, 0.2, 0.0))
    lit = entry.lit_by_segment

    def in_space(step):
        return entry.lit_in_space(world, receiver, step)

    def under_discs(x):
        return flatland.irradiance(discs, flatland.Receiver((x, 0.0), 0.0))

    return {
        "path, jet": (jax.vmap(light.jet), pairs),
        "path, spectrum": (jax.vmap(light.spectrum().at), 20.0 * pairs),
        "shadow field, spectrum": (jax.vmap(entry.planar_shadow().at), 20.0 * pairs[:, :1]),
        "nearest of 65 shapes": (lambda o, d: first_shape(discs, o, d), pairs, directions),
        "flatland E": (jax.vmap(lit), x, radius),
        "flatland gradient": (jax.vmap(jax.grad(lit, (0, 1))), x, radius),
        "flatland Hessian": (jax.vmap(jax.hessian(lit, (0, 1))), x, radius),
        "flatland E, 64 discs": (jax.vmap(under_discs), x[:few]),
        "scene_d E''": (jax.vmap(jax.grad(jax.grad(entry.room))), turn[:few] / 6.28),
        "space E": (jax.vmap(in_space), pairs),
        "space gradient": (jax.vmap(jax.grad(in_space)), pairs),
        "space Hessian": (jax.vmap(jax.hessian(in_space)), pairs[:few]),
    }


def lamp_over_discs(rng, side=8):
    """A lamp over a lattice of small discs, each moved a little."""
    from firstorder import flatland

    lattice = np.stack(np.divmod(np.arange(side * side), side), -1) / side
    centers = rng.uniform(0.0, 0.05, lattice.shape) + lattice + np.array([-0.5, 0.25])
    lamp = flatland.Segments((1.5, 2.0), (-0.5, 2.0))
    discs = flatland.Circles(centers, np.full(len(centers), 0.02))
    return flatland.Scene.of(
        flatland.primitive(lamp, emission=1.0), flatland.primitive(discs, albedo=0.5)
    )


def measured(items, file):
    """Microseconds an item, by name; the first answers go to a file."""
    import jax

    answers, times = {}, {}
    for name, (function, *args) in batches(items).items():
        run = jax.jit(function)
        numbers = [np.asarray(a) for a in jax.tree.leaves(run(*args))]
        answers[name] = np.concatenate(
            [a[:COMPARED].reshape(len(a[:COMPARED]), -1) for a in numbers], 1
        )
        times[name] = 1e6 * best(run, *args, repeats=3) / len(args[0])
    np.savez(file, **answers)
    return times


# --- the tables ----------------------------------------------------------------------------------


def runs(kinds, items):
    """Times and first answers, by device and precision, such as "gpu float32"."""
    times, answers = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for kind, bits in itertools.product(kinds, PRECISIONS):
            name, file = f"{kind} float{bits}", f"{folder}/{kind}{bits}.npz"
            platform = PLATFORMS.get(kind, kind)
            times[name] = answer(__file__, ONE, bits, items, file, JAX_PLATFORMS=platform)
            answers[name] = dict(np.load(file))
    return times, answers


def errors(answer, reference):
    """Of ninety-nine items in a hundred, and of the worst, over the largest number of a column."""
    size = np.max(np.abs(reference), 0)
    off = np.max(np.abs(answer - reference) / np.where(size > 0.0, size, 1.0), 1)
    return f"{np.quantile(off, 0.99):.0e}, {np.max(off):.0e}"


def report(kinds, items):
    """Both tables as Markdown."""
    times, answers = runs(kinds, items)
    reference, *others = answers
    quick, exact = [], []
    for name, true in answers[reference].items():
        quick.append([name, *(f"{times[run][name]:.3g}" for run in times)])
        exact.append([name, *(errors(answers[run][name], true) for run in others)])
    return "\n\n".join(
        [
            "Microseconds an item:",
            markdown_table(["", *times], quick),
            f"Error beside {reference}, at ninety-nine items in a hundred and the worst:",
            markdown_table(["", *others], exact),
        ]
    )


def machine(kinds):
    """What the numbers were measured on."""
    import jax

    names = [f"{len(jax.devices(k))} x {jax.devices(k)[0].device_kind}" for k in kinds]
    cores = f"{os.cpu_count()} cores of {host.machine()}"
    return f"jax {jax.__version__}; {', '.join(names)}; {cores}."


def one(bits, items, file):
    """Measures this process's device."""
    from firstorder import session

    session.start(x64=bits == "64", cache="off")
    print(json.dumps(measured(int(items), file)))


def main():
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=pathlib.Path, help="a Markdown file for the tables")
    parser.add_argument("--quick", action="store_true", help="small batches")
    options = parser.parse_args()
    os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # each process takes its part
    import jax

    kinds = dict.fromkeys(["cpu", jax.default_backend()])
    text = f"{machine(kinds)}\n\n{report(kinds, QUICK if options.quick else ITEMS)}\n"
    print(text)
    if options.out:
        options.out.write_text(text)


if __name__ == "__main__":
    if sys.argv[1:2] == [ONE]:
        one(*sys.argv[2:])
    else:
        main()
