"""Proofs that belong to `firstorder.fields`."""
