"""Writes the MAVLink definitions that the gateway needs: `python dialects/generate.py [OUTPUT_FOLDER]`.

Input: the XML files inside pymavlink (ArduPilot's definitions, all vendors), `upstream.xml` (messages that only
mavlink/mavlink has) and `mav_robot_status.xml` (ours). Output, below `mav_robot_status` or below OUTPUT_FOLDER:

* `mavlink/definitions.py`: CRC_EXTRA of every known message id; layout of the messages that the gateway uses, without
  the fields that it does not read; names of enumerations.
* `mavlink/enumerations.py`: message ids and the values of enumerations by their MAVLink names, as plain integers.

`tests/unit/mavlink/test_definitions.py` runs this and compares the files, so they cannot be edited by hand.
"""

from __future__ import annotations

import pathlib
import sys

from pymavlink import dialects as pymavlink_dialects
from pymavlink.generator import mavparse

HERE = pathlib.Path(__file__).resolve().parent
XML = pathlib.Path(pymavlink_dialects.__file__ or "").parent / "v20"

# The vendors' files. Each is parsed without its includes. matrixpilot and paparazzi are not in the list: they give ids
# of ardupilotmega another meaning.
PUBLIC = (
    "minimal standard common development ardupilotmega uAvionix icarous loweheiser cubepilot csAirLink ASLUAV "
    "ualberta storm32 AVSSUAS python_array_test test"
).split()

# CRC_EXTRA of ids that only mavlink/mavlink defines (common.xml, minimal.xml). We only check and forward these.
UPSTREAM_CRC_EXTRA = {
    8: 117, 19: 137, 52: 132, 80: 14, 300: 217, 334: 72, 336: 245, 380: 232, 395: 0, 400: 110, 401: 183,
}  # fmt: skip

# The messages that the gateway reads or writes.
USED = (
    "HEARTBEAT SYS_STATUS SYSTEM_TIME SET_MODE PARAM_REQUEST_READ PARAM_VALUE GPS_RAW_INT ATTITUDE "
    "LOCAL_POSITION_NED GLOBAL_POSITION_INT SERVO_OUTPUT_RAW REQUEST_DATA_STREAM VFR_HUD COMMAND_INT COMMAND_LONG "
    "COMMAND_ACK AUTOPILOT_VERSION MESSAGE_INTERVAL EXTENDED_SYS_STATE NAMED_VALUE_FLOAT NAMED_VALUE_INT STATUSTEXT "
    "ESC_INFO ESC_STATUS EVENT CURRENT_EVENT_SEQUENCE REQUEST_EVENT RESPONSE_EVENT_ERROR COMPONENT_METADATA "
    "FILE_TRANSFER_PROTOCOL HIGH_LATENCY2 BATTERY_STATUS OPEN_DRONE_ID_ARM_STATUS "
    "MISSION_CURRENT RC_CHANNELS AVAILABLE_MODES CURRENT_MODE AVAILABLE_MODES_MONITOR "
    "EKF_STATUS_REPORT ESC_TELEMETRY_1_TO_4 ESC_TELEMETRY_5_TO_8 ESC_TELEMETRY_9_TO_12 ROBOT_STATUS"
).split()

# Fields that the gateway does not read, in messages that are frequent or have many fields. Frames that we send have
# zeros in these fields.
UNREAD = {
    "SYS_STATUS": "load voltage_battery current_battery drop_rate_comm errors_comm errors_count3 errors_count4 "
    "battery_remaining",
    "GPS_RAW_INT": "time_usec lat lon alt eph epv cog satellites_visible alt_ellipsoid h_acc v_acc vel_acc hdg_acc yaw",
    "ATTITUDE": "roll pitch yaw",
    "LOCAL_POSITION_NED": "x y z",
    "GLOBAL_POSITION_INT": "alt relative_alt hdg",
    "SERVO_OUTPUT_RAW": "time_usec",
    "VFR_HUD": "airspeed alt heading",
    "EKF_STATUS_REPORT": "velocity_variance pos_horiz_variance pos_vert_variance compass_variance terrain_alt_variance "
    "airspeed_variance",
    "ESC_INFO": "time_usec counter connection_type error_count temperature",
    "BATTERY_STATUS": "current_consumed energy_consumed temperature voltages current_battery battery_function type "
    "battery_remaining time_remaining voltages_ext mode",
    "HIGH_LATENCY2": "altitude target_altitude target_distance wp_num heading target_heading throttle airspeed "
    "airspeed_sp windspeed wind_heading temperature_air battery",
    "MISSION_CURRENT": "seq total mission_mode",
    "RC_CHANNELS": "time_boot_ms chancount rssi",
    "AUTOPILOT_VERSION": "capabilities uid middleware_sw_version os_sw_version board_version vendor_id product_id "
    "flight_custom_version middleware_custom_version os_custom_version uid2",
}

