"""Writes `docs/reference/autopilots.md` from the tables in the code: `python docs/make_reference.py [OUTPUT_FILE]`.

`tests/docs/test_reference.py` runs this and compares, so the page cannot drift from the code.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import pathlib
import sys
from collections.abc import Iterable, Iterator

from mav_robot_status.gateway import plugins
from mav_robot_status.hardware.mavlink import identity
from mav_robot_status.hardware.mavlink.autopilots import AUTOPILOTS, ardupilot, inav, px4
from mav_robot_status.hardware.mavlink.autopilots import modes as standard
from mav_robot_status.hardware.mavlink.autopilots import texts as common
from mav_robot_status.hardware.mavlink.autopilots.sensor_weights import EXTENDED_BITS
from mav_robot_status.hardware.mavlink.autopilots.texts import TextRule, When
from mav_robot_status.hardware.mavlink.autopilots.wanted import Wanted
from mav_robot_status.hardware.mavlink.faults import causes, sensors
from mav_robot_status.hardware.mavlink.identity import sensor_name
from mav_robot_status.hardware.mavlink.requests.message_intervals import wanted_of
from mav_robot_status.interface import RobotMode
from mav_robot_status.interface.options import Declared
from mav_robot_status.mavlink.definitions import TYPE_NAMES

HERE = pathlib.Path(__file__).resolve().parent

HEAD = """# Flight modes, texts, sensor bits and error codes

Generated from the tables in the code by `python docs/make_reference.py`; do not edit.

