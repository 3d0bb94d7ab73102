"""Files of the user who runs the program: secrets that nobody else can read, and folders for state and cache."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

from .errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping

OF_OTHERS: Final = 0o066
"""The permissions of others to read or change a file."""


def read_secret(path: str | os.PathLike[str], what: str, most: int) -> tuple[str, bytes]:
    """The full name of a file, and its first `most` bytes. `what` names the secret in messages.

    Raises UsageError if others can read or change it, or it cannot be read; the message never shows the contents.
    """
    name = os.path.expanduser(path)
    try:
        with open(name, "rb") as file:
            if os.fstat(file.fileno()).st_mode & OF_OTHERS:
                raise UsageError(f"{name}: other users can read or change this {what}: chmod 600 {name}")
            return os.fspath(name), file.read(most)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise UsageError(f"{name}: cannot read the {what}: {reason}") from None


def state_folder(environment: Mapping[str, str] = os.environ) -> str:
    """Where state is kept: systemd's STATE_DIRECTORY, or the user's state folder."""
    return _folder(environment, "STATE_DIRECTORY", "XDG_STATE_HOME", "~/.local/state")


def cache_folder(environment: Mapping[str, str] = os.environ) -> str:
    """The same for what can be fetched again."""
    return _folder(environment, "CACHE_DIRECTORY", "XDG_CACHE_HOME", "~/.cache")


def _folder(environment: Mapping[str, str], of_systemd: str, of_user: str, default: str) -> str:
    home = environment.get(of_user, "")
    if not os.path.isabs(home):  # a relative path is invalid: https://specifications.freedesktop.org/basedir-spec
        home = os.path.expanduser(default)
    folder = environment.get(of_systemd, "").split(":")[0] or os.path.join(home, "mav-robot-status")
    return os.path.join("/", folder)  # never relative to the current folder, if the home is unknown
