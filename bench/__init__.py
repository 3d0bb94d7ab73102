"""Measures the gateway beside others that read MAVLink, in one run on one machine: `python -m bench`."""
