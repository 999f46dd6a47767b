"""Irradiance caching in flatland: what a record's radius stands for."""
