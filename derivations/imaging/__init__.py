"""Proofs of `firstorder.imaging`."""
