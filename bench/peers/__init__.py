"""Child programs: each does one job with one library, so that nothing but that job is in its CPU time."""
