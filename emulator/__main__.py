"""The command line of the emulator: `python -m emulator --pty`."""

import argparse
import math
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from emulator.avr.errors import ChipError, ToolchainError
from emulator.config.table_config import ConfigError, TableConfig, load_config
from emulator.ports.port import Port
from emulator.ports.tcp_port import TcpPort, parse_address
from emulator.server.clock import TIME_SCALE, Clock
from emulator.server.server import SERVED_SIGNALS, Server
from emulator.server.signals import SignalWatch
from emulator.table.table import Table
from emulator.trace import TraceError, TraceWriter
from protocol.files.data_file import shown
from protocol.program.command_line import Parser, program_name, report, report_error

_EXAMPLE = """example:
  {table} --pty --link ./table &
  picocom -b 9600 --echo --imap crcrlf ./table     (or: python -m serial.tools.miniterm --eol CR ./table 9600)

The first line on stdout is the port that a client opens: the device, or a URL for pyserial. SIGUSR1 is the probe's
trigger; Ctrl-C or SIGTERM end the emulator with status 0.
"""

_MOST_DIGITS = 30

if TYPE_CHECKING:
    from emulator.avr.compiled_table import AnyTable
    from emulator.server.control_socket import ControlSocket


class UsageError(Exception):
    """The command line or its environment does not allow a start. The message states the next step."""


def main(arguments: list[str] | None = None) -> int:
    """Run the emulator until a signal or a command ends it, and return the exit status."""
    try:
        options = _parse(arguments)
        config = load_config(options.config).with_serial(
            baud=options.baud, decimals=options.decimals, strict=options.strict_table1 or None
        )
        with ExitStack() as stack:
            _serve(options, config, stack)
    except (UsageError, ConfigError) as error:
        return _refuse(str(error))
    except TraceError as error:
        return _refuse(f"--trace {error}")
    except ChipError as error:
        return _refuse(f"--firmware: {error}")
    except OSError as error:
        return _refuse(f"cannot continue: {error}; check that stdout is read")
    return 0


def _parse(arguments: list[str] | None) -> argparse.Namespace:
    options = parser().parse_args(arguments)
    if not (options.pty or options.tcp or options.rfc2217):
        raise UsageError("give --pty, --tcp, --rfc2217 or several of them (--help shows all options)")
    if options.link and not options.pty:
        raise UsageError("--link names a pty: give --pty with it")
    return options


