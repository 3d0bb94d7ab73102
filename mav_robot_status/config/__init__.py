"""The configuration: plain values (`Config` and its parts), read from YAML by `load`, put in words by `describe`.

YAML is imported when a file is read and not before: most runs have none.
"""

from __future__ import annotations

import os

from .model import Config, ControllerConfig, IdentityConfig, LinkConfig, PublisherConfig, SigningConfig, VehicleConfig

__all__ = [
    "Config",
    "ControllerConfig",
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
    """What a configuration means, in words, a line for each part."""
    from .words import describe

    return describe(config)
