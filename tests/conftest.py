"""The number of parallel tests, and hypothesis settings for a busy machine."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # else every command that a test starts compiles the package again

PER_CORE = 3
"""Workers for each core: most system tests wait for another process."""

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int | None:
    """Workers for `-n auto`. None, which leaves the choice to xdist, if PYTEST_XDIST_AUTO_NUM_WORKERS is set."""
    return None if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ else PER_CORE * (os.cpu_count() or 1)
