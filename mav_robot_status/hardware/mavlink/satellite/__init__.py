"""HIGH_LATENCY2: a vehicle behind a satellite."""
