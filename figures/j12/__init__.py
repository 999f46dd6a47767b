"""Figures of Jarosz et al. 2012."""
