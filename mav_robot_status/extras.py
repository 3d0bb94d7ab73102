"""The command that installs a missing extra where this program runs."""

from __future__ import annotations

import re
import shlex
import sys
from importlib.metadata import PackageNotFoundError, requires
from pathlib import PurePath

NAME = "mav-robot-status"


def install(*extras: str) -> str:
    """A command that works in any shell as it is: that of this environment's pip, or pipx inject."""
    if PurePath(sys.prefix).parts[-3:-1] == ("pipx", "venvs"):
        return f"pipx inject {NAME} {' '.join(dict.fromkeys(one for extra in extras for one in packages(extra)))}"
    return f"{shlex.quote(sys.executable)} -m pip install '{NAME}[{','.join(extras)}]'"


def packages(extra: str) -> list[str]:
    """The packages of an extra: `tornado`. The name of the extra, if this program is not installed."""
    try:
        found = requires(NAME) or []
    except PackageNotFoundError:
        return [extra]
    names = (re.match(r"[\w.-]+", one) for one in found if re.search(rf"extra == ['\"]{re.escape(extra)}['\"]", one))
    return [name[0] for name in names if name]
