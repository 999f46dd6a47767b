"""The notebook of events of one's own: what is typed is drawn, fast and rightly, or told in words.

In a process of its own: a notebook decides about precision for itself.
"""

import json
import pathlib
import subprocess
import sys

import numpy as np

from tests.machine import slower

FOLDER = pathlib.Path(__file__).parents[1] / "notebooks"

HEAD = """
import json, sys, time
sys.path.insert(0, {folder!r})
import bring_your_own_event as notebook
import numpy as np

KINDS = "rays", "factor", "lobe", "numbers"

def typed(rays="", factor="", lobe="", numbers=""):
    return notebook.answer(dict(rays=rays, factor=factor, lobe=lobe, numbers=numbers))

def started(name):
    return notebook.answer(dict(zip(KINDS, notebook.STARTS[name])), name)

def run(built):
    return notebook.app.run(defs={{"size": 48, "built": built}})
"""

DRAWN = """
for name in notebook.STARTS:
    built = started(name)
    outputs, defs = run(built)
    png, key = defs["png"], next(iter(built.ranges))
    low, at, high = built.ranges[key]
    pictures = [png(built.start | {key: v}, (0.3, -0.2))[0] for v in (low, at, high)]
    pictures.append(png(built.start, (0.1, -0.2))[0])
    pictures.append(png(built.start, (0.3, 0.1))[0])
    assert len(set(pictures)) == 5, (name, "a slider changes nothing")
    assert all(p[1:4] == b"PNG" for p in pictures)
    assert any(out is not None for out in outputs)
    assert built.formula().startswith("**"), name

    def cost(k):
        begin = time.process_time(), time.perf_counter()
        png(built.start | {key: at + 0.001 * k * (high - at)}, (0.3 + 0.01 * k, -0.2))
        return time.process_time() - begin[0], time.perf_counter() - begin[1]

    seconds, elapsed = min(cost(k) for k in range(15))
    jet = png(built.start, (0.3, -0.2))[2]
    numbers = [jet.value, *jet.gradient, *jet.hessian.ravel()]
    found = seconds, elapsed, notebook.spectrum_is_closed(built), list(map(float, numbers))
    print(json.dumps([name, *found]))
"""

TOLD = """
told = {
    "no expression": typed("theta: theta -", "", "", ""),
    "code": typed("", "__import__('os').getcwd()", "", ""),
    "a fold": typed("theta: theta**2 + x"),
    "no number": typed("theta: theta - x / f"),
    "two things": typed("theta: theta", "", "cos(t)"),
    "nothing": typed(),
    "no colon": typed("theta - x"),
    "no coordinate": typed("y: 2 * y"),
    "no range": typed("", "s", "", "s: 1"),
    "a range that falls": typed("", "s", "", "s: 2 .. 1 .. 0"),
    "a number called x": typed("", "x", "", "x: 0 .. 1 .. 2"),
    "both kinds of angle": typed("theta: theta - v"),
    "a kink": typed("", "", "1 / (1 + abs(t))"),
}
assert {k: v for k, v in told.items() if not isinstance(v, str)} == {}
print(json.dumps(told))
lens = started("thin lens")
report = notebook.judged(lens)
print(json.dumps([str(report), report.sound]))
print(json.dumps(started("thin lens").formula()))
bent = typed("theta: theta - x / f - x**3", "1 + x**2", "", "f: 0.4 .. 0.8 .. 3")
_, defs = run(bent)
value = float(defs["png"](bent.start, (0.3, -0.2))[2].value)
print(json.dumps([value, notebook.spectrum_is_closed(bent)]))
"""


def lines(program):
    program = HEAD.format(folder=str(FOLDER)) + program
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def bell(x, a):
    """The notebook's light, in double precision."""
    S = np.array([[0.45**2, 0.35 * 0.45 * 0.28], [0.35 * 0.45 * 0.28, 0.28**2]])
    P = np.linalg.inv(S)
    h, k = x - 0.1, a + 0.05
    return np.exp(-0.5 * (P[0, 0] * h**2 + 2.0 * P[0, 1] * h * k + P[1, 1] * k**2))


def satin(x, a):
    t, w = np.polynomial.legendre.leggauss(200)
    t, w = 0.5 * np.pi * t, 0.5 * np.pi * w
    return np.sum(w * np.cos(t) ** 8 * (1.0 + 0.3 * t**2) * bell(x, a - t))


AFTER = {
    "thin lens": lambda x, a: bell(x, a + x / 0.8),
    "haze": lambda x, a: np.exp(-0.6 / np.cos(a)) * bell(x, a),
    "satin lobe": satin,
    "flat interface": lambda x, a: bell(x, np.arcsin(1.5 * np.sin(a))),
    "moving blocker": lambda x, a: bell(x, a) / (1.0 + np.exp((x - 0.7 * a - 0.1) / 0.1)),
}


def differences(f, x, a, h=1e-3):
    """Value, gradient and Hessian by central differences."""
    fx = (f(x + h, a) - f(x - h, a)) / (2 * h)
    fa = (f(x, a + h) - f(x, a - h)) / (2 * h)
    fxx = (f(x + h, a) - 2 * f(x, a) + f(x - h, a)) / h**2
    faa = (f(x, a + h) - 2 * f(x, a) + f(x, a - h)) / h**2
    fxa = (f(x + h, a + h) - f(x + h, a - h) - f(x - h, a + h) + f(x - h, a - h)) / (4 * h**2)
    return np.array([f(x, a), fx, fa, fxx, fxa, fxa, faa])


def test_every_starting_point_is_drawn_rightly_within_a_tenth_of_a_second():
    drawn = lines(DRAWN)
    assert [name for name, *_ in drawn] == list(AFTER)
    closed = {name for name, _, _, is_closed, _ in drawn if is_closed}
    assert closed == {"thin lens", "satin lobe"}
    bound = 0.1 * slower()
    for name, seconds, elapsed, _, numbers in drawn:
        # Processor time, summed over threads: other processes on the machine do not enter.
        assert seconds < bound, f"{name}: {seconds:.3f} s of processor time, {elapsed:.3f} s in all"
        true = differences(AFTER[name], 0.3, -0.2)
        # Differences of fourth order in h, and single precision in the notebook.
        np.testing.assert_allclose(numbers, true, rtol=1e-3, atol=2e-4 * np.max(np.abs(true)))


def test_what_is_no_event_is_told_in_a_sentence_and_what_is_one_is_judged():
    told, (report, sound), formula, (value, closed) = lines(TOLD)
    assert all(words.endswith(".") for words in told.values()), told
    assert all("Error" not in words and "\n" not in words for words in told.values()), told
    assert "is no expression" in told["no expression"]
    assert "is no part of an expression that is known here" in told["code"]
    assert "type a map of rays, a factor or a lobe" in told["nothing"]
    assert "folds near" in told["a fold"]
    assert "'f' is unknown: the names here are x, theta, v" in told["no number"]
    assert "A lobe stands alone" in told["two things"]
    assert "must have no kink" in told["a kink"]
    assert sound, report
    assert "spectrum   equal" in report
    assert r"\theta + \frac{x}{f}" in formula  # symbols, and not the sliders' numbers
    np.testing.assert_allclose(value, 1.09 * bell(0.3, -0.2 + 0.3 / 0.8 + 0.027), rtol=1e-5)
    assert not closed
