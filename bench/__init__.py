"""Benchmarks of the gateway and of other MAVLink programs, in one run on one machine: `python -m bench`."""
