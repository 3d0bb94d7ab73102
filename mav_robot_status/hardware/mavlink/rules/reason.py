"""The reason of a rule for the value of a field. `evidence` renders it as text."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from ....interface.status import TriState

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN


class Source(Enum):
    """What a rule decided on."""

    NONE = "nothing"
    HEARTBEAT = "HEARTBEAT"
    BASE_MODE = "HEARTBEAT.base_mode"
    CUSTOM_MODE = "HEARTBEAT.custom_mode"
    MODE_NUMBER = "HEARTBEAT.custom_mode with its number"
    STATE = "HEARTBEAT.system_status"
    STATE_AND_RC = "HEARTBEAT.system_status, and RC_RECEIVER in SYS_STATUS"
    SYS_STATUS = "SYS_STATUS"
    SAFETY_SWITCH = "MOTOR_OUTPUTS in SYS_STATUS"
    PREARM_CHECK = "PREARM_CHECK in SYS_STATUS"
    INTERNAL_ERRORS = "errors_count in SYS_STATUS"
    SENSOR = "a bit in SYS_STATUS"
    VERSION = "the version of the firmware"
    SWITCHES = "RCn_OPTION"
    STOP = "what was said of an emergency stop"
    APPLET = "RS_STOP"
    APPLET_AND_OUTPUTS = "RS_STOP against SERVO_OUTPUT_RAW"
    RC_CHANNELS = "RC_CHANNELS, with RCn_OPTION"
    LATCH = "what announced a cause"
    PARTS = "what faulty parts reported"
    CLAIMS = "what the senders with these ids say"
    ESC = "ESC telemetry"
    OUTPUTS = "SERVO_OUTPUT_RAW"
    LANDED_STATE = "EXTENDED_SYS_STATE"
    LANDED_NUMBER = "EXTENDED_SYS_STATE with its number"
    VELOCITY = "the message that gives the speed"
    GPS = "GPS_RAW_INT"
    ATTITUDE = "ATTITUDE"
    HIGH_LATENCY = "HIGH_LATENCY2"


class Reason(NamedTuple):
    """The rule that decided, and its source."""

    rule: str
    source: Source = Source.NONE
    code: int = 0
    """The code of the cause, if the source is a cause."""
    doubt: bool = False
    """Of an unknown e_stopped: whether there is evidence of a stop, so that the drives may have no power."""


Finding = tuple[TriState, Reason]
