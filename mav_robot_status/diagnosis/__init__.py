"""Explains the value of each field, and why there is no status."""
