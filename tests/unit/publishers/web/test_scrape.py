"""A request for metrics waits for the next round of the gateway."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest

from mav_robot_status.interface import Metrics
from mav_robot_status.publishers.metrics import CONTENT_TYPE
from mav_robot_status.publishers.web import scrape
from mav_robot_status.publishers.web.scrape import Scrapes

ASKED = cast("Any", None)
"""A request. Its content is not used."""


def test_all_waiting_requests_get_values_read_after_the_request() -> None:
    async def story() -> None:
        scrapes = Scrapes()
        assert not scrapes.wanted
        waiting = [asyncio.ensure_future(scrapes.answer(ASKED)) for _ in range(3)]
        await asyncio.sleep(0)
        assert scrapes.wanted
        scrapes.give(Metrics(record_dropped=7))
        for answer in await asyncio.gather(*waiting):
            assert answer.status == 200
            assert answer.kind == CONTENT_TYPE
            assert b"record_dropped_frames_total 7\n" in answer.body

    asyncio.run(story())


def test_a_stalled_gateway_gives_no_metrics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scrape, "PATIENCE", 0.02)

    async def story() -> None:
        scrapes = Scrapes()
        assert (await scrapes.answer(ASKED)).status == 503
        scrapes.give(Metrics())  # no request waits any more

    asyncio.run(story())
