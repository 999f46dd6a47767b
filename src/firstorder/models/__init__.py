"""Procedural models: primitives, blobs, knots, plants."""
