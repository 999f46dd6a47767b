"""Proofs that belong to `firstorder.methods`."""
