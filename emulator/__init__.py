"""The stand-in rotary table: firmware and plant behind a virtual serial port."""
