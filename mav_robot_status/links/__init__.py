"""Bytes in and out. `url` reads a connection string; each kind of link is a module, imported when a link is opened.

A link of another package needs only what this module exports.
"""

from __future__ import annotations

from mav_robot_status.errors import LinkError, UsageError
from mav_robot_status.links.base import Address, Link, Received
from mav_robot_status.links.kind import LinkKind, Url

__all__ = ["Address", "Link", "LinkError", "LinkKind", "Received", "Url", "UsageError", "open_link"]


def open_link(url: Url) -> Link:
    """Open a live link. Raises LinkError if it cannot be opened, UsageError for a recorded log."""
    return url.kind.open(url)