# Enumerations with names that the user sees, and the prefix to remove.
ENUMS = {
    "AUTOPILOT_NAMES": ("MAV_AUTOPILOT", "MAV_AUTOPILOT_"),
    "TYPE_NAMES": ("MAV_TYPE", "MAV_TYPE_"),
    "STATE_NAMES": ("MAV_STATE", "MAV_STATE_"),
    "SEVERITY_NAMES": ("MAV_SEVERITY", "MAV_SEVERITY_"),
}
BIT_ENUMS = {
    "SENSOR_NAMES": ("MAV_SYS_STATUS_SENSOR", "MAV_SYS_STATUS_"),
    "EXTENDED_SENSOR_NAMES": ("MAV_SYS_STATUS_SENSOR_EXTENDED", "MAV_SYS_STATUS_"),
}

# Enumerations whose values the code uses by name: whole ones, and single values of the long ones.
NAMED_ENUMS = (
    "MAV_AUTOPILOT MAV_TYPE MAV_STATE MAV_SEVERITY MAV_MODE_FLAG MAV_RESULT MAV_LANDED_STATE MAV_VTOL_STATE "
    "MAV_BATTERY_CHARGE_STATE MAV_BATTERY_FAULT ESC_FAILURE_FLAGS HL_FAILURE_FLAG MAV_ODID_ARM_STATUS "
    "GPS_FIX_TYPE MAV_STANDARD_MODE MAV_MODE_PROPERTY MAV_DATA_STREAM EKF_STATUS_FLAGS MAV_SYS_STATUS_SENSOR"
).split()
NAMED_VALUES = (
    "MAV_CMD_COMPONENT_ARM_DISARM MAV_CMD_DO_FLIGHTTERMINATION MAV_CMD_DO_AUX_FUNCTION "
    "MAV_CMD_DO_MOTOR_TEST MAV_CMD_ACTUATOR_TEST "
    "MAV_CMD_GET_MESSAGE_INTERVAL MAV_CMD_SET_MESSAGE_INTERVAL "
    "MAV_CMD_REQUEST_MESSAGE MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES MAV_CMD_RUN_PREARM_CHECKS "
    "MAV_COMP_ID_ALL MAV_COMP_ID_AUTOPILOT1 MAV_COMP_ID_ONBOARD_COMPUTER "
    "MAV_COMP_ID_ODID_TXRX_1 MAV_COMP_ID_ODID_TXRX_2 MAV_COMP_ID_ODID_TXRX_3 "
    "MAV_COMP_ID_ONBOARD_COMPUTER2 MAV_COMP_ID_ONBOARD_COMPUTER3 MAV_COMP_ID_ONBOARD_COMPUTER4"
).split()

STRUCT_CODES = {
    "char": "c", "uint8_t": "B", "uint8_t_mavlink_version": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h",
    "uint32_t": "I", "int32_t": "i", "uint64_t": "Q", "int64_t": "q", "float": "f", "double": "d",
}  # fmt: skip
# Field names that are also methods of a tuple.
SHADOWS = dict.fromkeys(("count", "index"), "  # type: ignore[assignment]")
HEADER = '"""{}\n\nGenerated by dialects/generate.py: do not edit.\n"""\n\n'
IMPORTS = """from __future__ import annotations

from struct import Struct
from typing import Any, Final, NamedTuple
"""


def sources() -> list[pathlib.Path]:
    """The XML files that are read."""
    return [XML / f"{name}.xml" for name in PUBLIC] + [HERE / "upstream.xml", HERE / "mav_robot_status.xml"]


def parse(path: pathlib.Path) -> mavparse.MAVXML:
    """One XML file without its includes, for MAVLink 2."""
    return mavparse.MAVXML(str(path), mavparse.PROTOCOL_2_0)


def field_code(field: mavparse.MAVField) -> tuple[str, str]:
    """The struct code and the Python type of a field; arrays are kept as raw bytes."""
    if field.array_length:
        return f"{field.array_length * field.type_length}s", "bytes"
    return STRUCT_CODES[field.type], "float" if field.type in ("float", "double") else "int"


def read_fields(message: mavparse.MAVType) -> list[mavparse.MAVField]:
    """The fields of a message, in wire order, that the gateway reads."""
    unread = UNREAD.get(message.name, "").split()
    assert {f.name for f in message.ordered_fields}.issuperset(unread), message.name
    return [f for f in message.ordered_fields if f.name not in unread]


def layout(message: mavparse.MAVType, known: list[mavparse.MAVField]) -> str:
    """The struct of the known fields, up to the last of them."""
    codes = ""
    skipped = 0
    for field in message.ordered_fields:
        if field not in known:
            skipped += max(field.array_length, 1) * field.type_length
            continue
        codes += (f"{skipped}x" if skipped else "") + field_code(field)[0]
        skipped = 0
    return "<" + codes


