"""Chains of events in the four coordinates of a ray in space."""
