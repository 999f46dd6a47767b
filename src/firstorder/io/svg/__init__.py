"""Scenes of flatland from SVG drawings."""
