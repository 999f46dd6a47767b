"""BRDFs: lobes of one angle difference, and general functions of two angles."""
