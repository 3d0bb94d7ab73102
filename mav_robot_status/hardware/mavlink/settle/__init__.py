"""Settles the facts of a vehicle, from its state, the options and a `Moment`. Each fact has its own function."""

from .causes import faults
from .table import SETTLE, Settle, facts_of, fresh

__all__ = ["SETTLE", "Settle", "facts_of", "faults", "fresh"]
