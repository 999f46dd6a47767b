"""Cases of laws that act on the light of a scene of flatland."""
