"""One module for each field of a RobotStatus, or for a few that belong together: pure functions with evidence."""
