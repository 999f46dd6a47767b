"""Proofs that belong to `firstorder.transport`."""
