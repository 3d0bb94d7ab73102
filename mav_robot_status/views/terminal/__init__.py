"""`watch`: a live table in the terminal. `render` makes lines of a state, rich paints them, `show` turns the loop."""

from .show import show

__all__ = ["show"]
