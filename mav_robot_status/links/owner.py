"""The process that has a port or a device open, if /proc shows it to this user. For messages only; does not raise."""

from __future__ import annotations

import os
from contextlib import suppress

_HOLDS = {"udp": "07", "tcp": "0A"}
"""The state of a bound socket in the tables of /proc/net: unconnected for UDP, LISTEN for TCP."""


def port_owner(port: int, protocol: str) -> str:
    """The process that has a `udp` or `tcp` port: `mavproxy.py (pid 1234)`; empty if /proc does not show it."""
    tables = (f"/proc/net/{protocol}", f"/proc/net/{protocol}6")
    return _owner({f"socket:[{inode}]" for table in tables for inode in _inodes(table, port, _HOLDS[protocol])})


def device_owner(device: str) -> str:
    """The process that has a device open: `mavproxy.py (pid 1234)`; empty if no process has it or /proc hides it."""
    return _owner({os.path.realpath(device)})


def _owner(files: set[str]) -> str:
    """The first process that has one of these files open."""
    import glob  # only for this message

    for link in glob.iglob("/proc/[0-9]*/fd/*") if files else ():
        with suppress(OSError):  # the process has ended, or belongs to another user
            if os.readlink(link) in files:
                pid = link.split("/")[2]
                with open(f"/proc/{pid}/comm", encoding="utf-8", errors="replace") as comm:
                    return f"{comm.read().strip()} (pid {pid})"
    return ""


def _inodes(table: str, port: int, state: str) -> list[str]:
    """The inodes of the sockets bound to a port. A row in /proc/net is `sl address:PORT remote STATE ... inode`."""
    with suppress(OSError, IndexError), open(table, encoding="ascii", errors="replace") as lines:
        rows = [line.split() for line in lines][1:]
        return [row[9] for row in rows if row[1].endswith(f":{port:04X}") and row[3] == state]
    return []
