"""Irradiance and its derivatives from rays: surface-area, stratified, triangulated forms."""
