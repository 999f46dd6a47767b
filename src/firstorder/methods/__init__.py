"""What the calculus buys."""
