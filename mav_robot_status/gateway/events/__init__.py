"""The tables of PX4's events, from a file, the cache or the vehicle."""
