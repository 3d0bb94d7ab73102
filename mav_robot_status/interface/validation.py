"""`validate`: the invariants of the status and detail of every robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from .fields import FIELDS, STATES, Kind, RobotMode, RobotStatus, TriState
from .status import Detail, ErrorCause, Inhibit, LinkState, NotReady, Vehicle

CODES: Final = range(-(2**31), 2**31)
"""ROBOT_STATUS and industrial_msgs carry a code as int32."""
IDS: Final = range(256)

TRUE, FALSE = TriState.TRUE, TriState.FALSE


def assumptions(hardware: object) -> dict[str, bool]:
    """What a hardware interface says about power, as arguments of `validate`."""
    return {name: bool(getattr(hardware, name, True)) for name in ("stops_cut_power", "motion_needs_power")}


def validate(
    status: RobotStatus,
    detail: Detail | None = None,
    *,
    stops_cut_power: bool = True,
    motion_needs_power: bool = True,
) -> str | None:
    """The first invariant that a status and its detail violate, as a sentence; None if they are valid.

    A value of the wrong type is reported with the name of its field. Without a detail, the status alone is checked.
    `stops_cut_power` and `motion_needs_power` are those of the hardware interface.
    """
    found = _wrong_type(status) or (None if detail is None else _wrong_detail(detail))
    if found is None and (detail is None or not detail.members):
        found = _powered_in_part(status, stops_cut_power, motion_needs_power)
    return found or _broken(status) or (None if detail is None else _contradiction(status, detail))


def _wrong_type(status: object) -> str | None:
    if not isinstance(status, RobotStatus):
        return f"the status must be a RobotStatus, not {status!r}"
    for field in FIELDS:
        value = getattr(status, field.name)
        if field.kind is Kind.CODE:
            if not _is_number(value):
                return f"{field.name}: must be a whole number of 32 bits, not {value!r}"
        elif not isinstance(value, _ENUMS[field.kind]):
            return f"{field.name}: must be a {_ENUMS[field.kind].__name__}, not {value!r}"
    return None


_ENUMS: Final = {Kind.MODE: RobotMode, Kind.TRI_STATE: TriState}


def _powered_in_part(status: RobotStatus, stops_cut_power: bool, motion_needs_power: bool) -> str | None:
    """The invariants of a single robot. In a group some parts may be stopped while others are powered."""
    if stops_cut_power and status.e_stopped is TRUE and status.drives_powered is not FALSE:
        return "I1: e_stopped is TRUE, so drives_powered must be FALSE"
    if motion_needs_power and status.drives_powered is FALSE and status.motion_possible is not FALSE:
        return "I2: drives_powered is FALSE, so motion_possible must be FALSE"
    return None


def _broken(status: RobotStatus) -> str | None:
    if (status.error_code != 0) != (status.in_error is TRUE):
        return "I3: error_code must be non-zero if in_error is TRUE, and 0 otherwise"
    return None


def _contradiction(status: RobotStatus, detail: Detail) -> str | None:
    if detail.link is not LinkState.CONNECTED and not _knows_nothing(status):
        return f"I4: the link is {detail.link.name}, so every field must be UNKNOWN (in_error may be TRUE)"
    if status.motion_possible is TRUE and detail.inhibits:
        return f"motion_possible is TRUE, so there must be no inhibits, not {detail.inhibits[0].name}"
    if detail.errors and detail.errors[0].code != status.error_code:
        return f"error_code must be the code of the first error, {detail.errors[0].code}, not {status.error_code}"
    return None


def _knows_nothing(status: RobotStatus) -> bool:
    """With a lost link every field is UNKNOWN. Only in_error may be TRUE (`link_loss_is_error`)."""
    names = (field.name for field in STATES if field.name != "in_error")
    return status.in_error is not FALSE and all(getattr(status, name).name == "UNKNOWN" for name in names)


def _wrong_detail(detail: object) -> str | None:
    if not isinstance(detail, Detail):
        return f"the detail must be a Detail, not {detail!r}"
    for name, allowed, what in _MEMBERS:
        if not allowed(getattr(detail, name)):
            return f"{name}: must be {what}, not {getattr(detail, name)!r}"
    if any(error.code == 0 for error in detail.errors):
        return "errors: the code of an error must not be 0"
    return None


def _is_id(value: object) -> bool:
    return value is None or (_is_number(value) and value in IDS)


def _is_number(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value in CODES


def _is_error(value: object) -> bool:
    return isinstance(value, ErrorCause) and _is_number(value.code) and _is_reason(value)


def _is_reason(value: object) -> bool:
    return (
        isinstance(value, ErrorCause | Inhibit)
        and isinstance(value.name, str)
        and isinstance(value.text, str | None)
        and type(value.since_us) is int
        and isinstance(value.handle, str | None)
    )


def _is_vehicle(value: object) -> bool:
    return (
        isinstance(value, Vehicle)
        and all(isinstance(getattr(value, name), str | None) for name in _WORDS)
        and (value.custom_mode is None or type(value.custom_mode) is int)
        and isinstance(value.can_arm, bool | None)
        and (value.modes_blocked is None or _are_words(value.modes_blocked))
    )


_WORDS: Final = tuple(name for name in Vehicle._fields if name not in ("custom_mode", "can_arm", "modes_blocked"))
"""The members of a Vehicle that are texts."""


def _are_words(value: object) -> bool:
    return isinstance(value, tuple) and all(isinstance(word, str) for word in value)


def _is_not_ready(value: object) -> bool:
    return isinstance(value, NotReady) and isinstance(value.handle, str) and isinstance(value.why, str)


_MEMBERS: Final[tuple[tuple[str, Callable[[object], bool], str], ...]] = (
    ("system", _is_id, "an id from 0 to 255 or None"),
    ("component", _is_id, "an id from 0 to 255 or None"),
    ("errors", lambda v: isinstance(v, tuple) and all(map(_is_error, v)), "a tuple of ErrorCause"),
    (
        "inhibits",
        lambda v: isinstance(v, tuple) and all(isinstance(i, Inhibit) and _is_reason(i) for i in v),
        "a tuple of Inhibit",
    ),
    ("vehicle", _is_vehicle, "a Vehicle"),
    ("link", lambda v: isinstance(v, LinkState), "a LinkState"),
    ("members", _are_words, "a tuple of names of handles"),
    ("not_ready", lambda v: isinstance(v, tuple) and all(map(_is_not_ready, v)), "a tuple of NotReady"),
)
