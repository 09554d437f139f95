"""The emulator of the rotary table: firmware and plant behind a virtual serial port.

Importing it registers the port `emulator://` with pyserial: a private table in virtual time.
"""

import protocol.program.quiet_start  # noqa: F401 - before the slow imports

# isort: split
import serial

from emulator.config.table_config import ConfigError, TableConfig, load_config
from emulator.table.table import Table
from protocol.bench import TableStatus

__all__ = ["ConfigError", "Table", "TableConfig", "TableStatus", "load_config"]

if __name__ not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append(__name__)
