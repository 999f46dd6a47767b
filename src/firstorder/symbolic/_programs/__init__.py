"""From programs to formulas and back: what JAX traces read in symbols, expressions run in JAX."""
