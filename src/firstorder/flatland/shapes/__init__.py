"""Shapes of flatland: segments, arcs, circles, ellipses, smooth closed curves."""
