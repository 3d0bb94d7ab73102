"""Causes of an error: SYS_STATUS, texts and parts."""
