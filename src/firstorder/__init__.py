"""The calculus of light."""
