"""Whole images to files: tiles, passes, shadow rays through meshes."""
