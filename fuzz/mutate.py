"""A plain mutator for machines without atheris. It is deterministic: a seed always gives the same inputs."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence

MOST_BYTES = 4096


def inputs(corpus: Sequence[bytes], tokens: Sequence[bytes], seed: int) -> Iterator[bytes]:
    """The corpus, then an endless sequence of mutations."""
    yield from corpus
    rng = random.Random(seed)
    while True:
        data = bytearray(rng.choice(corpus))
        for _ in range(rng.randrange(1, 6)):
            _mutate(data, rng, corpus, tokens)
        yield bytes(data[:MOST_BYTES])


def _mutate(data: bytearray, rng: random.Random, corpus: Sequence[bytes], tokens: Sequence[bytes]) -> None:
    at = rng.randrange(len(data) + 1)
    end = min(len(data), at + rng.randrange(1, 32))
    kind = rng.randrange(6)
    if kind == 0 and data:
        data[at - 1] ^= 1 << rng.randrange(8)
    elif kind == 1:
        del data[at:end]
    elif kind == 2:
        data[at:at] = data[at:end]
    elif kind == 3:
        data[at:at] = rng.choice(tokens) if tokens else rng.randbytes(4)
    elif kind == 4:
        other = rng.choice(corpus)
        start = rng.randrange(len(other) + 1)
        data[at:end] = other[start : start + rng.randrange(1, 64)]
    else:
        data[at:end] = rng.randbytes(end - at)
