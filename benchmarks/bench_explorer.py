"""The explorer: from nothing to its first picture, to all of them, and from one to the next.

In a process of its own without a compilation cache. The first picture is the scene, whose numbers
need no program; each of the others is waited for, and the page says so before.
"""

import json
import os
import pathlib
import subprocess
import sys

FOLDER = pathlib.Path(__file__).parents[1] / "notebooks"

PROGRAM = """
import json, sys, time
begin = time.perf_counter()
sys.path.insert(0, {folder!r})
from firstorder import session
session.start()
from flatland_explorer.widget import Explorer

page, count = Explorer(), 0

def order(do, **more):
    global count
    count += 1
    start = time.perf_counter()
    page.asked = {{"n": count, "do": do, **more}}
    return time.perf_counter() - start

found = {{"the scene, from nothing": time.perf_counter() - begin}}
while page.shown["todo"]:
    name = page.shown["todo"][0]
    found[name + ", compiled"] = order("go on")
found["everything, from nothing"] = time.perf_counter() - begin
moves = [order("move", handle="2.body", to=[0.01 * k, 0.6]) for k in range(30)]
found["redraw, best"], found["redraw, median"] = min(moves), sorted(moves)[15]
print(json.dumps(found))
"""


def test_first_picture_and_redraws():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(folder=str(FOLDER))],
        capture_output=True,
        text=True,
        env=os.environ | {"FIRSTORDER_CACHE": "off"},
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for name, seconds in found.items():
        print(f"{name:28s} {1000.0 * seconds:8.0f} ms")
    assert found["the scene, from nothing"] < 5.0
    assert found["redraw, best"] < 0.1
