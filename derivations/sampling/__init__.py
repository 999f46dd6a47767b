"""Proofs of `firstorder.sampling`."""
