"""The `simple_message` publisher: serves the status of one handle to ROS-Industrial, over its own TCP protocol.

The protocol and its messages: the package `simple_message` of ROS-Industrial's industrial_core, and REP-I0004, which
assigns the message types.
"""
