"""The interface of a case, and the settings of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from . import workload
from .contenders import ANY, COALESCING, MAVPROXY, Contenders
from .results import Sample, Skip, Target
from .workload import QUARTER, Workload

QUICK = 10
SHORTEST = 0.4  # s
LEFT_OUT = (COALESCING, ANY, MAVPROXY)
"""Not measured in a quick run."""


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
        """The duration in seconds; a tenth of it in a quick run."""
        return max(SHORTEST, seconds / QUICK) if self.quick else seconds

    def number(self, full: int) -> int:
        """A number of repetitions; a tenth of it in a quick run."""
        return max(2, full // QUICK) if self.quick else full

    def programs(self, everyone: Iterable[str], skipped: list[Skip]) -> Iterator[str]:
        """The programs to measure, of those named. `skipped` receives those that are not installed."""
        return self.contenders.each([who for who in everyone if not (self.quick and who in LEFT_OUT)], skipped)

    def frames(self, vehicles: int = 1, traffic: Workload = QUARTER, *, in_step: bool = False) -> Path:
        """A file with the frames of this many vehicles, for a sender."""
        words = traffic.name.replace(" ", "-") + ("-in-step" if in_step else "")
        path = self.place / f"fleet-{vehicles}-{words}.frames"
        if not path.exists():
            workload.save(path, workload.fleet(vehicles, traffic, in_step=in_step))
        return path

    def distinct_frames(self) -> Path:
        """A file with frames of one vehicle, no two of them equal."""
        path = self.place / "distinct.frames"
        if not path.exists():
            workload.save(path, workload.distinct())
        return path


Found = Iterator[Sample | Skip]


class Case(NamedTuple):
    """One benchmark."""

    name: str
    title: str
    measure: Callable[[Bench], Found]
    """One round."""
    targets: tuple[Target, ...] = ()
