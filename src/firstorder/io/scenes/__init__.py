"""Scene files in TOML, of flatland and of space."""
