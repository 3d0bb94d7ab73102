"""Child programs. Each does one job with one library, so that its CPU time contains only that job."""
