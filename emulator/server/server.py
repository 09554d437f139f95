"""The running emulator: one loop that keeps the table at the clock's time and transfers bytes to and from its ports.

The table is advanced only when needed: when a client or a signal arrives, and when a byte on the line is due. It is
also advanced periodically, so that there is never much to catch up with.
"""

import logging
from collections import deque
from collections.abc import Callable, Sequence
from itertools import chain
from typing import TYPE_CHECKING

from emulator.ports.port import Arrival, Port, spoiled
from emulator.ports.readiness import wait_for
from emulator.server.clock import Clock
from emulator.server.signals import SignalWatch

_log = logging.getLogger(__name__)

if TYPE_CHECKING:
    from emulator.avr.compiled_table import AnyTable
    from emulator.server.control_socket import ControlSocket

_LONGEST_SLEEP_S = 0.02
_CATCH_UP_TICKS = 500
_CATCH_UP_S = 0.05
"""Maximum time of catching up before clients are served again."""
_GIVE_UP_S = 0.5
"""Maximum lag of simulated time behind the clock before the clock is held back."""
_LINE_BUFFER_BYTES = 256
"""Maximum number of bytes in the buffer of a slow line, as in a real driver. A client that sends more has to wait."""
_MOST_ARRIVALS = 64
"""Interval of checks of clients whose bytes wait for the end of another client's bytes on the line."""
_LAST_FRACTION = 1.0 - 2.0**-20
"""Maximum share of a tick at which an edge can occur."""
_TRIGGER_SIGNAL = "SIGUSR1"
_END_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
SERVED_SIGNALS = (*_END_SIGNALS, _TRIGGER_SIGNAL)
"""Descriptors for a `SignalWatch` of the server."""


