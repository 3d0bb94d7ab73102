"""Fuzzing of all code that reads untrusted data: `python -m fuzz --help`. See docs/how-to/fuzzing.md."""
