"""Cases of events whose law is a move or a warp."""
