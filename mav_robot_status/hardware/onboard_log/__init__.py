"""Onboard logs: what an autopilot has recorded itself, as a hardware interface of its own."""
