"""Irradiance caching: what a record's region stands for, along a line and on a plane."""
