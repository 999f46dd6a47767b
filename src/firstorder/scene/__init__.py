"""What scenes of both worlds share: primitives, intersection, the geometry term."""
