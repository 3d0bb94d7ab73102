"""Judges the status of a recording that a bad link has damaged: by the ground truth, and by the undamaged status.

Not counted: checkpoints in a silence that the undamaged recording has not. Excused for a while (`BadLink.excused`): an
answer that was true, because news is late or lost. Never excused: calling a vehicle safe after an arming that got
through.
"""

from __future__ import annotations

import bisect
import functools
import json
import math
import pathlib
import tempfile
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from mav_robot_status.mavlink.definitions import CommandAck, Heartbeat

from .bad_links import BAD_LINKS, SECOND, UNTIL_LOST, Records, damaged, read, written
from .replays import Judgement, Lines, answer, judgements, lines_of_vehicle

SILENCE: Final = 0.5  # s
BURST: Final = 0.002  # s
SOON: Final = 0.1  # s
LOST_AFTER: Final = 3.5  # s without a HEARTBEAT
ARMED: Final = 128  # MAV_MODE_FLAG_SAFETY_ARMED
ARM_DISARM: Final = 400  # MAV_CMD_COMPONENT_ARM_DISARM
SAFE: Final = (("drives_powered", False), ("motion_possible", False), ("e_stopped", True))
"""The answers that call a vehicle safe."""


class Heard(NamedTuple):
    """What arrived of one vehicle, in order. Unix seconds."""

    arrivals: list[float]
    heartbeats: list[tuple[float, float, bool]]
    """When each arrived and was sent, and whether it says armed."""
    accepted: list[tuple[float, float]]
    """When each accepted command to arm or disarm arrived and was sent."""

    def is_silent(self, t: float) -> bool:
        """Whether nothing has arrived for a while."""
        return _newest(self.arrivals, t) <= t - SILENCE

    def is_lost(self, t: float) -> bool:
        """Whether no HEARTBEAT has arrived for so long that LOST is true."""
        return not any(t - LOST_AFTER <= arrival <= t for arrival, _, _ in self.heartbeats)

    def is_armed(self, t: float) -> bool:
        """What the last HEARTBEAT says."""
        return next((armed for arrival, _, armed in reversed(self.heartbeats) if arrival <= t), False)

    def last_arming(self, t: float) -> tuple[float, float]:
        """When the last HEARTBEAT before the last arming was sent, and the first one after it."""
        pairs = zip(self.heartbeats, self.heartbeats[1:], strict=False)
        armings = [(b[1], a[1]) for b, a in pairs if a[1] <= t and a[2] and not b[2]]
        return armings[-1] if armings else (0.0, 0.0)

    def is_told(self, after: float, t: float) -> bool:
        """Whether something that was sent after a time, and has arrived, says that the vehicle is armed."""
        armed = [(arrival, sent) for arrival, sent, armed in self.heartbeats if armed]
        return any(arrival <= t and sent > after for arrival, sent in (*armed, *self.accepted))


def heard(records: Records, ids: tuple[int, int]) -> Heard:
    """What arrived of the vehicle with these ids."""
    found = Heard([], [], [])
    for arrival_us, frame in records:
        if frame.ids != ids:
            continue
        arrival, sent, message = arrival_us / SECOND, frame.stamp / SECOND, frame.message
        found.arrivals.append(arrival)
        if isinstance(message, Heartbeat):
            found.heartbeats.append((arrival, sent, bool(message.base_mode & ARMED)))
        elif isinstance(message, CommandAck) and (message.command, message.result) == (ARM_DISARM, 0):
            found.accepted.append((arrival, sent))
    return found


def _newest(times: list[float], t: float) -> float:
    """The newest one at a time."""
    i = bisect.bisect_right(times, t)
    return times[i - 1] if i else 0.0


class Verdicts(NamedTuple):
    """The verdicts on the status of damaged recordings."""

    checkpoints: int = 0
    """The number of checkpoints that count."""
    right: int = 0
    right_undamaged: int = 0
    """How many of the same checkpoints are right in the undamaged recordings."""
    wrong: tuple[Judgement, ...] = ()
    """WRONG, not excused, and not WRONG in the undamaged recording."""
    safe: tuple[Judgement, ...] = ()
    """Those of them that call a live vehicle safe."""
    safe_lines: int = 0
    """Lines of the status that do so, at checkpoints or not, see `Damaged.safe_lines`."""

    def plus(self, other: Verdicts) -> Verdicts:
        """The sum."""
        return Verdicts(
            self.checkpoints + other.checkpoints,
            self.right + other.right,
            self.right_undamaged + other.right_undamaged,
            self.wrong + other.wrong,
            self.safe + other.safe,
            self.safe_lines + other.safe_lines,
        )


