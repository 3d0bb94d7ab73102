"""Bytes in and out. What a connection string means is in `url`; each kind of link is a module, imported when opened."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from mav_robot_status.errors import UsageError
from mav_robot_status.link.url import BY_NAME, Url

if TYPE_CHECKING:
    from mav_robot_status.link.base import Link

__all__ = ["open_link"]


def open_link(url: Url) -> Link:
    """Open a live link. Raises LinkError if it cannot be opened, UsageError for a recorded log."""
    if url.kind == "log":
        raise UsageError(
            f"{url.text!r} is a recorded log, which can only be read; write for example udp:127.0.0.1:14550"
        )
    module, _, name = BY_NAME[url.kind].opener.partition(":")
    link: Link = getattr(importlib.import_module(f"{__name__}.{module}"), name)(url)
    return link