The status informs. It is not a safety function.
"""

CAUSES = " the error causes"
"""What the effects of texts that raise or clear end with; the page leaves it out."""

RULES = {
    causes.Clears.REBOOT: "when the autopilot no longer reports it; an autopilot reboot",
    causes.Clears.FAILSAFE: "its clear text; " + causes.Clears.FAILSAFE.value,
    causes.Clears.ARMING: causes.Clears.ARMING.value,
    causes.Clears.HOLD: causes.Clears.HOLD.value,
}


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    """A Markdown table."""
    names = list(head)
    yield "| " + " | ".join(names) + " |"
    yield "|" + " --- |" * len(names)
    for row in rows:
        yield "| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |"
    yield ""


def by_mode(flight_modes: Iterable[tuple[str, RobotMode]]) -> Iterator[str]:
    """One row for each mode, with its flight modes."""
    rows: dict[str, list[str]] = {}
    for name, mode in flight_modes:
        rows.setdefault(mode.name, []).append(name)
    yield from table(("mode", "flight modes"), ((mode, ", ".join(names)) for mode, names in sorted(rows.items())))


def modes() -> Iterator[str]:
    yield "## Flight modes\n"
    yield "A name and its number in custom_mode.\n"
    yield "AUTO: a program decides the next motion. MANUAL: a pilot's sticks do. Any other number is UNKNOWN, unless"
    yield "`mode_overrides` names it.\n"
    for family, modes_of in ardupilot.MODES.items():
        types = ", ".join(TYPE_NAMES.get(t, str(t)) for t, f in sorted(identity.FAMILIES.items()) if f is family)
        yield f"### ArduPilot {family.value}\n"
        yield f"MAV_TYPE {types}.\n"
        yield from by_mode((f"{name} {n}", mode) for n, (name, mode) in modes_of.items())
    yield "### PX4\n"
    yield "The main mode is in bits 16-23 of custom_mode, the sub mode in bits 24-31.\n"
    rows = [(f"{name} {main}", mode) for main, (name, mode) in px4.MAIN.items()]
    rows += [(f"{name} {main}/{sub}", mode) for (main, sub), (name, mode) in px4.SUB.items()]
    yield "A main mode alone stands for any other sub mode.\n"
    yield from by_mode(rows)
    yield "### INAV that announces itself as ArduPilot\n"
    for family, limit in inav.LIMITS.items():
        yield f"* ArduPilot's {family.value} numbers; from {limit} up there is no mapping: UNKNOWN."
    yield "\n### Every other autopilot\n"
    yield "The first source that is available: CURRENT_MODE.standard_mode, the standard mode of the"
    yield "AVAILABLE_MODES entry, its property AUTO_MODE (AUTO), the flags of HEARTBEAT.base_mode.\n"
    yield from by_mode((f"{name} {n}", mode) for n, (name, mode) in standard.STANDARD_MODES.items())
    yield from table(("base_mode flags", "mode"), ((words, mode.name) for _, words, mode in standard.BASE_MODE_FLAGS))


def codes() -> Iterator[str]:
    yield "## Error codes\n"
    yield "If several causes are active, error_code is the first of this table. `errors` has all of them.\n"
    ordered = sorted(causes.CAUSES.items(), key=lambda item: item[1].priority)
    others = [(f"{code} {cause.name}", _ending(cause)) for code, cause in ordered if code // 1000 != 3]
    alike = itertools.groupby(others, key=lambda row: row[1])
    yield from table(("codes", "end with"), ((", ".join(name for name, _ in of), end) for end, of in alike))
    yield "3000 + n is bit n of SYS_STATUS, 3100 + n bit n of its extended word; they come after the codes above up to"
    yield "9001, and before 6000 and 7000.\n"


def _ending(cause: causes.Cause) -> str:
    rule = RULES[cause.clears]
    return f"{cause.hold:g} s without repetition; {rule}" if cause.hold is not None else rule


def bits() -> Iterator[str]:
    yield "## SYS_STATUS bits\n"
    yield "A bit is faulty if it is present, enabled and not healthy (PX4: enabled and not healthy), in two"
    yield f"messages in a row or for {sensors.DEBOUNCE_SECONDS:g} s. HARD: an error, armed or not. SOFT: an error while"
    yield "armed.\n"
    groups: dict[tuple[str, ...], list[str]] = {}
    for bit in range(31):
        weights = tuple(w.name if (w := p.sensors.weights.get(bit)) else "ignored" for p in AUTOPILOTS)
        groups.setdefault(weights, []).append(f"{bit} {sensor_name(bit)}")
    names = (profile.name for profile in AUTOPILOTS)
    yield from table(("bits", *names), ((", ".join(of), *weights) for weights, of in groups.items()))
    yield f"Bits {EXTENDED_BITS.start} to {EXTENDED_BITS.stop - 1} of the extended word are HARD.\n"


def texts() -> Iterator[str]:
    yield "## Texts\n"
    yield "Regular expressions, matched from the start of a STATUSTEXT. The first row that matches decides. A text"
    yield "that matches no row is 6000 + its severity for `text_hold_s`, if the severity is 2 or less and the vehicle"
    yield "is armed.\n"
    for profile in AUTOPILOTS:
        if profile.texts.rules:
            yield f"### {profile.name}\n"
            yield from table(("text", "effect"), ((f"`{r.pattern}`", _effect(r)) for r in profile.texts.rules))
    yield "### All autopilots: texts that never count as unclassified\n"
    yield from table(("text", "effect"), ((f"`{r.pattern}`", _effect(r)) for r in common.COMMON))


def _effect(rule: TextRule) -> str:
    named = ", ".join(f"{code} {causes.CAUSES[code].name}" for code in rule.codes)
    when = "" if rule.when is When.ALWAYS else f", if {rule.when.value}"
    return f"{rule.effect.value.removesuffix(CAUSES)} {named}{when}".strip()


def outputs() -> Iterator[str]:
    yield "## Options of the publishers\n"
    yield "In a configuration: `{type: NAME, OPTION: VALUE}`. The command line has the arguments of the last column."
    yield "A publisher that is not listed has no options.\n"
    for name in sorted(plugins.OURS[plugins.PUBLISHERS]):
        options = plugins.load(plugins.PUBLISHERS, name, "").options_type.declared()
        if options:
            yield f"### {name}\n"
            rows = ((_code(o.name), _default(o), o.option.help, _code(o.option.flag)) for o in options)
            yield from table(("option", "default", "meaning", "argument"), rows)


def _code(text: str | None) -> str:
    return f"`{text}`" if text else ""


def _default(option: Declared) -> str:
    if option.default in (None, (), "", dataclasses.MISSING):
        return ""
    text = str(option.default).lower().removesuffix(".0") if option.kind in (bool, float) else str(option.default)
    bounds = f", {option.option.low:g} to {option.option.high:g}" if option.option.low > -math.inf else ""
    return f"{_code(text)}{bounds}"


def requested() -> Iterator[str]:
    yield "## Requested messages\n"
    yield "The gateway requests a message only if it arrives at less than half this rate.\n"
    sets: dict[tuple[Wanted, ...], dict[str, list[str]]] = {}
    for profile in AUTOPILOTS:
        for family in identity.Family:
            sets.setdefault(wanted_of(profile, family, True), {}).setdefault(profile.name, []).append(family.value)
    yield from table(
        ("vehicles", "messages, Hz"),
        (
            (
                "; ".join(_families(*kind) for kind in kinds.items()),
                ", ".join(f"{w.name} {w.rate:g}" for w in wanted) or "none",
            )
            for wanted, kinds in sets.items()
        ),
    )


def _families(autopilot: str, families: list[str]) -> str:
    """The name of the autopilot, with its families if not all are meant."""
    return autopilot if len(families) == len(identity.Family) else f"{autopilot} {', '.join(families)}"


def page() -> str:
    """The whole page."""
    parts = (modes(), codes(), bits(), texts(), requested(), outputs())
    return HEAD + "\n" + "\n".join(line for part in parts for line in part).rstrip() + "\n"


def main() -> int:
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "reference" / "autopilots.md"
    out.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
