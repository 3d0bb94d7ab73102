"""Guards around third parties' parts: an exception stops the part that raised it, and nothing else."""

from __future__ import annotations

import logging
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, TypeVar

from ...errors import ConfigError, MavRobotStatusError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

log = logging.getLogger(__name__)

T = TypeVar("T")

FOR_THE_USER: Final = (MavRobotStatusError, BrokenPipeError)
"""Exceptions that a controller may pass on: an output failed permanently, the reader of standard output is gone."""


class Guard:
    """Calls the functions of one part. The first exception is logged; after it the part is not called again."""

    def __init__(self, what: str, through: tuple[type[Exception], ...] = FOR_THE_USER) -> None:
        self.what = what
        self.broken = False
        self._through = through

    def call(self, default: T, function: Callable[..., T], *arguments: object) -> T:
        """The result of the function; `default` after the first exception."""
        if self.broken:
            return default
        try:
            return function(*arguments)
        except self._through:
            raise
        except Exception:  # third-party code may raise anything
            self.broken = True
            log.exception("%s failed and is stopped; all other parts continue", self.what)
            return default


@contextmanager
def as_config_error(what: str) -> Iterator[None]:
    """Raise ConfigError for every exception of a third party's constructor."""
    try:
        yield
    except MavRobotStatusError:
        raise
    except Exception as error:  # third-party code may raise anything
        raise ConfigError(f"{what} cannot be made: {type(error).__name__}: {error}") from error
