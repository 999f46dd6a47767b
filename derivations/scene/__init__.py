"""Derivations for what scenes of both worlds share, mirroring `firstorder.scene`."""
