"""Proofs of `firstorder.transport.shading`."""
