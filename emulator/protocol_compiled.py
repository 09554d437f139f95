"""The pyserial port `compiled://`: as `emulator://`, with the compiled firmware in simavr.

pyserial finds this module by its name once `emulator` is imported.
"""

from collections.abc import Mapping
from pathlib import Path

from serial.serialutil import SerialException

from emulator.avr.compiled_table import AnyTable, CompiledTable
from emulator.avr.errors import ChipError, ToolchainError
from emulator.config.table_config import TableConfig
from emulator.protocol_emulator import Serial as EmulatorSerial
from emulator.protocol_emulator import table_of

_OPTIONS = ("config", "firmware", "seed", "baud", "decimals", "strict", "trigger_hz")


class Serial(EmulatorSerial):
    """A pyserial port whose other end is a simulated controller at a simulated plant."""

    @staticmethod
    def _switched_on(url: str) -> AnyTable:
        """Return the table that a URL describes."""
        try:
            return table_of(url, "compiled", _OPTIONS, _switch_on)
        except (ToolchainError, ChipError) as error:
            raise SerialException(f"{url}: {error}") from error


def _switch_on(config: TableConfig, seed: int, options: Mapping[str, str]) -> CompiledTable:
    firmware = options.get("firmware")
    return CompiledTable(config, seed, None if firmware is None else Path(firmware))