class Recording:
    """A recording, and its ground truth if it has one."""

    def __init__(self, log: pathlib.Path) -> None:
        self.log = log
        truth_file = log.with_suffix(".truth.json")
        truth = json.loads(truth_file.read_text(encoding="utf-8")) if truth_file.exists() else {}
        self.ids: tuple[int, int] = truth.get("system", 1), truth.get("component", 1)
        self.points: list[dict[str, Any]] = truth.get("checkpoints", [])

    @functools.cached_property
    def records(self) -> Records:
        """The undamaged records."""
        return read(self.log)

    @functools.cached_property
    def heard(self) -> Heard:
        """What arrives of the vehicle without damage."""
        return heard(self.records, self.ids)

    @functools.cached_property
    def lines(self) -> Lines:
        """The status without damage."""
        return lines_of_vehicle(self.log, self.ids)

    @functools.cached_property
    def judged(self) -> dict[tuple[int, str], Judgement]:
        """The verdicts without damage."""
        return _by_checkpoint(judgements(self.points, self.lines))

    def over(self, name: str) -> Damaged:
        """The recording as it arrives over the bad link of this name."""
        records = damaged(self.records, name, self.log.name)
        with tempfile.NamedTemporaryFile(suffix=".tlog") as file:
            file.write(written(records))
            file.flush()
            lines = lines_of_vehicle(pathlib.Path(file.name), self.ids)
        return Damaged(self, heard(records, self.ids), lines, BAD_LINKS[name].excused)


class Damaged(NamedTuple):
    """A damaged recording."""

    undamaged: Recording
    heard: Heard
    lines: Lines
    excused: float
    """Seconds, see `BadLink`."""

    def verdicts(self) -> Verdicts:
        """The verdicts by the ground truth."""
        before = {key: one for key, one in self.undamaged.judged.items() if self._counts(one.point["t"])}
        after = {
            key: one
            for key, one in _by_checkpoint(judgements(self.undamaged.points, self.lines)).items()
            if self._counts(one.point["t"])
        }
        wrong = tuple(one for key, one in after.items() if self._is_wrong(one, before.get(key)))
        safe = tuple(one for one in wrong if self._is_safe(one.field, one.got, one.point["expect"], one.point["t"]))
        lines = len({t for t, _ in self.safe_lines()})
        return Verdicts(len(after), _right(after), _right(before), wrong, safe, lines)

    def safe_lines(self) -> Iterator[tuple[float, str]]:
        """When, and in which field, a line calls a vehicle safe that the undamaged status calls live.

        Lines that the next frame of a burst replaces do not count. The undamaged status may know of a stop a moment
        later, if another of several messages told it.
        """
        stamps, rows = self.lines
        for t, until, row in zip(stamps, (*stamps[1:], math.inf), rows, strict=True):
            truths = [truth for truth in map(self.undamaged.lines.at, (t, t + SOON)) if truth is not None]
            if until - t < BURST:
                continue
            for field, _ in SAFE:
                is_live = truths and all(self._is_safe(field, row[field], truth[field], t) for truth in truths)
                if is_live and not self._is_excused(field, row[field], t):
                    yield t, field

    def _counts(self, t: float) -> bool:
        return self.undamaged.heard.is_silent(t) or not self.heard.is_silent(t)

    def _is_wrong(self, now: Judgement, before: Judgement | None) -> bool:
        if now.verdict != "WRONG" or (before is not None and before.verdict == "WRONG"):
            return False
        t = now.point["t"]
        if now.field == "link" and now.got == "LOST" and self.heard.is_lost(t):
            return False
        return not self._is_excused(now.field, now.got, t)

    def _is_safe(self, field: str, got: object, truth: object, t: float) -> bool:
        """Whether this answer calls a live vehicle safe. A stop of a disarmed one is no danger."""
        if (field, got) not in SAFE or truth is not (not got):
            return False
        return field != "e_stopped" or self.undamaged.heard.is_armed(t)

    def _is_excused(self, field: str, got: object, t: float) -> bool:
        """Whether the undamaged status has said this lately, and the link kept the news back."""
        if (field, got) in SAFE and self._arming_got_through(t):
            return False
        stamps, rows = self.undamaged.lines
        first = max(bisect.bisect_right(stamps, t - self.excused) - 1, 0)
        said = (answer(row, field) for row in rows[first : bisect.bisect_right(stamps, t)])
        return self.excused > 0 and got in said

    def _arming_got_through(self, t: float) -> bool:
        disarmed, armed = self.undamaged.heard.last_arming(t)
        return t - armed < UNTIL_LOST and self.heard.is_told(disarmed, t)


def _by_checkpoint(judged: list[Judgement]) -> dict[tuple[int, str], Judgement]:
    return {(id(one.point), one.field): one for one in judged}


def _right(judged: dict[tuple[int, str], Judgement]) -> int:
    return sum(one.verdict == "right" for one in judged.values())
