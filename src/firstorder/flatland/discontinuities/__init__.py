"""Where derivatives of irradiance jump: visual events and critical lines."""
