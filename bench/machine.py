"""The machine and the versions of a run."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import mav_robot_status

PACKAGES: Final = ("pymavlink", "fastcrc")


def machine() -> dict[str, Any]:
    """CPU, cores, kernel, Python and load."""
    found = re.search(r"(?:model name|Model)\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return {
        "cpu": found[1] if found else platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "kernel": platform.release(),
        "python": platform.python_version(),
        "executable": sys.executable,
        "load": round(os.getloadavg()[0], 1),
    }


def versions() -> dict[str, str]:
    """The versions of our package and of the other Python packages."""
    found = {"mav-robot-status": mav_robot_status.__version__}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
