"""Requests to an autopilot: for missing messages and for parameters."""
