"""Shadow rays that one program traces and writes, and another one reads and filters."""

import pathlib
import tempfile

import numpy as np

from firstorder import io, session, shadowfield
from firstorder.space import Scene, box, primitive

session.start()
scene = Scene.of(primitive(box((-9.0, -9.0, 1.0), (0.0, 9.0, 1.01))))  # a sheet over x < 0
lamp = shadowfield.lamp_frame((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
x = np.linspace(-1.0, 1.0, 400)
floor = np.column_stack([x, 0.0 * x, 0.0 * x])
table, _ = shadowfield.trace_shadow_rays(lamp, floor, 16, shadowfield.scene_blockers(scene))
file = pathlib.Path(tempfile.mkdtemp(), "sheet.rays")
io.write_rays(file, lamp, table)

lamp, table = io.read_rays(file)
at = np.column_stack([np.linspace(-0.6, 0.6, 5), np.zeros((5, 2))])
found = shadowfield.sheared_shadow(lamp, table, at, 8.0, 0.005, np.zeros(5))
print("bytes", file.stat().st_size, "for rays", len(table.near))
print("x", at[:, 0])
print("share of the lamp", found.visible)
