"""The fields of the ROS 2 messages of industrial_msgs, as its branch `ros2` has them. rosbags reads these texts."""

INDUSTRIAL_MSGS = {
    "industrial_msgs/msg/TriState": "int8 val",
    "industrial_msgs/msg/RobotMode": "int8 val",
    "industrial_msgs/msg/RobotStatus": """
        std_msgs/Header header
        industrial_msgs/RobotMode mode
        industrial_msgs/TriState e_stopped
        industrial_msgs/TriState drives_powered
        industrial_msgs/TriState motion_possible
        industrial_msgs/TriState in_motion
        industrial_msgs/TriState in_error
        int32[] error_codes
    """,
}
