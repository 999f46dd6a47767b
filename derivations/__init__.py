"""Proofs: one runnable module per topic, gathered by `python -m derivations`."""
