"""What a person can do about the words of an autopilot: families of words, in the order of the search.

The words are those of ArduPilot's pre-arm checks (libraries/AP_Arming, and the page "Pre-Arm Safety Checks" of its
documentation) and of PX4's arming checks (src/modules/commander/HealthAndArmingChecks, as texts and as events).
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

MOST: Final = 500
"""Characters of a text that are searched. A text comes from the wire."""


class TextRemedy(NamedTuple):
    """One row for words of an autopilot."""

    pattern: re.Pattern[str]
    step: str
    """What to do next: whole sentences."""
    topic: str
    """The heading of docs/how-to/cannot-move.md that has more."""


def _row(topic: str, step: str, *words: str) -> TextRemedy:
    """A row for texts with all of these expressions, in any order. Capitals and small letters are the same."""
    return TextRemedy(re.compile("".join(rf"(?=.*(?:{one}))" for one in words), re.I | re.S), step, topic)


_BROKEN: Final = "not healthy|unhealthy|not found|missing|no (valid )?data|not detected|not connected|failed to|invalid"
_COMPASS: Final = r"compass|\bmag|magnet|3d_mag"
_GPS: Final = r"\bgps|gnss|hdop|3d fix|pdop"
_IMU: Final = r"gyro|accel|\bins\b|\bimu"
_RADIO: Final = r"\brc\b|\brc\d|rc_receiver|radio|manual control|remote_control|collective"
_STICKS: Final = r"throttle|\broll\b|\bpitch\b|\byaw\b|stick"
_SURE: Final = r"position|ahrs|ekf|estimat|attitude|velocit|home|origin|altitude|\balt\b|\bdcm\b|heading|drift|height"

TEXTS: Final[tuple[TextRemedy, ...]] = (
    # words that later rows would match as well
    _row("configuration", "Check the scripts on the SD card of the autopilot, and its memory for them.", "script"),
    _row(
        "configuration",
        "Check the devices on the CAN bus, their cables and their power.",
        r"dronecan|kdecan|\bcan\b:|\bcan bus",
    ),
    _row("configuration", "Use an autopilot with more memory, or give it less to do.", "out of memory|memory low"),
    _row(
        "motors",
        "Correct the settings of the motors and outputs.",
        r"frame.class|\bmot_|spin_|no servo|servo\d*_(function|min|max|trim|rev)|no uart|motor mask|pole count|pwm",
    ),
    _row(
        "configuration",
        "Correct the setting that it names.",
        r"\bcheck \w+_\w+|_\w+ too (low|high|small|large)|\bset \w+_\w+|multiple serial|terrain disabled|not supported",
    ),
    _row("configuration", "Remove one of the two functions from the switches.", "conflict|duplicate|cannot be same"),
    _row(
        "emergency-stop",
        "Find out why the emergency stop is engaged, clear the cause, then release it.",
        r"emergency stop|e-?stop\b|kill.?switch|kill engaged",
    ),
    _row(
        "safety-switch",
        "Keep clear of everything that can turn, then hold the safety switch of the vehicle until its light changes.",
        "safety switch|safety button",
    ),
    _row(
        "crash",
        "Find out what happened, and inspect the vehicle before it is armed again.",
        "flight termination|attitude failure|altitude failure|failure triggered|system failure|chute is released",
    ),
    _row("starting", "Wait until the calibration has ended.", r"calibrating|cal(ibration)? running|temperature cal"),
    _row(
        "configuration", "Restart the autopilot.", r"requires? (a )?reboot|, reboot|needs? (a )?reboot|reboot required"
    ),
    _row(
        "arming",
        "Wait for its report, and let the gateway ask for it: run it without --passive.",
        "no report of the arming checks",
    ),
    # the transmitter
    _row(
        "radio",
        "Put this switch of the transmitter into its other position.",
        "interlock enabled|disarm switch|rtl switch|gear switch",
    ),
    _row("configuration", "Set up the motor interlock, which this vehicle needs.", "interlock"),
    _row("radio", "Switch the transmitter on and check its receiver.", "throttle|collective", "below failsafe"),
    _row(
        "radio",
        "Calibrate the channels of the transmitter.",
        rf"{_RADIO}|throttle|trim",
        r"not calibrated|calibration for|radio m(ax|in)|_m(ax|in)\b|_trim|throttle trim",
    ),
    _row(
        "radio",
        "Put the throttle and all sticks into their neutral position.",
        rf"{_STICKS}|{_RADIO}",
        "not neutral|not zero|too high|above center|high throttle|neutral",
    ),
    _row("radio", "Switch the transmitter on and check its receiver.", _RADIO),
    # sensors
    _row("compass", "Calibrate the compass, far from metal.", _COMPASS, "not calibrated|uncalibrated|offsets"),
    _row("compass", "Check the cable of the compass and its settings.", _COMPASS, f"{_BROKEN}|found"),
    _row(
        "compass",
        "Move the vehicle away from metal and magnets. Calibrate the compass if this persists.",
        rf"{_COMPASS}|magnetic",
    ),
    _row("gps", "Move away from what disturbs the GPS receiver, and wait for a fix.", _GPS, "jam|spoof|interference"),
    _row("gps", "Wait until the GPS receiver is configured.", _GPS, "configuring|config data"),
    _row("gps", "Check both antennas, and wait for a fix.", _GPS, r"\byaw\b|heading"),
    _row("gps", "Wait for a fix or check the antenna.", _GPS, r"\bfix|hdop|pdop"),
    _row("gps", "Check the cable and the settings of the GPS receiver.", _GPS, f"{_BROKEN}|type 0|node|blending"),
    _row("gps", "Wait under open sky until the GPS receiver is accurate.", _GPS),
    _row("sensors", "Wait until the autopilot is warm.", "heater|temp(erature)? low"),
    _row(
        "sensors",
        "Keep the vehicle still and calibrate its gyros and accelerometers.",
        _IMU,
        "not calibrated|uncalibrated|calibration needed|cal failed",
    ),
    _row(
        "sensors",
        "Keep the vehicle still until it is warm, then restart it. Calibrate the sensor if this persists.",
        _IMU,
        "inconsistent|bias",
    ),
    _row("sensors", "Restart the autopilot. Have it checked if this persists.", rf"{_IMU}|baro|absolute_pressure"),
    _row("sensors", "Wait a minute without moving it. Restart the autopilot if this persists.", "disparity"),
    _row("surroundings", "Move nearby objects away from the vehicle.", r"proximity", r"want|\bdeg\b"),
    _row(
        "sensors",
        "Check the cable, the power and the settings of this sensor.",
        r"airspeed|rangefinder|\brngfnd|\brfnd|distance.sensor|optical.flow|proximity|\bprx|visodom|vision|winch|mount|generator|"
        r"differential_pressure|camera|gimbal|payload|\brpm\d|avoidance system|obstacle_avoidance|laser_position",
    ),
    # power
    _row("battery", "Unplug the USB cable.", "usb connected"),
    _row("configuration", "Correct the limits of the battery failsafe.", "critical >= low"),
    _row("battery", "Check the cables of the battery and of its monitor.", "batter|power module", _BROKEN + "|disconn"),
    _row("battery", "Charge or change the battery.", "batter|flight time"),
    _row(
        "battery",
        "Check the power supply of the autopilot and its cable.",
        r"board \(|board voltage|servo voltage|avionics power|overcurrent|system power|power redundancy|"
        "power module|vcc",
    ),
    # computers and links
    _row(
        "ground-station", "Start the program that drives it, and check its connection.", "offboard|onboard controller"
    ),
    _row(
        "ground-station",
        "Connect the ground station.",
        r"\bgcs\b|ground (control )?station|communication_links|data.?link|mission computer|companion",
    ),
    # the plan
    _row("mission", "Connect the ground station and wait for the terrain data.", "terrain"),
    _row(
        "surroundings",
        "Bring the vehicle inside its fence.",
        "fence",
        "outside|violation|breach|exceeding|approaching",
    ),
    _row("position", "Wait with the vehicle still and under open sky.", "fence|rally|mode", "position|home"),
    _row("surroundings", "Correct the fence, and write it to the autopilot again.", r"fence|(in|ex)clusion"),
    _row("logging", "Check the SD card of the autopilot, and write the mission again.", r"mission\.stg"),
    _row(
        "mission",
        "Correct the mission and the rally points, and write them to the autopilot again.",
        "mission|rally|waypoint|land.?start",
    ),
    _row(
        "mode",
        "Select a mode in which it can be armed.",
        "mode not|not armable|not in multicopter|transition|landing sequence|not suitable|manual mode first|qmode|"
        "mode is (un|not)",
    ),
    # position
    _row(
        "position",
        "Restart the autopilot where it is now.",
        "too far from",
    ),
    _row(
        "position", "Wait with the vehicle still.", r"attitude|leaning|roll.pitch|angular velocity|still initialising"
    ),
    _row("position", "Wait with the vehicle still and under open sky.", _SURE),
    # the vehicle
    _row("configuration", "Check the device for remote identification and its settings.", r"drone.?id|remote id|odid"),
    _row(
        "motors",
        "Check the motors, the motor controllers and their cables.",
        r"\bmotors?\b|\bescs?\b|esc\d|motors_escs|propeller|propulsion|fettec|piccolo|motor_outputs|reverse_motor|servo",
    ),
    _row("configuration", "Check the parachute and its settings.", "chute"),
    _row("surroundings", "Wait until the wind is weaker.", r"\bwind\b"),
    _row("surroundings", "Wait until the traffic has passed.", "adsb threat|traffic"),
    _row("arming", "Ask the system that grants the permission to arm.", "authori[sz]"),
    _row("logging", "Wait until the log is downloaded, or cancel that.", "downloading log"),
    _row("logging", "Check the SD card of the autopilot.", r"logging|sd card|no io buffer|crash dump|\bstorage\b \("),
    _row(
        "autopilot",
        "Restart the autopilot. Have it checked if this comes back.",
        r"internal err|loop slow|cpu|\bram\b|memory|storage|isr flood|\bfft\b|system health",
    ),
    _row(
        "configuration",
        "Correct the setting that it names.",
        r"param|\bcheck [a-z0-9_]+|invalid|not set|must be|too (small|low|large|big|high)|osd|_pin|relay|button|"
        r"misconfig|[<>]|[A-Z]+_[A-Z]+_[A-Z]|config error|removed|enabled but",
    ),
    _row(
        "arming",
        "Give the gateway the table of its events: then it names the check.",
        r"\((\d+ modes?|all modes)\)",
    ),
    _row("arming", "Read the messages of the autopilot in a ground station.", "sys_status: "),
)
"""By the words of an autopilot; the first row that matches decides."""


def step_for(text: str) -> TextRemedy | None:
    """The row for words of an autopilot; None if no row matches."""
    return next((one for one in TEXTS if one.pattern.match(text[:MOST])), None)
