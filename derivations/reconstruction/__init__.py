"""Proofs of `firstorder.reconstruction`."""
