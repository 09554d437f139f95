"""A fault on purpose: the table stops answering for two seconds. What does the program do?"""

import serial

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from emulator.faults import fault_from
from protocol import ReplyTimeout, TableClient

port = serial.serial_for_url("emulator://", timeout=0.5)
with TableClient(port, timeout_s=0.5) as table:
    table.move_to(10)
    table.wait_until_at(10)
    port.table.inject(fault_from("silence", {"for_s": 2.0}))
    try:
        table.position_deg()
    except ReplyTimeout as error:
        print(f"no reply: {error}")
    table.clock.sleep_s(2.0)  # simulated time
    print(f"answers again: {table.position_deg():.1f} deg")
