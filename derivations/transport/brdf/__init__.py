"""Proofs of `firstorder.transport.brdf`."""
