"""Where statuses go: one module each, registered as entry points `mav_robot_status.publishers`."""
