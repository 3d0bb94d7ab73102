"""The interface of a case, and the settings of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from . import workload
from .contenders import Contenders
from .results import Sample, Skip, Target


@dataclass(frozen=True)
class Bench:
    """The settings of a run."""

    place: Path
    """A folder for files."""
    contenders: Contenders
    quick: bool = False
    long: bool = False
    log: Path | None = None
    """A recorded log of the user."""

    def lasting(self, seconds: float) -> float:
        """The duration in seconds; a quarter of it in a quick run."""
        return seconds / 4 if self.quick else seconds

    def frames(self, vehicles: int = 1) -> Path:
        """A file with the frames of this many vehicles, for a sender."""
        path = self.place / f"fleet-{vehicles}.frames"
        if not path.exists():
            workload.save(path, workload.fleet(vehicles))
        return path


Found = Iterator[Sample | Skip]


class Case(NamedTuple):
    """One benchmark."""

    name: str
    title: str
    measure: Callable[[Bench], Found]
    """One round."""
    targets: tuple[Target, ...] = ()
