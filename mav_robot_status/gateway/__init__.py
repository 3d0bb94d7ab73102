"""Builds the parts and turns the loop: `plant` is the part without I/O, `live` and `replay` feed it."""
