"""Keys: the bytes that a terminal sends for them, and their actions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from .state import PaneName, State

ESCAPE: Final = b"\x1b"
ACTIONS: Final[dict[bytes, str]] = {
    b"j": "down", b"\x1b[B": "down", b"\x1bOB": "down",
    b"k": "up", b"\x1b[A": "up", b"\x1bOA": "up",
    b"\x1b[6~": "page down", b" ": "page down", b"\x1b[5~": "page up", b"b": "page up",
    b"g": "first", b"\x1b[H": "first", b"\x1bOH": "first", b"\x1b[1~": "first",
    b"G": "last", b"\x1b[F": "last", b"\x1bOF": "last", b"\x1b[4~": "last",
    b"n": "problem", b"e": "explain", b"t": "transitions", b"T": "all transitions",
    b"?": "help", b"h": "help", ESCAPE: "back", b"\r": "back", b"\n": "back", b"d": "back",
    b"q": "end", b"Q": "end", b"\x04": "end", b"\x0c": "redraw",
}  # fmt: skip
PANES: Final[dict[str, PaneName]] = {
    "explain": "explain",
    "transitions": "transitions",
    "all transitions": "all transitions",
    "help": "help",
}
LONGEST: Final = 32
"""The limit on the bytes of an escape sequence."""


class Keyboard:
    """Splits input into keys. A sequence may arrive in pieces. An Escape without further bytes is the Escape key."""

    def __init__(self) -> None:
        self._rest = b""

    @property
    def waiting(self) -> bool:
        """Whether a sequence is not complete."""
        return bool(self._rest)

    def feed(self, data: bytes) -> list[str]:
        """The actions of the complete keys. A key without an action is ignored."""
        self._rest += data
        found = []
        while self._rest:
            length = _length(self._rest)
            if length is None:
                break
            action = ACTIONS.get(self._rest[:length])
            self._rest = self._rest[length:]
            if action is not None:
                found.append(action)
        return found

    def flush(self) -> list[str]:
        """The action of an incomplete sequence after which no byte follows."""
        rest, self._rest = self._rest, b""
        return [ACTIONS[rest]] if rest in ACTIONS else []


def _length(data: bytes) -> int | None:
    """The number of bytes of the first key; None if it is incomplete."""
    if not data.startswith(ESCAPE):
        return 1
    if len(data) == 1:
        return None
    if data[1:2] == b"O":
        return 3 if len(data) >= 3 else None
    if data[1:2] != b"[":
        return 1  # Escape, followed by another key
    for i in range(2, min(len(data), LONGEST)):
        if 0x40 <= data[i] <= 0x7E:
            return i + 1
    return None if len(data) < LONGEST else LONGEST


def press(state: State, action: str, rows: int, page: int) -> State:
    """The state after an action. `rows` and `page` are the heights of the table and of the pane."""
    ui = state.ui
    if action in PANES:
        pane = PANES[action]
        return state._replace(ui=ui._replace(pane="detail" if pane == ui.pane else pane, scroll=0))
    if action == "back":
        return state._replace(ui=ui._replace(pane="detail", scroll=0))
    if action in ("page down", "page up") and ui.pane != "detail":
        step = page if action == "page down" else -page
        return state._replace(ui=ui._replace(scroll=max(0, ui.scroll + step)))
    if not state.vehicles:
        return state
    index = min(max(0, _index(state, action, rows)), len(state.vehicles) - 1)
    # these panes do not depend on the selected vehicle
    scroll = ui.scroll if index == state.place or ui.pane in ("all transitions", "help") else 0
    return state._replace(ui=ui._replace(handle=state.vehicles[index].handle, scroll=scroll))


def _index(state: State, action: str, rows: int) -> int:
    index, count = state.place, len(state.vehicles)
    if action == "problem":
        order = [(index + i) % count for i in range(1, count + 1)]
        return next((i for i in order if state.vehicles[i].has_problem), index)
    moves = {"down": 1, "up": -1, "page down": rows, "page up": -rows, "first": -count, "last": count}
    return index + moves.get(action, 0)
