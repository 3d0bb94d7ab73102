"""The MAVLink hardware interface: frames in, statuses in named handles out. Start with `interface`."""
