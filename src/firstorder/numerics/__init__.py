"""Tools of calculation: quadrature, roots, batches, vectors."""
