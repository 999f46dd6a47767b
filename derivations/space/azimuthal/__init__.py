"""Proofs of `firstorder.space.azimuthal`."""
