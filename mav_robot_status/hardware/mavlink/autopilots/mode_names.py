"""The numbers of flight modes by their names in our tables, for a configuration."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import ardupilot, px4

if TYPE_CHECKING:
    from collections.abc import Mapping


def numbers(key: str) -> Mapping[str, int]:
    """The custom_mode of each mode name, for a key of `mode_overrides`; empty if that key has no table of modes.

    The names are those of `vehicle.flight_mode`. Where a table gives two numbers one name, the lower number has it.
    """
    if key == "px4":
        main = {name: number << 16 for number, (name, _) in px4.MAIN.items()}
        return main | {name: number << 16 | sub << 24 for (number, sub), (name, _) in px4.SUB.items()}
    table = next((table for family, table in ardupilot.MODES.items() if family.value == key), {})
    return {name: number for number, (name, _) in sorted(table.items(), reverse=True)}
