"""Figures of Ramamoorthi, Mahajan and Belhumeur 2007."""
