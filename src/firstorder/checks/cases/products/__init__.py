"""Cases of events whose law is a product, integrated or not."""
