"""Pings the boards of an SBCP bus and reads registers of them, by the page ../sbcp.md alone.

    twin serve scenarios/first-contact.toml --keep --pty sbcp=boards    # in one terminal
    python3 docs/examples/sbcp_ping.py boards                           # in another

Any machine with Python 3; a serial port needs its baud rate set before (stty).
"""

import os
import select
import sys
import time
import tty

HEADER, MOTORDRIVER = 0xFF, 0x01
PING, GET = 0x01, 0x02
DEVICE_VERSION, LIMITS = 0x01, (0x1C, 0x2C)
ATTEMPTS, TIMEOUT_S = 10, 0.3


def transfer(port, board, instruction, payload=b""):
    """Returns error and payload of the answer."""
    body = bytes([MOTORDRIVER, board, len(payload) + 2, instruction]) + payload
    for _ in range(ATTEMPTS):
        os.write(port, bytes([HEADER]) + body + bytes([sum(body) % 256]))
        answer, end = b"", time.monotonic() + TIMEOUT_S
        while (left := end - time.monotonic()) > 0:
            if select.select([port], [], [], left)[0]:
                answer += os.read(port, 256)
            # The last packet counts: an earlier one is a late answer to an earlier attempt.
            for at in range(len(answer) - 5):
                header, cls, source, length, error = answer[at : at + 5]
                packet = answer[at : at + length + 4]
                complete = len(packet) == length + 4 and length >= 2
                if complete and (header, cls, source) == (HEADER, MOTORDRIVER, board):
                    if sum(packet[1:-1]) % 256 == packet[-1]:
                        return error, packet[5:-1]
    sys.exit(f"id {board} does not answer")


def word(port, board, register):
    error, value = transfer(port, board, GET, bytes([register]))
    assert error == 0 and len(value) == 2, (error, value)
    return int.from_bytes(value, "little")


port = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
tty.setraw(port)
for board, leg in enumerate(("LF", "RF", "LH", "RH"), start=1):
    error, _ = transfer(port, board, PING)
    version = word(port, board, DEVICE_VERSION)
    limits = [word(port, board, register) for register in LIMITS]
    state = "answers" if error == 0 else f"error {error:#04x}"
    print(f"{leg}  id {board}  {state}  device {version >> 8}.{version & 255:02}", end="  ")
    print("position limits", *limits)
error, _ = transfer(port, 5, PING)
print(f"id 5: error {error:#04x}, as no board has this id")
