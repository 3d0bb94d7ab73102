"""HEARTBEAT: armed, the flight mode, and what the vehicle is."""
