"""Proofs of `firstorder.shadowfield.rendering`."""