def message_class(message: mavparse.MAVType, known: list[mavparse.MAVField]) -> str:
    """The class of one message, with its known fields."""
    out = f"class {class_name(message.name)}(NamedTuple):\n"
    out += f'    """{message.name}, id {message.id}; the known fields in wire order, arrays as raw bytes."""\n\n'
    out += "".join(f"    {f.name}: {field_code(f)[1]}{SHADOWS.get(f.name, '')}\n" for f in known)
    return out + "\n\n"


def message_row(message: mavparse.MAVType, known: list[mavparse.MAVField]) -> str:
    """The row of one message in the table of definitions."""
    struct = f'Struct("{layout(message, known)}")'
    row = f'{message.id}, "{message.name}", {message.wire_length}, {struct}, {class_name(message.name)}'
    return f"    {message.id}: Definition({row}),\n"


def definitions(files: list[mavparse.MAVXML]) -> str:
    """The text of definitions.py."""
    crc = dict(UPSTREAM_CRC_EXTRA)
    messages = {}
    enums: dict[str, mavparse.MAVEnum] = {}
    for file in files:
        crc.update({m.id: m.crc_extra for m in file.message})
        messages.update({m.name: m for m in file.message if m.name in USED})
        enums.update({e.name: e for e in file.enum})
    out = [HEADER.format("The MAVLink definitions that the gateway needs.")]
    out.append(IMPORTS + "\n\n")
    out += [message_class(messages[name], read_fields(messages[name])) for name in USED]
    out.append("class Definition(NamedTuple):\n")
    out.append(
        '    """The layout of one message: `size` in bytes with extensions; `layout` of the known fields."""\n\n'
    )
    out.append("    id: int\n    name: str\n    size: int\n    layout: Struct\n    type: Any\n\n\n")
    out.append("MESSAGES: Final[dict[int, Definition]] = {\n")
    out += [message_row(messages[name], read_fields(messages[name])) for name in USED]
    out.append("}\n")
    for table, (enum, prefix) in ENUMS.items():
        out.append(f"{table}: Final[dict[int, str]] = {{\n")
        for entry in enums[enum].entry:
            if not entry.name.endswith("ENUM_END"):
                out.append(f'    {entry.value}: "{entry.name.removeprefix(prefix)}",\n')
        out.append("}\n")
    for table, (enum, prefix) in BIT_ENUMS.items():
        out.append(f"{table}: Final[dict[int, str]] = {{\n")
        for entry in enums[enum].entry:
            if not entry.name.endswith("ENUM_END"):
                name = entry.name.removeprefix(prefix).removeprefix("SENSOR_")
                out.append(f'    {entry.value.bit_length() - 1}: "{name}",\n')
        out.append("}\n")
    out.append("# fmt: off\nCRC_EXTRA: Final[dict[int, int]] = {\n")
    ids = sorted(crc)
    for i in range(0, len(ids), 12):
        out.append("    " + " ".join(f"{n}: {crc[n]}," for n in ids[i : i + 12]) + "\n")
    out.append("}\n# fmt: on\n")
    return "".join(out)


def enumerations(files: list[mavparse.MAVXML]) -> str:
    """The text of enumerations.py."""
    ids = {message.name: message.id for file in files for message in file.message}
    enums: dict[str, dict[str, int]] = {}
    for enum in (enum for file in files for enum in file.enum):  # several files define parts of MAV_CMD and others
        values = {entry.name: entry.value for entry in enum.entry if not entry.name.endswith("ENUM_END")}
        enums.setdefault(enum.name, {}).update(values)
    every = {name: value for values in enums.values() for name, value in values.items()}
    out = [HEADER.format("Message ids and values of MAVLink's enumerations, by name: plain integers.")]
    out.append("from typing import Final\n\n")
    out += [f"MAVLINK_MSG_ID_{name}: Final = {ids[name]}\n" for name in USED]
    for name in NAMED_ENUMS:
        entries = sorted(enums[name].items(), key=lambda entry: entry[1])
        out += [f"{entry}: Final = {value}\n" for entry, value in entries]
    out += [f"{name}: Final = {every[name]}\n" for name in NAMED_VALUES]
    return "".join(out)


def class_name(message: str) -> str:
    """GLOBAL_POSITION_INT -> GlobalPositionInt."""
    return "".join(part.capitalize() for part in message.split("_"))


def main() -> int:
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE.parent / "mav_robot_status"
    files = [parse(path) for path in sources()]
    for name, text in (
        ("mavlink/definitions.py", definitions(files)),
        ("mavlink/enumerations.py", enumerations(files)),
    ):
        (out / name).parent.mkdir(exist_ok=True)
        (out / name).write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
