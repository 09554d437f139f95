"""A rotary table in ten lines: no hardware, no port, simulated time."""

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from protocol import TableClient

with TableClient.open("emulator://") as table:  # or "/dev/ttyUSB0", the same code for a real table
    table.set_speed(20)
    table.set_acceleration(40)
    table.move_to(90)
    print(f"stands at {table.wait_until_at(90):.1f} deg")