def parser() -> Parser:
    """Return the parser of the command line."""
    parser = Parser(
        prog=program_name("emulator"),
        description="A rotary table's emulator behind a virtual serial port.",
        epilog=_EXAMPLE.format(table=program_name("emulator")),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--pty", action="store_true", help="open a pseudo-terminal and print its device")
    add("--link", metavar="PATH", type=Path, help="a symbolic link to the pseudo-terminal, removed at the end")
    add("--tcp", metavar="[HOST:]PORT", type=_address, help="listen on TCP and print the URL; 0 picks a free port")
    add("--rfc2217", metavar="[HOST:]PORT", type=_address, help="listen by RFC 2217, which transmits the baud rate")
    add("--baud", metavar="N", type=int, help="baud rate of the table (default: 9600); 0: bytes take no time")
    add("--time-scale", metavar="X", type=_time_scale, default=1.0, help="simulated time over real time (default: 1)")
    add("--decimals", metavar="N", type=int, help="decimal places of angles in replies (default: 1)")
    add("--strict-table1", action="store_true", help="no error replies: the protocol as in Table 1 of the paper")
    add("--config", metavar="FILE", type=Path, help="TOML file with overrides of the default constants")
    add(
        "--firmware",
        metavar="avr|ELF",
        help="compiled firmware in simavr: avr builds it, or an .elf file (default: the emulator's own)",
    )
    add("--trigger-hz", metavar="F", type=_rate, default=0.0, help="rate of the probe's trigger (default: 0, none)")
    add(
        "--control",
        metavar="PATH",
        type=Path,
        help=f"path of the Unix socket for {program_name('emulator.control_client')}",
    )
    add("--trace", metavar="FILE", type=Path, help="record every tick in a .csv or .npz file")
    add("--seed", metavar="N", type=_seed, default=0, help="random seed (default: 0)")
    return parser


def _address(text: str) -> tuple[str, int]:
    try:
        return parse_address(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _time_scale(text: str) -> float:
    value = _rate(text)
    if not TIME_SCALE.accepts(value):
        raise argparse.ArgumentTypeError(f"it must be {TIME_SCALE.allowed}")
    return value


def _rate(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{shown(text)} is not a number from 0 up")
    return value


def _seed(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS):
        raise argparse.ArgumentTypeError(
            f"{shown(text)} is not a whole number from 0 up, of at most {_MOST_DIGITS} digits"
        )
    return int(text)


def _serve(options: argparse.Namespace, config: TableConfig, stack: ExitStack) -> None:
    """Open the requested ports, publish them, and serve. `stack` closes them in reverse order."""
    signals = stack.enter_context(SignalWatch(*SERVED_SIGNALS))
    table = _table(options, config)
    with _usage("--trigger-hz"):
        table.trigger_hz = options.trigger_hz
    ports = _open_ports(options, config, stack)
    control = _open_control(options.control, stack) if options.control else None
    if options.trace:
        _start_trace(options.trace, table, config, stack)
    clock = Clock(config.control.tick_hz, options.time_scale)
    server = Server(table, clock, ports, signals, control, _say)
    rate = f"{config.serial.baud} baud, 8N1" if config.serial.baud else "any baud rate, 8N1"
    for port in ports:
        print(port.name, flush=True)
    _say(f"the table is ready ({rate}); Ctrl-C ends it")
    server.run()


def _table(options: argparse.Namespace, config: TableConfig) -> "AnyTable":
    if options.firmware is None:
        with _usage("--config"):
            return Table(config, seed=options.seed)
    # Here, since only this table needs compilers and simavr.
    from emulator.avr.compiled_table import CompiledTable  # noqa: PLC0415  # see above

    try:
        with _usage("--firmware"):
            return CompiledTable(config, options.seed, None if options.firmware == "avr" else Path(options.firmware))
    except ToolchainError as error:
        raise UsageError(f"--firmware {options.firmware}: {error}") from error


def _open_ports(options: argparse.Namespace, config: TableConfig, stack: ExitStack) -> list[Port]:
    ports: list[Port] = []
    if options.pty:
        ports.append(_open_pty(options.link, config.serial.baud, stack))
    if options.tcp:
        host, number = options.tcp
        with _usage(f"--tcp {host}:{number}"):
            port = TcpPort(host, number, _say)
        stack.callback(port.close)
        ports.append(port)
    if options.rfc2217:
        from emulator.ports.rfc2217_port import Rfc2217Port  # noqa: PLC0415  # rarely needed, and the start should be fast

        host, number = options.rfc2217
        with _usage(f"--rfc2217 {host}:{number}"):
            port = Rfc2217Port(host, number, config.serial.baud, _say)
        stack.callback(port.close)
        ports.append(port)
    return ports


def _open_pty(link_path: Path | None, baud: int, stack: ExitStack) -> Port:
    try:
        # Imported here, because a system without ptys lacks what these modules import.
        from emulator.ports.device_link import DeviceLink  # noqa: PLC0415  # see above
        from emulator.ports.pty_port import PtyPort  # noqa: PLC0415  # see above
    except ImportError:
        raise UsageError("--pty: this system has no pseudo-terminals; use --tcp 0 and the URL that it prints") from None
    with _usage("--pty"):
        port = PtyPort(baud, _say)
    stack.callback(port.close)
    if link_path:
        with _usage(f"--link {link_path}"):
            port.link = link = DeviceLink(link_path, port.name)
        stack.callback(link.remove)
        if link.replaced:
            _say(f"{link_path} pointed to {link.replaced} and now points to {port.name}")
    return port


def _open_control(path: Path, stack: ExitStack) -> "ControlSocket":
    from emulator.server.control_socket import ControlSocket  # noqa: PLC0415  # rarely needed, and the start should be fast

    if not hasattr(socket, "AF_UNIX"):
        raise UsageError("--control: this system has no Unix sockets; start the table without it")
    with _usage(f"--control {path}"):
        control = ControlSocket(path)
    stack.callback(control.close)
    return control


def _start_trace(path: Path, table: "AnyTable", config: TableConfig, stack: ExitStack) -> None:
    table.observer = stack.enter_context(TraceWriter(path, config.control.tick_hz)).record


@contextmanager
def _usage(option: str) -> Iterator[None]:
    """Convert an error of the system or of a module into a usage error that names the option."""
    try:
        yield
    except OSError as error:
        raise UsageError(f"{option}: {error.strerror or error}; choose another or free this one") from error
    except ValueError as error:
        raise UsageError(f"{option}: {error}") from error


def _say(sentence: str) -> None:
    report(program_name("emulator"), sentence)


def _refuse(problem: str) -> int:
    report_error(program_name("emulator"), problem)
    return 2


if __name__ == "__main__":
    sys.exit(main())
