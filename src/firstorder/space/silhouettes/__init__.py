"""Silhouettes of shapes and meshes, what is visible of them, and integrals along them."""
