"""One module for each field of a RobotStatus, or for a few related ones: pure functions with evidence."""
