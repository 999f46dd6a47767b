"""Proofs that belong to `firstorder.visibility`."""
