import subprocess
import sys

import protocol


def test_the_public_names_are_these() -> None:
    assert protocol.__all__ == [
        "VERBS",
        "Angle",
        "ArrivalTimeout",
        "Clock",
        "Command",
        "CommandRefused",
        "ErrorCode",
        "LineBuffer",
        "NotStopped",
        "Ok",
        "Port",
        "PortError",
        "ProtocolMisuse",
        "Refusal",
        "Reply",
        "ReplyTimeout",
        "TableClient",
        "TableError",
        "UnexpectedReply",
        "Verb",
        "WallClock",
        "decode_command",
        "decode_reply",
        "encode_command",
        "encode_reply",
    ]
    assert all(hasattr(protocol, name) for name in protocol.__all__)


def test_importing_the_package_does_not_import_pyserial() -> None:
    program = "import protocol, sys; sys.exit('serial' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
