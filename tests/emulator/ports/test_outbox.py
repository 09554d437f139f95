from emulator.ports.outbox import LIMIT_BYTES, Outbox


def take_all(outbox: Outbox, most: int = 1000) -> bytes:
    taken = bytearray()

    def send(data: bytes) -> int:
        taken.extend(data[:most])
        return min(most, len(data))

    outbox.flush(send)
    return bytes(taken)


def refuse(data: bytes) -> int:
    raise BlockingIOError(data)


def test_what_is_put_in_comes_out_in_order() -> None:
    outbox = Outbox()
    for piece in (b"H", b" 1.", b"0\rOK\rL", b" 2.0\r"):
        outbox.put(piece)
    outbox.flush(refuse)
    assert outbox
    assert take_all(outbox, most=4) == b"H 1.0\rOK\rL 2.0\r"
    assert not outbox


def test_what_does_not_fit_is_dropped_in_whole_lines() -> None:
    outbox = Outbox()
    line = b"H 123.4\r"
    for _ in range(LIMIT_BYTES // len(line) + 10):
        for byte in line:
            outbox.put(bytes((byte,)))
    assert outbox.dropped_bytes == 10 * len(line)
    assert take_all(outbox) == line * (LIMIT_BYTES // len(line))
    outbox.put(line)
    assert take_all(outbox) == line


def test_garbage_without_lines_is_bounded_too() -> None:
    outbox = Outbox()
    for _ in range(10):
        outbox.put(bytes(LIMIT_BYTES // 2))
    assert outbox.dropped_bytes > 0
    assert len(take_all(outbox)) <= 3 * LIMIT_BYTES
