"""Statuses in MCAP files: `settings` has the options, `file` writes one file, `publisher` decides which."""
