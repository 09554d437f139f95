"""The running emulator: clock, signals, control channel and trace."""
