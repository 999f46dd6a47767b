"""Proofs of `firstorder.transport.events`."""
