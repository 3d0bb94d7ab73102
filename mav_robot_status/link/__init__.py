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
    """Open a live link. Raises LinkError if it cannot be opened, UsageError if this version cannot open such a link."""
    if url.kind == "log":
        raise UsageError(
            f"{url.text!r} is a recorded log, which can only be read; write for example udp:127.0.0.1:14550"
        )
    opener = BY_NAME[url.kind].opener
    if opener is None:
        there_are = ", ".join(kind.name for kind in BY_NAME.values() if kind.opener)
        raise UsageError(
            f"{url.text!r}: {url.kind} connections are not available in this version; there are {there_are}"
        )
    module, _, name = opener.partition(":")
    link: Link = getattr(importlib.import_module(module), name)(url)
    return link
