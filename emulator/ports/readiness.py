"""Wait until descriptors can be read or written. Their numbers may be large."""

import select
from collections.abc import Iterable


def wait_for(inputs: Iterable[int], outputs: Iterable[int], timeout_s: float) -> tuple[set[int], set[int]]:
    """Return the readable and the writable descriptors, once there are any or the time is over."""
    inputs, outputs = list(inputs), list(outputs)
    try:
        # Unlike poll, which counts in milliseconds, select returns in time for the next byte.
        readable, writable, _ = select.select(inputs, outputs, [], timeout_s)
    except ValueError:  # A number that is too large for select: this process inherited many open files.
        return _poll(inputs, outputs, timeout_s)
    return set(readable), set(writable)


def _poll(inputs: list[int], outputs: list[int], timeout_s: float) -> tuple[set[int], set[int]]:
    poll = select.poll()
    for descriptor in {*inputs, *outputs}:
        wanted = (select.POLLIN if descriptor in inputs else 0) | (select.POLLOUT if descriptor in outputs else 0)
        poll.register(descriptor, wanted)
    ended = select.POLLHUP | select.POLLERR  # as select reports readable and writable
    events = poll.poll(1000.0 * timeout_s)
    readable = {descriptor for descriptor, event in events if event & (select.POLLIN | ended)}
    writable = {descriptor for descriptor, event in events if event & (select.POLLOUT | ended)}
    return readable.intersection(inputs), writable.intersection(outputs)
