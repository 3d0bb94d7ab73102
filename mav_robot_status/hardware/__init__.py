"""The MAVLink hardware interface: frames in, statuses in named handles out. `robot_hw` is the way in."""
