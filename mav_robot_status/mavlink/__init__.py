"""Bytes <-> messages: framing, decoding, encoding, who we are, and the generated dialect."""
