"""The fuzz targets pass on their corpus and on inputs of hypothesis, and they fail on a defect."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fuzz.targets
from fuzz.mutate import MOST_BYTES, inputs
from fuzz.targets import TARGETS
from mav_robot_status.mavlink.framing import Parser

CORPUS = Path(fuzz.targets.__file__).parent / "corpus"


@pytest.mark.parametrize("name", TARGETS)
def test_every_target_accepts_its_corpus_and_mutations_of_it(name: str) -> None:
    corpus = [path.read_bytes() for path in sorted((CORPUS / name).iterdir())]
    assert corpus
    for data in itertools.islice(inputs(corpus, (), 3), 40):
        assert TARGETS[name](data) > 0


@pytest.mark.parametrize("name", TARGETS)
@settings(max_examples=40)
@given(data=st.binary(max_size=600))
def test_every_target_accepts_any_bytes(name: str, data: bytes) -> None:
    assert TARGETS[name](data) > 0


def test_the_mutator_returns_bounded_inputs_that_are_reproducible_from_a_seed() -> None:
    corpus = [b"abc" * 500, b"\xfd\x00"]
    first = list(itertools.islice(inputs(corpus, (b"word",), 1), 500))
    assert first == list(itertools.islice(inputs(corpus, (b"word",), 1), 500))
    assert first != list(itertools.islice(inputs(corpus, (b"word",), 2), 500))
    assert max(map(len, first)) <= MOST_BYTES


def test_a_parser_that_grows_without_bound_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Parser, "pending", 281)
    with pytest.raises(AssertionError):
        TARGETS["framing"](b"any")