class Server:
    """Serves a table in real time, on any number of ports that share one line.

    Args:
        table: the table. While the server runs, only its control channel accesses it besides.
        clock: counts the due ticks; at 0 when the table was switched on.
        ports: the ports for clients. Replies are sent to all of them.
        signals: entered before the ports' names are published.
        control: the control channel, if any.
        warn: called with one sentence for the user of the emulator.
    """

    def __init__(
        self,
        table: "AnyTable",
        clock: Clock,
        ports: Sequence[Port],
        signals: SignalWatch,
        control: "ControlSocket | None",
        warn: Callable[[str], None],
    ) -> None:
        self.table = table
        self._clock = clock
        self._ports = ports
        self._signals = signals
        self._control = control
        self._warn = warn
        self._running = True
        self._said_slow = False
        self._said_two = False
        self._arrivals: deque[Arrival] = deque()
        self._leaving = False
        self._hung_up = False
        self._incomplete_reply = b""

    def run(self) -> None:
        """Serve until a signal or the control channel ends it."""
        while self._running:
            readable, writable = self._wait()
            self._catch_up()
            self._let_go()
            if self.table.hung_up is not self._hung_up:
                self._follow_hang_up()
            for port in self._ports:
                if not writable.isdisjoint(port.output_descriptors):
                    port.flush()
                if not readable.isdisjoint(port.input_descriptors):
                    self._arrivals.append(port.receive())
                    self._warn_of_two()
            self._serve_arrivals()
            if self._control and not readable.isdisjoint(self._control.input_descriptors):
                self._control.serve(self)
            if self._signals.descriptor in readable:
                self._serve_signals()

    @property
    def time_scale(self) -> float:
        """Simulated seconds per real second."""
        return self._clock.time_scale

    def trigger(self) -> None:
        """Latch the encoder now."""
        fraction = self._clock.now_ticks() - self.table.tick
        if fraction <= 0.0:  # another edge in the tick that the previous edge has completed
            self.table.trigger()
            return
        self.table.trigger(min(fraction, _LAST_FRACTION))
        # The tick of the edge must be complete before a client can read the latch.
        self.table.advance(1)
        self._send_replies()

    def set_time_scale(self, time_scale: float) -> None:
        """Change the time scale from now on."""
        self._clock.set_time_scale(time_scale)
        self._said_slow = False

    def quit(self) -> None:
        """End `run` when the present events are processed."""
        self._running = False

    def _wait(self) -> tuple[set[int], set[int]]:
        """Return the readable and the writable descriptors, once there are any or the table is due."""
        inputs = [self._signals.descriptor]
        if self._control:
            inputs += self._control.input_descriptors
        if not self._line_is_full():
            inputs += chain.from_iterable(port.input_descriptors for port in self._ports)
        outputs = list(chain.from_iterable(port.output_descriptors for port in self._ports))
        return wait_for(inputs, outputs, self._sleep_s())

    def _line_is_full(self) -> bool:
        """Return whether clients must wait, as on any slow line."""
        if self.table.ticks_until_byte() is None:
            return False
        waiting = self.table.received_queue + sum(len(arrival.data) for arrival in self._arrivals)
        return waiting >= _LINE_BUFFER_BYTES or len(self._arrivals) >= _MOST_ARRIVALS

    def _sleep_s(self) -> float:
        ticks = self.table.ticks_until_byte()
        if ticks is None:
            return _LONGEST_SLEEP_S
        return min(_LONGEST_SLEEP_S, self._clock.wall_s_until(self.table.tick + ticks))

    def _catch_up(self) -> None:
        """Advance the table to the clock, or set the clock back to the table if the lag is too large."""
        end_s = self._clock.wall_s() + _CATCH_UP_S
        while (behind := int(self._clock.now_ticks()) - self.table.tick) > 0:
            if behind > _GIVE_UP_S * self._clock.ticks_per_wall_s:
                self._hold_the_clock_back(behind)
                return
            if self._clock.wall_s() > end_s:
                return
            self.table.advance(min(behind, _CATCH_UP_TICKS))
            self._send_replies()

    def _hold_the_clock_back(self, behind: int) -> None:
        """Skip the time in which the process was stopped, or the machine too slow."""
        self._clock.set_ticks(self.table.tick)
        if not self._said_slow:
            self._warn(
                f"simulated time falls behind, by {behind / self._clock.ticks_per_wall_s:.1f} s of the clock, which "
                "are left out: the process was stopped, or this machine is busy, or too slow for time scale "
                f"{self.time_scale:g}"
            )
            self._said_slow = True

    def _follow_hang_up(self) -> None:
        """Remove the ports, or open them again, as a fault of the table requires."""
        self._hung_up = self.table.hung_up
        for port in self._ports:
            if self._hung_up:
                port.hang_up()
            else:
                port.come_back()

    def _serve_arrivals(self) -> None:
        """Pass the clients' bytes to the table.

        Bytes that follow a disconnect wait until the earlier bytes are transmitted.
        """
        while self._arrivals and not self._leaving:
            arrival = self._arrivals.popleft()
            if arrival.left_before:
                self.table.disconnect()
            if arrival.data:
                _log.debug("received %r", arrival.data)
                self.table.receive(spoiled(arrival.data) if arrival.is_doubtful else arrival.data)
                self._send_replies()
            if arrival.left_after:
                self._leaving = True
                self._let_go()

    def _warn_of_two(self) -> None:
        busy = [port.name for port in self._ports if port.client_count]
        if len(busy) > 1 and not self._said_two:
            self._warn(f"{' and '.join(busy)} have clients at the same time: each receives the replies to both")
        self._said_two = len(busy) > 1

    def _let_go(self) -> None:
        """Remove a disconnected client once the table has received all of its bytes.

        So they cannot mix with the next client's.
        """
        if self._leaving and self.table.ticks_until_byte() is None:
            _log.debug("a client has left")
            self.table.disconnect()
            self._leaving = False

    def _send_replies(self) -> None:
        data = self.table.transmit()
        if data and not self._leaving:
            self._log_reply(data)
            for port in self._ports:
                port.send(data)

    def _log_reply(self, data: bytes) -> None:
        """Log whole lines: at a finite baud rate the replies come in pieces."""
        lines, end, self._incomplete_reply = (self._incomplete_reply + data).rpartition(b"\r")
        if end:
            _log.debug("sent %r", lines + end)

    def _serve_signals(self) -> None:
        for number in self._signals.received():
            if number.name == _TRIGGER_SIGNAL:
                self.trigger()
            else:
                self.quit()
