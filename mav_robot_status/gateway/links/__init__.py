"""The live links: who is there, what is received, what is sent."""
