"""The running program: `event_loop` and `replay` drive a `pipeline`, one on live hardware, one on a recorded log."""
