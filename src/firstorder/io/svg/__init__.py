"""Drawings as scenes."""
