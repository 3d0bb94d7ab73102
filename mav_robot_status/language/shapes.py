"""The drawings of the shapes, as SVG on a field of 20 x 20. The classes in them are those of the style sheets."""

from __future__ import annotations

from typing import Final

_OCTAGON: Final = '<path d="M6.3 1h7.4L19 6.3v7.4L13.7 19H6.3L1 13.7V6.3z" class="fill"/>'
_HAND: Final = (
    '<path d="M6.7 11V7.4M9 11V5.2M11.3 11V5.2M13.5 11.4V6.8" class="cut thin"/>'
    '<path d="M5.7 10.4h8.8v2.4a3.6 3.6 0 0 1-3.6 3.6H9.3a3.6 3.6 0 0 1-3.6-3.6z" class="paper"/>'
)

SHAPES: Final[dict[str, str]] = {
    # of a robot
    "stop": _OCTAGON + _HAND,
    "crash": '<path d="M10 1.2L19.4 18H.6z" class="fill"/><path d="M10 7v5.4M10 14.6v1.2" class="cut"/>',
    "conflict": '<circle cx="6.8" cy="10" r="5.3" class="line"/><circle cx="13.2" cy="10" r="5.3" class="line"/>',
    "fault": '<path d="M10 .6L19.4 10 10 19.4.6 10z" class="fill"/><path d="M10 5v6.4M10 13.6v1.2" class="cut"/>',
    "lost": '<path d="M3.5 3.5l13 13M16.5 3.5l-13 13" class="line"/>',
    "locked": (
        '<rect x="3.5" y="9" width="13" height="9.5" class="fill"/>'
        '<path d="M6.3 9V6a3.7 3.7 0 0 1 7.4 0v3" class="line"/><path d="M10 12.2v3.2" class="cut"/>'
    ),
    "unknown": (
        '<circle cx="10" cy="10" r="8.3" class="line dash"/>'
        '<path d="M7.3 7.6c.2-3.4 5.4-3.2 5.3 0 0 2-2.6 2.1-2.6 4.2M10 14.2v1.2" class="line"/>'
    ),
    "unheard": '<circle cx="10" cy="10" r="7.6" class="line dots"/>',
    "power": '<path d="M11.6.8L3 11.4h5.6L7.6 19.2 17 7.8h-6.2z" class="fill"/>',
    "move": '<path d="M2 3.5l7.5 6.5L2 16.5zM10.5 3.5L18 10l-7.5 6.5z" class="fill"/>',
    "ring": '<circle cx="10" cy="10" r="6.5" class="line"/>',
    "parked": (
        '<rect x="2" y="2" width="16" height="16" rx="2" class="line"/>'
        '<path d="M7.8 15.2V5.4h3a2.7 2.7 0 0 1 0 5.4h-3" class="line"/>'
    ),
    # of a value
    "dot": '<circle cx="10" cy="10" r="7.5" class="fill"/>',
    "still": '<rect x="4" y="4" width="12" height="12" class="line"/>',
    "auto": (
        '<path d="M10 .8l8 4.6v9.2l-8 4.6-8-4.6V5.4z" class="fill"/>'
        '<path d="M6.8 14l3.2-8.2L13.2 14M8 11.4h4" class="cut"/>'
    ),
    "manual": (
        '<circle cx="10" cy="5.5" r="3.8" class="fill"/><path d="M2.5 19c0-5 3-8 7.5-8s7.5 3 7.5 8z" class="fill"/>'
    ),
    "bars": '<path d="M2 17.5v-4h3v4zM8.5 17.5v-9h3v9zM15 17.5v-15h3v15z" class="fill"/>',
}
"""By name. No two states of a robot share one."""


def sprite() -> str:
    """The shapes as symbols of an SVG, for `<use href="#stop"/>`."""
    return "\n".join(f'<symbol id="{name}" viewBox="0 0 20 20">{drawn}</symbol>' for name, drawn in SHAPES.items())


def drawing(name: str) -> str:
    """One shape as an SVG element of a page. A word beside it says the same."""
    return f'<svg class="shape" viewBox="0 0 20 20" aria-hidden="true">{SHAPES[name]}</svg>'
