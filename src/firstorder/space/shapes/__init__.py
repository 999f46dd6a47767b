"""Shapes of space, each an affine image of a canonical one."""
