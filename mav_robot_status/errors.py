"""The errors that a user can act on. Each message says in one line what is wrong, where, and what is expected.

A peer never causes one of these, but a ProtocolError, which no user sees: it becomes a line of the log.
"""

from __future__ import annotations


class MavRobotStatusError(Exception):
    """The base class: `cli` prints it as one line and exits with `exit_code`."""

    exit_code = 1


class LinkError(MavRobotStatusError):
    """A link or an output failed permanently: a port is in use, a permission is missing."""


class NothingHeardError(MavRobotStatusError):
    """A command needs a vehicle, and no heartbeat was received."""


class UsageError(MavRobotStatusError):
    """An error in the command line, a connection string or an option; a missing log file."""

    exit_code = 2


class ConfigError(UsageError):
    """An error in the configuration. The message starts with `file:line:column:` if there is a file."""


class UnknownHandleError(MavRobotStatusError):
    """No handle has this name. The message lists the registered names."""

    exit_code = 2


class ProtocolError(Exception):
    """A peer does not speak its protocol as expected. The text says why; the connection is of no use any more."""
