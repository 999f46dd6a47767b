"""Proofs of `firstorder.flatland.estimators`."""
