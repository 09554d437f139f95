"""A client for asyncio: the wire protocol is one line out, one line back, so a stream is all that it takes."""

import asyncio
import re
import sys
from decimal import Decimal

from protocol import Angle, Command, Ok, Refusal, Verb, decode_reply, encode_command


async def ask(streams: tuple[asyncio.StreamReader, asyncio.StreamWriter], command: Command) -> Ok | Angle | Refusal:
    """Send a command and return its reply."""
    reader, writer = streams
    writer.write(encode_command(command))
    line = await asyncio.wait_for(reader.readuntil(b"\r"), timeout=2)
    return decode_reply(line.removesuffix(b"\r"))


async def main() -> None:
    """Start an emulator, drive it to 45 degrees, and stop it."""
    program = (sys.executable, "-m", "emulator", "--tcp", "0", "--time-scale", "20", "--baud", "0")
    emulator = await asyncio.create_subprocess_exec(*program, stdout=asyncio.subprocess.PIPE)
    assert emulator.stdout is not None
    try:
        port = re.search(r":(\d+)\s*$", (await emulator.stdout.readline()).decode())
        assert port is not None
        streams = await asyncio.open_connection("127.0.0.1", int(port[1]))
        print(await ask(streams, Command(Verb.MOVE_TO, Decimal(45))))
        reply = await ask(streams, Command(Verb.READ_POSITION))
        while not (isinstance(reply, Angle) and abs(float(reply.angle_deg) - 45.0) <= 0.05):
            await asyncio.sleep(0.05)  # other tasks run here
            reply = await ask(streams, Command(Verb.READ_POSITION))
        print(f"stands at {reply.angle_deg:.1f} deg")
        streams[1].close()
        await streams[1].wait_closed()
    finally:
        emulator.terminate()
        await emulator.wait()


asyncio.run(main())
