"""Robots that serve their status by ROS-Industrial's simple_message: arms, and other gateways."""
