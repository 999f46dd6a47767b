"""Methods that E11 compares itself with; only its figures use them."""
