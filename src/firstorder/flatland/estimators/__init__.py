"""Irradiance and its derivatives from rays: arc-length and stratified forms."""
