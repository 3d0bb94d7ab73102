"""The definitions of the ROS 2 messages that we write to files, as `ros2msg` has them: the parts follow the message."""

from __future__ import annotations

from typing import Final

_HEADER: Final = """\
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""

DEFINITIONS: Final = {
    "industrial_msgs/msg/RobotStatus": f"""\
std_msgs/Header header
industrial_msgs/RobotMode mode
industrial_msgs/TriState e_stopped
industrial_msgs/TriState drives_powered
industrial_msgs/TriState motion_possible
industrial_msgs/TriState in_motion
industrial_msgs/TriState in_error
int32[] error_codes
================================================================================
MSG: industrial_msgs/RobotMode
int8 UNKNOWN=-1
int8 MANUAL=1
int8 AUTO=2
int8 val
================================================================================
MSG: industrial_msgs/TriState
int8 UNKNOWN=-1
int8 TRUE=1
int8 FALSE=0
int8 val
{_HEADER}""",
    "diagnostic_msgs/msg/DiagnosticArray": f"""\
std_msgs/Header header
diagnostic_msgs/DiagnosticStatus[] status
================================================================================
MSG: diagnostic_msgs/DiagnosticStatus
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
byte level
string name
string message
string hardware_id
diagnostic_msgs/KeyValue[] values
================================================================================
MSG: diagnostic_msgs/KeyValue
string key
string value
{_HEADER}""",
}
"""By the name of the message."""
