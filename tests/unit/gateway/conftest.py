from __future__ import annotations

from .third_party import installed

__all__ = ["installed"]
