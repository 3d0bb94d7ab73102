"""Conformance tests for the plugins of other packages."""
