"""Figures of Durand et al. 2005."""
