"""What would make an UNKNOWN field known: a row for each reason, with own words for an autopilot where needed.

`explain`, the page, `doctor` and the generated page "What UNKNOWN means" show these words.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

ANY: Final = ""
"""The key of the words for every other autopilot."""
AUTOPILOTS: Final = ("ArduPilot", "PX4", "INAV", ANY)
"""The autopilots that have words of their own, and all others."""


class Unknown(NamedTuple):
    """One row."""

    reason: str
    """The beginning of the rule that decided, as `explain` shows it."""
    words: dict[str, str]
    """What makes it known, in whole sentences, by the name of the autopilot."""
    message: str = ""
    """The message that is missing; empty: none is."""
    fields: tuple[str, ...] = ()
    """The fields that it is about; empty: every field."""

    def words_for(self, autopilot: str) -> str:
        """The words for the autopilot with this name."""
        return self.words.get(autopilot, self.words.get(ANY, OTHERWISE))


OTHERWISE: Final = "Wait for the next messages. `explain` names the message that decides."
"""The words for a reason without a row."""

_STREAM: Final = {
    "ArduPilot": "Ask with MAV_CMD_SET_MESSAGE_INTERVAL ({id}, {us} us), or raise the parameter "
    "SR{{n}}_{stream} of this link.",
    "PX4": "Ask with MAV_CMD_SET_MESSAGE_INTERVAL ({id}, {us} us), or `mavlink stream -d DEVICE -s "
    "{name} -r {hz}` there.",
}


def _ask(what: str, name: str, number: int, hz: int, stream: str, others: dict[str, str]) -> dict[str, str]:
    """How to get a message from each autopilot."""
    fill = {"id": number, "us": 1_000_000 // hz, "stream": stream, "name": name, "hz": hz}
    return {who: f"{what} {how.format(**fill)}" for who, how in _STREAM.items()} | {
        who: f"{what} {how}" for who, how in others.items()
    }


_SPEED: Final = _ask(
    "Send the speed: GLOBAL_POSITION_INT at 4 Hz (or LOCAL_POSITION_NED, or VFR_HUD). It needs a position estimate.",
    "GLOBAL_POSITION_INT",
    33,
    4,
    "POSITION",
    {
        "INAV": "It needs a GPS receiver with a fix. The setting `mavlink_pos_rate` is its rate.",
        ANY: "It needs a GPS receiver with a fix.",
    },
)
_SYS_STATUS: Final = _ask(
    "Send SYS_STATUS at 1 Hz.",
    "SYS_STATUS",
    1,
    1,
    "EXT_STAT",
    {"INAV": "The setting `mavlink_ext_status_rate` is its rate.", ANY: "Switch the message on in its telemetry."},
)
_AIRBORNE: Final = _ask(
    "Send EXTENDED_SYS_STATE at 2 Hz: its landed_state shows whether it is airborne.",
    "EXTENDED_SYS_STATE",
    245,
    2,
    "EXTRA1",
    {ANY: "Where the firmware does not have it, no rule can tell: land and disarm."},
)
_AIRBORNE["ArduPilot"] = (
    "Send EXTENDED_SYS_STATE at 2 Hz: its landed_state shows whether it is airborne. "
    "Ask with MAV_CMD_SET_MESSAGE_INTERVAL (245, 500000 us)."
)
_APPLET: Final = (
    "Install the applet on the autopilot: `mav-robot-status applet` writes it, and SCR_ENABLE 1 and a "
    "restart start it, if its board runs scripts. "
    "It reports each stop."
)
_STOP_ENDS: Final = {
    "ArduPilot": "Say it again: engage and release the stop once, or disarm. The applet (`mav-robot-status applet`) "
    "reports each release.",
    ANY: "Say it again: engage and release the stop once, or disarm. Else look at the vehicle.",
}
_WAIT: Final = {ANY: "Wait for the next HEARTBEAT, at most some seconds."}
_LINK: Final = {
    ANY: "Bring the link back: power, cable, radio, range, port. `mav-robot-status doctor CONNECTION` "
    "says what is heard."
}

TABLE: Final = (
    # the link and the senders
    Unknown(
        "frames arrive, but the latest HEARTBEAT is old",
        {
            ANY: "Wait for the next HEARTBEAT. If it stays late, the link loses or delays frames: use a "
            "faster one, or lower "
            "the rates of other messages. `explain` names the senders."
        },
        "HEARTBEAT",
    ),
    Unknown("no frame within heartbeat_timeout", _LINK),
    Unknown(
        "several senders use the ids of this vehicle",
        {ANY: "Give each autopilot its own system id, or remove the slow link. `explain` names the senders."},
    ),
    Unknown(
        "another sender claims the ids of this vehicle",
        {ANY: "Give each autopilot its own system id. `explain` names the senders."},
    ),
    # e_stopped, and what rests on it
    Unknown("ArduPilot does not show an emergency stop", {"ArduPilot": _APPLET}),
    Unknown(
        "the outputs stand at their stop value",
        {
            "ArduPilot": "Drive a motor, or tell which channels are motors: the parameters "
            "SERVOn_FUNCTION answer that. " + _APPLET
        },
        "SERVO_OUTPUT_RAW",
    ),
    Unknown(
        "the pre-arm checks pass, but do not fail on a stop by the switch of option 165",
        {"ArduPilot": "Use option 31 (motor emergency stop) for the switch in place of 165. " + _APPLET},
    ),
    Unknown(
        "it was disarmed in motion, and frames that may tell why are lost",
        {ANY: "Look at the vehicle, then arm it once: that ends the doubt."},
    ),
    Unknown(
        "this autopilot does not show emergency stops",
        {
            ANY: "Nothing on the wire: this firmware reports no stop. Look at the vehicle. If the site has no stop, "
            "`estop_unknown_as: false` says so."
        },
    ),
    Unknown("HIGH_LATENCY2 does not show an emergency stop", {ANY: "Connect a link that sends HEARTBEAT."}),
    Unknown(
        "PX4 before 1.12 shows a kill only in texts", {ANY: "Update PX4 to 1.12 or newer: its state shows each stop."}
    ),
    Unknown("in hardware-in-the-loop older PX4", {ANY: "Switch hardware-in-the-loop off, or update PX4."}),
    Unknown("a text reports a stop, and no heartbeat", _WAIT),
    Unknown(
        "a switch of option 31 is in its stop position",
        {"ArduPilot": "Move the switch out of its stop position, or find out what it does. " + _APPLET},
    ),
    Unknown(
        "the safety switch was engaged, and may have been released since",
        {"ArduPilot": "Disarm, or wait for the next SYS_STATUS. " + _APPLET},
        "SYS_STATUS",
    ),
    Unknown(
        "the applet on the autopilot reports a stop, but a motor output",
        {
            ANY: "Look at the vehicle: a motor is driven in spite of a stop, as in a motor test. It is "
            "known again when the "
            "motor stands, or the stop is released."
        },
    ),
    Unknown(
        "a command to stop or to release has no clear acknowledgement",
        {ANY: "Repeat the command, and listen where its COMMAND_ACK arrives."},
        "COMMAND_ACK",
    ),
    Unknown("a stop was reported", _STOP_ENDS),
    Unknown("the motor outputs were held by a stop", _STOP_ENDS),
    Unknown("a text that refuses the arming", _STOP_ENDS),
    Unknown("a switch reported a stop", _STOP_ENDS),
    Unknown(
        "the motors were switched off while armed",
        {
            "ArduPilot": "Drive a motor, or disarm. The applet (`mav-robot-status applet`) reports each stop.",
            ANY: "Drive a motor, or disarm.",
        },
    ),
    Unknown(
        "the applet reported a stop, and has been silent since",
        {"ArduPilot": "Restart the applet (SCR_ENABLE 1), or disarm and arm the vehicle."},
    ),
    # arming
    Unknown(
        "a state in which the autopilot does not say whether it is armed",
        {ANY: "Wait until the autopilot has left this state. Then its HEARTBEAT says whether it is armed."},
    ),
    Unknown("an arming was announced, and no HEARTBEAT", _WAIT),
    Unknown("state UNINIT", {ANY: "Wait until the autopilot has started."}),
    Unknown("this HIGH_LATENCY2 does not say whether", {ANY: "Connect a link that sends HEARTBEAT."}),
    Unknown("armed, but HIGH_LATENCY2 does not report", {ANY: "Connect a link that sends HEARTBEAT."}),
    # motion
    Unknown("no fresh speed", _SPEED, "GLOBAL_POSITION_INT"),
    Unknown("armed, and nothing shows whether it is airborne", _AIRBORNE, "EXTENDED_SYS_STATE"),
    Unknown("airborne, but not moving", {ANY: "Wait for a motion or a landing. Disarm it if it lies on the ground."}),
    Unknown(
        "disarmed: the estimate moves, the GPS receiver stands still",
        {
            ANY: "Look at the vehicle: its estimate and its GPS receiver contradict each other. Restart "
            "the autopilot at rest."
        },
    ),
    Unknown(
        "speed and rotation, with hysteresis",
        {
            ANY: "Wait about a second: the speed lies between the limits, or has not been steady for long enough. Slow "
            "samples take longer: 4 Hz are enough."
        },
    ),
    Unknown("nothing shows motion, and samples so far apart", {ANY: "Connect a link that sends speeds more often."}),
    # errors
    Unknown("no fresh SYS_STATUS", _SYS_STATUS, "SYS_STATUS"),
    Unknown(
        "the SYS_STATUS of this autopilot never changes",
        {
            ANY: "Nothing on the wire: this firmware reports no health of its sensors. A text or a state "
            "still shows an error."
        },
    ),
    # mode
    Unknown(
        "INAV: no mapping for its mode",
        {
            ANY: "Nothing on the wire: INAV reports its mode by ArduPilot's numbers, and several of its "
            "modes share one. "
            "`mode_overrides` maps them for your site."
        },
        fields=("mode",),
    ),
    Unknown(
        "mode ",
        {ANY: "This number is in no table. Name it in `mode_overrides`, or update mav-robot-status."},
        fields=("mode",),
    ),
    Unknown("base_mode says nothing", {ANY: "Name the mode in `mode_overrides`."}, fields=("mode",)),
    Unknown(
        "ArduPilot's ",
        {
            ANY: "This mode is neither a pilot's nor a program's (it starts, or has just been held). "
            "Select another mode, or "
            "name it in `mode_overrides`."
        },
        fields=("mode",),
    ),
    Unknown(
        "PX4's ",
        {ANY: "This mode is neither a pilot's nor a program's. Select another mode, or name it in `mode_overrides`."},
        fields=("mode",),
    ),
)
"""In the order in which they are tried."""
_PREFIXES: Final = ("drives_powered is false: ", "e_stopped: ")


def row_of(field: str, rule: str) -> Unknown | None:
    """The row for a rule that leaves `field` UNKNOWN."""
    for prefix in _PREFIXES:
        rule = rule.removeprefix(prefix)
    return next((row for row in TABLE if rule.startswith(row.reason) and (not row.fields or field in row.fields)), None)


def same_step(steps: Mapping[str, str]) -> dict[str, list[str]]:
    """The fields that need the same, by what they need. `steps`: what each unknown field needs."""
    needs: dict[str, list[str]] = {}
    for name, step in steps.items():
        needs.setdefault(step, []).append(name)
    return needs


def next_step(field: str, rule: str, autopilot: str, asked: Mapping[str, str] | None = None) -> str:
    """What would make a field known that is UNKNOWN by this rule, in whole sentences.

    `asked`: what is known about the request for each message ("SYS_STATUS": "Asked for 12 s ago, no answer.").
    """
    row = row_of(field, rule)
    if row is None:
        return OTHERWISE
    request = (asked or {}).get(row.message, "") if row.message else ""
    return f"{row.words_for(autopilot)} {request}".rstrip()
