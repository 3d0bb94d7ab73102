"""The frames of a recorded log, each with its time."""
