"""Sheared filtering of shadows in space, from shared rays."""
