"""Lobes, and BRDFs made of them."""
