"""Proofs of `firstorder.space.silhouettes`."""
