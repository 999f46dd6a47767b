"""Derivations for space: one module per topic, mirroring `firstorder.space`."""
