"""A link that loses, repeats and reorders what passes, reproducibly from a seed."""

from __future__ import annotations

import random
from collections.abc import Iterable
from typing import Generic, NamedTuple, TypeVar

T = TypeVar("T")


class Lossy(NamedTuple):
    """How bad a link is: each a probability."""

    loss: float = 0.0
    duplication: float = 0.0
    reordering: float = 0.0
    """What is reordered passes with the next group."""
    seed: int = 0


class LossyLink(Generic[T]):
    """One direction of a link."""

    def __init__(self, quality: Lossy) -> None:
        self._quality = quality
        self._random = random.Random(quality.seed)
        self._held: list[T] = []

    def carry(self, group: Iterable[T]) -> list[T]:
        """What arrives from this group, and what was held back from the one before."""
        quality, late = self._quality, self._held
        passed: list[T] = []
        self._held = []
        for one in group:
            if self._random.random() < quality.loss:
                continue
            for _ in range(2 if self._random.random() < quality.duplication else 1):
                (self._held if self._random.random() < quality.reordering else passed).append(one)
        return passed + late
