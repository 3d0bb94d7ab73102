"""Flight modes by autopilot: tables only. A new autopilot is one more file here and one line in `flight_mode`."""
