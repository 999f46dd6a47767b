"""Scene files of things that wear something, for tests of several readers of them."""

import numpy as np

START = """dimensions = 3
[[shape]]
kind = "sphere"
center = [0, 0, 0.6]
radius = 0.5
albedo = 0.6
name = "ball"
"""
REST = """
[[shape]]
kind = "rectangle"
center = [0, 0, 0]
u = [2, 0, 0]
v = [0, 2, 0]
albedo = 0.4
[[shape]]
kind = "rectangle"
center = [0, 0, 3]
u = [0, 0.4, 0]
v = [0.4, 0, 0]
emission = 5.0
[camera]
eye = [0, -3, 2]
look_at = [0, 0, 0.3]
gamma = 1.5
"""
WAVES = "waves = [[9.0, 1.0, 0.0], [0.0, 8.0, 3.0]]\norigin = [0.1, 0.0, 0.2]"
PICTURES = """
[[shape]]
kind = "rectangle"
center = [0, 0, 0]
u = [1, 0, 0]
v = [0, 1, 0]
albedo = 0.8
[shape.texture]
kind = "picture"
{}
hold = true
[[mesh]]
vertices = [[2, -1, 0], [4, -1, 0], [4, 1, 0], [2, 1, 0]]
faces = [[0, 1, 2], [0, 2, 3]]
uv = [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]
albedo = 0.8
[mesh.texture]
kind = "picture"
{}
hold = true
[environment]
kind = "constant"
radiance = 1.0
[camera]
eye = [1.5, 0, 3]
look_at = [1.5, 0, 0]
up = [0, 1, 0]
gamma = 1.0
"""
TEXELS = np.array([[0.25, 0.5, 0.75], [1.0, 0.125, 0.375]])
INLINE = f"values = {TEXELS.tolist()}"
