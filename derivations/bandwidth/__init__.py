"""Proofs of `firstorder.bandwidth`."""
