"""The errors that a person can act on. Each message says in one line what, where, and what would be right.

Nothing that a peer sends ends up here: bad frames are counted.
"""

from __future__ import annotations


class MavRobotStatusError(Exception):
    """The root: `cli` prints it as one line and exits with `exit_code`."""

    exit_code = 1


class LinkError(MavRobotStatusError):
    """A link or an output failed for good: a port is taken, a permission is missing."""


class NothingHeardError(MavRobotStatusError):
    """A question about a vehicle, and none was heard."""


class UsageError(MavRobotStatusError):
    """The command line, a connection string, a missing log file."""

    exit_code = 2


class ConfigError(UsageError):
    """The configuration; the message starts with `file:line:column:` where there is a file."""


class UnknownHandleError(MavRobotStatusError):
    """A name under which no handle is registered; the message lists the names there are."""

    exit_code = 2
