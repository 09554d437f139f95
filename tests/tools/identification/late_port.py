"""A port in virtual time with delayed replies."""

from emulator.protocol_emulator import Serial


class LatePort:
    """The emulator behind a source of delay: `dawdle` lets the delay pass."""

    def __init__(self, port: Serial) -> None:
        self.port = port
        self.clock = port.clock
        self.timeout: float | None = 1.0

    @property
    def in_waiting(self) -> int:
        return self.port.in_waiting

    def read(self, size: int, /) -> bytes:
        self.port.timeout = self.timeout
        data = self.port.read(size)
        if data.endswith(b"\r"):
            self.dawdle()
        return data

    def write(self, data: bytes, /) -> int | None:
        return self.port.write(data)

    def close(self) -> None:
        self.port.close()

    def dawdle(self) -> None:
        raise NotImplementedError
