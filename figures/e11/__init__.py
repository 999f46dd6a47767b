"""Figures of Egan et al. 2011."""
