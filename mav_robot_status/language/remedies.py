"""What each cause and inhibit means in words, and what a person can do about it.

A step never says that something is safe, and never turns a check off. It holds for every robot that has the name.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from ..json_object import JsonMapping
from .texts import step_for


class Remedy(NamedTuple):
    """One row."""

    sentence: str
    """What it is, as the end of "Cannot move: ...": lower case, without a full stop."""
    step: str = ""
    """What to do next: whole sentences. Empty: nothing, or the text of the autopilot says it."""
    topic: str = ""
    """The heading of docs/how-to/cannot-move.md that has more; empty: it has nothing more."""
    person: bool = True
    """Whether it needs a person. Disarmed is the calm state of a parked robot, and does not."""


_SYSID: Final = "Give each autopilot its own system id (SYSID_THISMAV)."
_CHARGE: Final = "Charge or change the battery."
_RETURN: Final = "Bring it back or land it."
_FIX: Final = "Be ready to take it over. Wait for a fix or check the antenna."
_REST: Final = "Land it or bring it to rest."
_CALIBRATE: Final = f"{_REST} Restart the autopilot, and calibrate the sensor if this persists."
_CABLE: Final = f"{_REST} Check the cable, the power and the settings of this sensor."
_OPEN_SKY: Final = "Take it over or bring it to rest. Let it find its position again, still and under open sky."
_INSPECT: Final = "Find out what happened, and inspect the vehicle before it is armed again."
_MOTORS: Final = f"{_REST} Disarm it, then check its motors, motor controllers and cables."
_REPORT: Final = f"{_REST} Restart the autopilot, and have it checked if this comes back."
_NAMED: Final = "Clear what the autopilot names."
_LOOK: Final = "Read the messages of the autopilot in a ground station."
_FIND_STOP: Final = "Find out why it was stopped, clear the cause, and confirm that on the teach pendant."

INHIBIT_ROWS: Final[dict[str, Remedy]] = {
    "LINK_STALE": Remedy("its autopilot is not heard", "Check its power, the radio and the cable.", "link"),
    "DISARMED": Remedy("it is disarmed", "To drive, arm it.", "disarmed", person=False),
    "E_STOPPED": Remedy(
        "the emergency stop is engaged",
        "Find out why the emergency stop is engaged, clear the cause, then release it.",
        "emergency-stop",
    ),
    "SAFETY_SWITCH": Remedy(
        "the hardware safety switch holds the outputs",
        "Keep clear of everything that can turn, then hold the safety switch of the vehicle until its light changes.",
        "safety-switch",
    ),
    "PREARM_FAILING": Remedy("it cannot be armed", _LOOK, "arming"),
    "INITIALISING": Remedy("the autopilot is starting", "Wait, and keep the vehicle still.", "starting", person=False),
    "CALIBRATING": Remedy(
        "the autopilot is calibrating its sensors", "Wait, and keep the vehicle still.", "starting", person=False
    ),
    "POWERING_OFF": Remedy("the autopilot is shutting down", "To drive, switch it on again.", "starting", person=False),
    "TERMINATION": Remedy("its operation was terminated", _INSPECT, "crash"),
    "EMERGENCY": Remedy("the autopilot reports an emergency", _INSPECT, "crash"),
    "HIL": Remedy(
        "it runs a simulation, and its actuators are blocked", "End the simulation on the autopilot.", "simulation"
    ),
    "SYS_STATUS_MISSING": Remedy(
        "the autopilot does not report its checks",
        "Let the autopilot send SYS_STATUS here. The command doctor says how.",
        "link",
    ),
    "MODE_MANUAL": Remedy(
        "a pilot drives it", "For a program to drive it, select an automatic mode.", "mode", person=False
    ),
    "STOP_UNCERTAIN": Remedy(
        "an emergency stop may still be engaged",
        "Look at its emergency stop, and let the autopilot report it.",
        "emergency-stop",
    ),
    "SENDER_UNCERTAIN": Remedy("another device may use its system id", _SYSID, "senders"),
    "HEARTBEAT_LATE": Remedy(
        "frames arrive, but the heartbeat is late",
        "Look for a radio or a program that stores frames. The command doctor says how late they are.",
        "link",
    ),
    "LOG_GAP": Remedy(
        "the log does not tell", "Look at what the log holds. The command doctor says what it lacks.", "link"
    ),
    "MOTION_NOT_POSSIBLE": Remedy("no reason was reported", "Look at its own display.", "robot-arm"),
}
"""The inhibits of a vehicle and of a group."""

ERROR_ROWS: Final[dict[str, Remedy]] = {
    "FLIGHT_TERMINATION": Remedy("its operation was terminated", _INSPECT, "crash"),
    "TERMINATION_ANNOUNCED": Remedy("its operation is being terminated", _INSPECT, "crash"),
    "CRASH": Remedy("it has crashed", _INSPECT, "crash"),
    "DISARMED_IN_FLIGHT": Remedy("it was disarmed in flight and fell", _INSPECT, "crash"),
    "ATTITUDE_FAILURE": Remedy("it has lost its attitude", _INSPECT, "crash"),
    "THRUST_LOSS": Remedy("a motor may have lost its thrust", _MOTORS, "motors"),
    "PARACHUTE": Remedy("its parachute was released", _INSPECT, "crash"),
    "HARD_LANDING": Remedy("it has landed hard", _INSPECT, "crash"),
    "EMERGENCY": Remedy("the autopilot reports an emergency", _INSPECT, "crash"),
    "LEAK": Remedy("water has entered", "Bring it to the surface and take it out of the water.", "crash"),
    "BATTERY_CRITICAL": Remedy("the battery is nearly empty", f"Bring it back or land it now. {_CHARGE}", "battery"),
    "ESTIMATOR": Remedy("it is not sure of its attitude or position", _OPEN_SKY, "position"),
    "RC_LOST": Remedy(
        "the transmitter is not heard", "Switch the transmitter on, and check its range and its receiver.", "radio"
    ),
    "GCS_LOST": Remedy(
        "the ground station is not heard by the autopilot",
        "Connect the ground station, or the computer that drives it, again.",
        "ground-station",
    ),
    "BATTERY_LOW": Remedy("the battery is low", f"{_RETURN} {_CHARGE}", "battery"),
    "TERRAIN": Remedy("it lacks terrain data", "Connect the ground station, which provides it.", "mission"),
    "TRAFFIC": Remedy("other traffic is near", "Wait until the traffic has passed, and give way.", "surroundings"),
    "GPS": Remedy("the GPS position is not reliable", _FIX, "gps"),
    "GEOFENCE": Remedy("it is outside its fence", "Bring it back inside its fence.", "surroundings"),
    "PRESSURE": Remedy("the pressure inside its hull is too high", "Bring it to the surface and check it.", "crash"),
    "TEMPERATURE": Remedy("it is too hot inside its hull", "Bring it to the surface and let it cool.", "crash"),
    "DEPTH_SENSOR": Remedy("the depth sensor fails", f"Bring it to the surface. {_CABLE}", "sensors"),
    "YAW_IMBALANCE": Remedy("its motors pull to one side", _MOTORS, "motors"),
    "INTERNAL_ERROR": Remedy("the autopilot has an internal error", _REPORT, "autopilot"),
    "CONFIGURATION": Remedy(
        "the autopilot has a wrong setting", "Correct the setting that it names, then restart it.", "configuration"
    ),
    "WATCHDOG_RESET": Remedy("the autopilot was reset by its watchdog", _REPORT, "autopilot"),
    "REBOOT_WHILE_ARMED": Remedy(
        "the autopilot restarted while it was armed",
        "Check its power supply, then read its log for the reason.",
        "autopilot",
    ),
    "FAILSAFE": Remedy(
        "a failsafe is active", "Check the transmitter, the ground station, the battery and the position.", "failsafe"
    ),
    "ESC_FAILURE": Remedy("a motor controller fails", _MOTORS, "motors"),
    "BATTERY_FAULT": Remedy("the battery reports a fault", f"{_RETURN} Change the battery.", "battery"),
    "OFFBOARD_LOST": Remedy(
        "the computer that drives it is not heard",
        "Start the program that drives it, and check its connection.",
        "ground-station",
    ),
    "MISSION": Remedy(
        "its mission cannot continue", "Check the mission, and write it to the autopilot again.", "mission"
    ),
    "SYSTEM_ID_CONFLICT": Remedy("two autopilots use one system id", _SYSID, "senders"),
    "LINK_LOST": Remedy("its autopilot is not heard", "Check its power, the radio and the cable.", "link"),
    **{
        f"TEXT_{level}": Remedy("the autopilot reports a problem", _LOOK, "arming")
        for level in ("EMERGENCY", "ALERT", "CRITICAL")
    },
    **{f"EVENT_{level}": Remedy("the autopilot reports a problem", _LOOK, "arming") for level in range(3)},
}
"""The causes of errors of a vehicle, without the sensors."""


def _unhealthy(what: str, step: str, topic: str) -> Remedy:
    return Remedy(f"{what} is not healthy", step, topic)


SENSOR_ROWS: Final[dict[str, Remedy]] = {
    **dict.fromkeys(("3D_GYRO", "3D_GYRO2"), _unhealthy("a gyro", _CALIBRATE, "sensors")),
    **dict.fromkeys(("3D_ACCEL", "3D_ACCEL2"), _unhealthy("an accelerometer", _CALIBRATE, "sensors")),
    **dict.fromkeys(
        ("3D_MAG", "3D_MAG2"),
        _unhealthy(
            "a compass", "Take it away from metal and bring it to rest. Then check the cable of the compass.", "compass"
        ),
    ),
    "ABSOLUTE_PRESSURE": _unhealthy("the barometer", _REPORT, "sensors"),
    "DIFFERENTIAL_PRESSURE": _unhealthy("the airspeed sensor", _CABLE, "sensors"),
    "GPS": _unhealthy("the GPS receiver", _FIX, "gps"),
    "OPTICAL_FLOW": _unhealthy("the optical flow sensor", _CABLE, "sensors"),
    "VISION_POSITION": _unhealthy("the position from vision", _CABLE, "sensors"),
    "LASER_POSITION": _unhealthy("the rangefinder", _CABLE, "sensors"),
    "EXTERNAL_GROUND_TRUTH": _unhealthy("the external position", _CABLE, "sensors"),
    "ANGULAR_RATE_CONTROL": _unhealthy("the control of its rotation", _OPEN_SKY, "position"),
    "ATTITUDE_STABILIZATION": _unhealthy("the control of its attitude", _OPEN_SKY, "position"),
    "YAW_POSITION": _unhealthy("the control of its heading", _OPEN_SKY, "position"),
    "Z_ALTITUDE_CONTROL": _unhealthy("the control of its altitude", _OPEN_SKY, "position"),
    "XY_POSITION_CONTROL": _unhealthy("the control of its position", _OPEN_SKY, "position"),
    "MOTOR_OUTPUTS": Remedy("the outputs to its motors are not healthy", _MOTORS, "motors"),
    "RC_RECEIVER": Remedy(
        "the transmitter is not heard", "Switch the transmitter on, and check its range and its receiver.", "radio"
    ),
    "GEOFENCE": Remedy("it is outside its fence", "Bring it back inside its fence.", "surroundings"),
    "AHRS": Remedy("it is not sure of its attitude or position", _OPEN_SKY, "position"),
    "TERRAIN": Remedy("it lacks terrain data", "Connect the ground station, which provides it.", "mission"),
    "REVERSE_MOTOR": Remedy("its motors are reversed", _MOTORS, "motors"),
    "LOGGING": Remedy("it cannot write its log", f"{_REST} Check the SD card of the autopilot.", "logging"),
    "BATTERY": Remedy(
        "the battery or its monitor fails",
        f"{_RETURN} {_CHARGE} Then check the cable of its monitor.",
        "battery",
    ),
    "PROXIMITY": _unhealthy("the proximity sensor", _CABLE, "sensors"),
    "SATCOM": Remedy("the satellite link fails", "Check the satellite modem and its antenna.", "link"),
    "PREARM_CHECK": Remedy("it cannot be armed", _LOOK, "arming"),
    "OBSTACLE_AVOIDANCE": _unhealthy("the obstacle avoidance", _CABLE, "sensors"),
    "PROPULSION": Remedy("a motor or its controller fails", _MOTORS, "motors"),
    "RECOVERY_SYSTEM": _unhealthy("the parachute", "Check the parachute and its settings.", "configuration"),
    "LEAK": Remedy("water has entered", "Bring it to the surface and take it out of the water.", "crash"),
}
"""The parts that SYS_STATUS reports, by the name of the bit."""
SENSOR: Final = Remedy("a sensor is not healthy", "Read the autopilot's message below.", "sensors")
"""A bit without a name."""

ARM_ROWS: Final[dict[str, Remedy]] = {
    "SAFETY_FAULT": Remedy(
        "its safety system has a fault",
        "Read the fault on the teach pendant. Restart the controller after its cause is cleared.",
        "robot-arm",
    ),
    "SAFETY_VIOLATION": Remedy("a limit of its safety system was exceeded", _FIND_STOP, "robot-arm"),
    "PROTECTIVE_STOP": Remedy("a protective stop is active", _FIND_STOP, "robot-arm"),
    "SAFEGUARD_STOP": Remedy(
        "a safeguard is open", "Leave the protected area, close it, and reset the safeguard.", "robot-arm"
    ),
    "SAFETY_STOP": Remedy("its safety system stopped it", _FIND_STOP, "robot-arm"),
    "NO_CONTROLLER": Remedy("its controller is not ready", "Wait, then restart the controller.", "robot-arm"),
    "DISCONNECTED": Remedy(
        "the arm is not connected to its controller", "Check the cable between arm and controller.", "robot-arm"
    ),
    "CONFIRM_SAFETY": Remedy(
        "a person must confirm its safety configuration", "Confirm it on the teach pendant.", "robot-arm"
    ),
    "BOOTING": Remedy("the controller is starting", "Wait until the controller has started.", "starting", person=False),
    "POWER_OFF": Remedy("the arm has no power", "To move it, switch the arm on.", "robot-arm", person=False),
    "BRAKES_ENGAGED": Remedy("its brakes are engaged", "To move it, release the brakes.", "robot-arm", person=False),
    "BACKDRIVE": Remedy("a person moves it by hand", "Wait until that person has finished.", "robot-arm", person=False),
    "UPDATING_FIRMWARE": Remedy(
        "its firmware is being updated", "Wait, and leave the controller switched on.", "starting", person=False
    ),
    "NOT_RUNNING": Remedy("the arm does not run", "Look at its state on the teach pendant.", "robot-arm"),
    "CONTROLLER_ERROR": Remedy(
        "its controller reports an error", "Read the error on the display of the controller, and clear it.", "robot-arm"
    ),
}
"""The inhibits and errors of an arm."""

REMEDIES: Final[dict[str, Remedy]] = {
    **INHIBIT_ROWS,
    **ERROR_ROWS,
    **{f"SENSOR_{name}": row for name, row in SENSOR_ROWS.items()},
    **ARM_ROWS,
}
"""By the name of an inhibit or of an error cause."""

WHILE_ARMED: Final = frozenset(name for name in ERROR_ROWS if name.startswith(("TEXT_", "EVENT_")))
"""Words that the autopilot says while it is armed: it may be moving."""
WORDS_DECIDE: Final = WHILE_ARMED | {"PREARM_FAILING", "CONFIGURATION"}
"""The names that say nothing by themselves: the step depends on the autopilot's words."""


def remedy(cause: JsonMapping) -> Remedy:
    """The row for an error or inhibit of a JSON line. A name without a row is spoken as it is."""
    name, text = str(cause.get("name", "")), cause.get("text")
    row = REMEDIES.get(name) or (SENSOR if name.startswith("SENSOR_") else Remedy(spoken(name)))
    known = name in REMEDIES and name not in WORDS_DECIDE
    if known or not isinstance(text, str) or not text:
        return row
    found = step_for(text)
    step, topic = (found.step, found.topic) if found else (_NAMED, row.topic)
    return row._replace(step=f"{_REST} {step}" if name in WHILE_ARMED else step, topic=topic)


INITIALS: Final = {"gps": "GPS", "rc": "RC", "ekf": "EKF", "imu": "IMU", "esc": "ESC", "hil": "HIL", "gcs": "GCS"}
"""The words of names that are initials."""


def spoken(name: str) -> str:
    """`ESC_FAILURE` as words: `esc failure`."""
    return name.replace("_", " ").lower()
