"""Proofs of `firstorder.space.discontinuities`."""
