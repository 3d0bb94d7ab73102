"""`watch`: a live table in the terminal. `render` turns a state into lines, rich adds colours, `show` runs the loop."""

from .show import show

__all__ = ["show"]
