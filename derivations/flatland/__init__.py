"""Derivations for flatland: one module per topic, mirroring `firstorder.flatland`."""
