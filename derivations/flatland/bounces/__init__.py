"""Proofs of `firstorder.flatland.bounces`."""
