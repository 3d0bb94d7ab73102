"""Keys: the bytes that a terminal sends for them, and what they change."""

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
"""Bytes of an escape sequence; a longer one is none."""


class Keyboard:
    """Cuts what was typed into keys. A sequence may come in pieces; a lone Escape is known by what does not follow."""

    def __init__(self) -> None:
        self._rest = b""

    @property
    def waiting(self) -> bool:
        """Whether a sequence is not complete."""
        return bool(self._rest)

    def feed(self, data: bytes) -> list[str]:
        """The actions of the keys that are complete; of none where a key has no meaning."""
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
        """The action of what is not complete and does not go on."""
        rest, self._rest = self._rest, b""
        return [ACTIONS[rest]] if rest in ACTIONS else []


def _length(data: bytes) -> int | None:
    """Bytes of the first key; None if more must come."""
    if not data.startswith(ESCAPE):
        return 1
    if len(data) == 1:
        return None
    if data[1:2] == b"O":
        return 3 if len(data) >= 3 else None
    if data[1:2] != b"[":
        return 1  # Escape, and another key
    for i in range(2, min(len(data), LONGEST)):
        if 0x40 <= data[i] <= 0x7E:
            return i + 1
    return None if len(data) < LONGEST else LONGEST


def press(state: State, action: str, rows: int, page: int) -> State:
    """The state after a key; `rows` and `page` are the lines of the table and of the pane."""
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
    # what all vehicles did does not begin anew with another one
    scroll = ui.scroll if index == state.place or ui.pane in ("all transitions", "help") else 0
    return state._replace(ui=ui._replace(handle=state.vehicles[index].handle, scroll=scroll))


def _index(state: State, action: str, rows: int) -> int:
    index, count = state.place, len(state.vehicles)
    if action == "problem":
        order = [(index + i) % count for i in range(1, count + 1)]
        return next((i for i in order if state.vehicles[i].needs_a_look), index)
    moves = {"down": 1, "up": -1, "page down": rows, "page up": -rows, "first": -count, "last": count}
    return index + moves.get(action, 0)
