"""Proofs of `firstorder.transport.chain4d`."""
