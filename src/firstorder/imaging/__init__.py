"""Images in space: camera, surfaces that are hit, shading under near and distant lights."""
