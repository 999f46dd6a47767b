"""Proofs of `firstorder.space.estimators`."""
