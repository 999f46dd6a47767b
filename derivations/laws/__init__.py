"""Proofs that belong to `firstorder.laws`."""
