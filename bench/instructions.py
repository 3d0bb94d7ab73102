"""Counts executed bytecode instructions: a measure of work that is the same in every run."""

from __future__ import annotations

import gc
import sys
from collections import Counter
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CodeType, FrameType

TOOL: Final = 4
"""A tool id of sys.monitoring that no debugger, profiler or coverage tool uses."""


def count(run: Callable[[], object], without: str = "") -> int:
    """The number of bytecode instructions of a call, without those in functions of the file `without`."""
    return by_file(run, without).total()


def by_file(run: Callable[[], object], without: str = "") -> Counter[str]:
    """The same for each file whose functions ran."""
    gc.collect()
    gc.disable()  # otherwise finalizers and callbacks run at random times
    try:
        return _monitored(run, without) if sys.version_info >= (3, 12) else _traced(run, without)
    finally:
        gc.enable()


def _traced(run: Callable[[], object], without: str) -> Counter[str]:
    counted: Counter[str] = Counter()

    def instruction(frame: FrameType, event: str, _: object) -> Any:
        if event == "opcode":
            counted[frame.f_code.co_filename] += 1
        return instruction

    def call(frame: FrameType, event: str, _: object) -> Any:
        if frame.f_code.co_filename in (without, __file__):
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        return instruction

    before = sys.gettrace()
    sys.settrace(call)
    try:
        run()
    finally:
        sys.settrace(before)
    return counted


def _monitored(run: Callable[[], object], without: str) -> Counter[str]:
    monitoring: Any = sys.monitoring  # type: ignore[attr-defined,unused-ignore]  # of Python 3.12
    counted: Counter[str] = Counter()

    def instruction(code: CodeType, _: int) -> Any:
        if code.co_filename in (without, __file__):
            return monitoring.DISABLE
        counted[code.co_filename] += 1
        return None

    event = monitoring.events.INSTRUCTION
    monitoring.use_tool_id(TOOL, "bench")
    try:
        monitoring.register_callback(TOOL, event, instruction)
        monitoring.restart_events()  # events that an earlier count has disabled
        monitoring.set_events(TOOL, event)
        run()
    finally:
        monitoring.set_events(TOOL, 0)
        monitoring.register_callback(TOOL, event, None)
        monitoring.free_tool_id(TOOL)
    return counted
