"""A status while two vehicles use the ids and cannot be told apart: nothing is known."""

from __future__ import annotations

from typing import Final

from .reason import Reason, Source

CLAIMED: Final = Reason("another sender claims the ids of this vehicle", Source.CLAIMS)
