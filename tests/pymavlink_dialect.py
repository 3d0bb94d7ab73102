"""The oracle: a pymavlink dialect of our messages, which pymavlink's own generator makes when a test first needs it.

`from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message`: each process makes its own, in a tenth of a
second, and leaves no file behind.
"""

from __future__ import annotations

import functools
import pathlib
import subprocess
import sys
import tempfile
from types import ModuleType
from typing import Any

GENERATOR = pathlib.Path(__file__).parents[1] / "dialects" / "generate_pymavlink.py"


@functools.cache
def dialect() -> ModuleType:
    """The generated module."""
    module = ModuleType("mav_robot_status_oracle")
    with tempfile.TemporaryDirectory() as folder:
        target = pathlib.Path(folder) / "used.py"
        command = [sys.executable, str(GENERATOR), str(target)]
        subprocess.run(command, check=True, capture_output=True, timeout=120)
        sys.modules[module.__name__] = module
        exec(compile(target.read_text(), target.name, "exec"), vars(module))
    return module


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    return getattr(dialect(), name)
