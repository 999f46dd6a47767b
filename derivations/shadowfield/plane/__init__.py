"""Proofs of `firstorder.shadowfield.plane`."""
