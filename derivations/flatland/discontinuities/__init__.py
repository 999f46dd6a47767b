"""Proofs of `firstorder.flatland.discontinuities`."""
