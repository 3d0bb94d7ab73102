"""The fields of the ROS 2 messages that rosbags does not know. It reads these texts.

industrial_msgs: the branch `ros2_msgs_only` of industrial_core; control_msgs: 6.5.0.
"""

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
CONTROL_MSGS = {
    "control_msgs/msg/CANopenState": "uint8 node_id\nuint8 nmt_state\nuint8 dsp_402_state\nuint32 last_emcy_code",
    "control_msgs/msg/EtherCATState": """
        uint16 slave_position
        string vendor_id
        string product_code
        uint8 al_state
        bool has_error
        uint16 al_status_code
    """,
    "control_msgs/msg/VDA5050State": """
        string order_id
        string action_status
        uint32 last_node_id
        bool driving
        float64 battery_charge
        string operating_mode
        string error_type
        string error_description
    """,
    "control_msgs/msg/GenericHardwareState": """
        uint8 health_status
        uint8[] error_domain
        uint8 operational_mode
        uint8 power_state
        uint8 connectivity_status
        string manufacturer
        string model
        string firmware_version
        diagnostic_msgs/KeyValue[] state_details
    """,
    "control_msgs/msg/HardwareDeviceStatus": """
        std_msgs/Header header
        string device_id
        control_msgs/GenericHardwareState[] hardware_status
        control_msgs/CANopenState[] canopen_states
        control_msgs/EtherCATState[] ethercat_states
        control_msgs/VDA5050State[] vda5050_states
    """,
    "control_msgs/msg/HardwareStatus": """
        std_msgs/Header header
        string hardware_id
        control_msgs/HardwareDeviceStatus[] hardware_device_states
    """,
}
