"""The running emulator: clock, signals, control channel, trace."""
