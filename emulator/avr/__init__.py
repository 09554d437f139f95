"""The real firmware: C for an ATmega328P in `firmware/`, and its simulator, in which it runs against the plant."""
