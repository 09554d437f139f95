"""The wire between a client and the rotary table."""
