"""The configuration: plain values (`Config` and its parts). `load` reads YAML, `describe` explains a configuration.

YAML is imported only when a file is read.
"""

from __future__ import annotations

import os

from .model import (
    Config,
    ControllerConfig,
    GroupConfig,
    HardwareConfig,
    IdentityConfig,
    LinkConfig,
    PublisherConfig,
    SigningConfig,
    VehicleConfig,
)

__all__ = [
    "Config",
    "ControllerConfig",
    "GroupConfig",
    "HardwareConfig",
    "IdentityConfig",
    "LinkConfig",
    "PublisherConfig",
    "SigningConfig",
    "VehicleConfig",
    "describe",
    "load",
]


def load(path: str | os.PathLike[str]) -> Config:
    """Read and check a configuration file.

    Raises ConfigError: `file:line:column: what is wrong and what would be right`.
    """
    from .reader import load

    return load(path)


def describe(config: Config) -> list[str]:
    """What a configuration means, one line per part."""
    from .description import describe

    return describe(config)
