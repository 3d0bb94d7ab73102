"""Turns the spans of a line into terminal output: with colours if rich is installed, otherwise as plain text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from .text import plain

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from .text import Line, Style

STYLES: Final[Mapping[Style, str]] = {
    "": "",
    "soft": "dim",
    "bold": "bold",
    "head": "bold",
    "chosen": "reverse bold",
    "on": "bold cyan",
    "unknown": "magenta",
    "stop": "bold black on yellow",
    "alarm": "bold white on red",
    "cause": "bold red",
    "warning": "yellow",
}
"""The look of each style. The colours are those of the terminal's palette, which suits light and dark themes."""


def painter() -> Callable[[Line], str]:
    """The function that paints lines for the terminal on standard output. `NO_COLOR` leaves bold, dim and reverse."""
    try:
        from rich.console import COLOR_SYSTEMS, Console
        from rich.style import Style as RichStyle
    except ImportError:
        return plain
    console = Console()
    if console.color_system is None:
        return plain
    system = COLOR_SYSTEMS[console.color_system]
    styles = {name: RichStyle.parse(looks) for name, looks in STYLES.items()}
    if console.no_color:
        styles = {name: style.without_color for name, style in styles.items()}
    return lambda line: "".join(styles[span.style].render(span.text, color_system=system) for span in line)
