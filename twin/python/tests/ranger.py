"""A driver and its board for tests of laws, and both with planted flaws.

Request and answer are a header, an address, a number, a value in thousandths and a CRC.
"""

from __future__ import annotations

import pickle
import struct
from binascii import crc_hqx
from collections.abc import Sequence
from typing import Any

from twinrig import Input, Output, laws

ADDRESS = 7
REQUEST, ANSWER = 0xA5, 0x5A
LENGTH = 7
TIME_OUT, REACTION = 3_000_000, 150_000
"""Of a request, and from its end to the answer [ns]."""


def frame(header: int, address: int, number: int, value: int) -> bytes:
    """Return a request or an answer."""
    content = struct.pack(">BBBh", header, address, number, value)
    return content + struct.pack("<H", crc_hqx(content, 0xFFFF))


def take(received: bytearray, header: int, checks: bool = True) -> tuple[bytes | None, int]:
    """Remove the next frame; return it, if it is complete, and the number of bytes before it."""
    garbage = 0
    while received:
        found = bytes(received[:LENGTH])
        if found[0] == header and len(found) < LENGTH:
            break
        if found[0] == header and (not checks or found == frame(*struct.unpack(">BBBhxx", found))):
            del received[:LENGTH]
            return found, garbage
        del received[0]
        garbage += 1
    return None, garbage


class Ranger:
    """Driver that requests a distance."""

    name = "ranger"
    ports = [Output("ranger/distance", "m"), Input("ranger/command", "m")]
    checks = True

    def __init__(self) -> None:
        self.values = [0.0]
        self.received = bytearray()
        self.request: bytes | None = None
        self.phase = "idle"
        self.until: int | None = None
        self.attempts = self.number = self.command = 0
        self.accepted = self.missing = self.discarded = 0

    def open(self, now: int) -> None:
        self.start(now, "opening")

    def begin(self, now: int, values: Sequence[float]) -> None:
        self.command = round(values[0] * 1000)
        self.start(now, "transfer")

    def close(self, now: int) -> None:
        self.start(now, "closing")

    def start(self, now: int, phase: str) -> None:
        self.phase, self.attempts = phase, 0
        self.ask(now)

    def ask(self, now: int) -> None:
        self.number = (self.number + 1) % 256
        self.attempts += 1
        self.until = now + TIME_OUT
        self.request = frame(REQUEST, ADDRESS, self.number, self.command)

    def handle_bytes(self, now: int, data: bytes) -> None:
        self.received += data
        found: bytes | None = b""
        while found is not None:
            found, garbage = take(self.received, ANSWER, self.checks)
            self.discarded += garbage
            if found is not None:
                self.handle_frame(found)

    def handle_frame(self, found: bytes) -> None:
        _, address, number, value = struct.unpack(">BBBhxx", found)
        if not self.is_due(address, number):
            self.discarded += 1
            return
        self.accepted += 1
        self.values = [value / 1000]
        self.until, self.phase = None, "idle"

    def is_due(self, address: int, number: int) -> bool:
        return self.until is not None and (address, number) == (ADDRESS, self.number)

    def handle_timeout(self, now: int) -> None:
        if self.until is None or now < self.until:
            return
        self.until = None
        self.missing += 1
        if self.phase == "transfer":
            self.phase = "idle"
        elif self.attempts < 3:
            self.ask(now)
        else:
            self.phase = "failed"

    def poll_timeout(self) -> int | None:
        return self.until

    def poll_transmit(self) -> bytes | None:
        request, self.request = self.request, None
        return request

    def is_busy(self) -> bool:
        if self.phase == "failed":
            raise TimeoutError("the board does not answer: check its cable")
        return self.phase != "idle"

    def traffic(self) -> tuple[int, int, int]:
        return self.accepted, self.missing, self.discarded


class Board:
    """Board that measures a distance and follows a command."""

    name = "board"
    ports = [Input("distance", "m"), Output("command", "m")]

    def __init__(self) -> None:
        self.received = bytearray()
        self.answers: list[tuple[int, bytes]] = []

    def receive(self, first: int, spacing: int, data: bytes, framing_error: bool) -> None:
        self.received += data

    def next_wake(self) -> int | None:
        return None

    def advance(self, now: int, inputs: Any, outputs: Any) -> None:
        while (found := take(self.received, REQUEST)[0]) is not None:
            _, address, number, command = struct.unpack(">BBBhxx", found)
            if address == ADDRESS:
                outputs[0] = command / 1000
                answer = frame(ANSWER, ADDRESS, number, round(inputs[0] * 1000))
                self.answers.append((now + REACTION, answer))

    def poll_transmit(self) -> tuple[int, bytes] | None:
        return self.answers.pop(0) if self.answers else None


class IgnoresChecksum(Ranger):
    checks = False


class AcceptsOtherAddresses(Ranger):
    def is_due(self, address: int, number: int) -> bool:
        return super().is_due(address, number) or address != ADDRESS


class AcceptsOldAnswers(Ranger):
    def is_due(self, address: int, number: int) -> bool:
        return super().is_due(address, self.number)


class CountsTimeOutsAsAnswers(Ranger):
    def traffic(self) -> tuple[int, int, int]:
        return self.accepted + self.missing, 0, self.discarded


class DoesNotCountDamage(Ranger):
    def traffic(self) -> tuple[int, int, int]:
        return self.accepted, self.missing, 0


class LosesBytesBetweenPieces(Ranger):
    def handle_bytes(self, now: int, data: bytes) -> None:
        self.received.clear()
        super().handle_bytes(now, data)


class CountsLooksAsTimeOuts(Ranger):
    def handle_timeout(self, now: int) -> None:
        if self.until is not None and now < self.until:
            self.missing += 1
        super().handle_timeout(now)


class Forgetful:
    """State without the beginning of a frame."""

    def save(self) -> bytes:
        return pickle.dumps({**vars(self), "received": bytearray()})

    def restore(self, state: bytes) -> None:
        vars(self).update(pickle.loads(state))


class DoesNotSavePartialFrame(Forgetful, Ranger):
    pass


class BoardDoesNotSavePartialFrame(Forgetful, Board):
    pass


class NeverResynchronises(Ranger):
    def handle_frame(self, found: bytes) -> None:
        if self.discarded == 0:
            super().handle_frame(found)


class KeepsAllFrames(Ranger):
    def handle_frame(self, found: bytes) -> None:
        vars(self).setdefault("frames", []).append(found)
        super().handle_frame(found)


class KeepsAllAnswers(Board):
    def advance(self, now: int, inputs: Any, outputs: Any) -> None:
        super().advance(now, inputs, outputs)
        vars(self).setdefault("all", []).extend(self.answers)


class NoTimeOut(Ranger):
    def poll_timeout(self) -> int | None:
        return None


class BytesPostponeTimeOut(Ranger):
    def handle_bytes(self, now: int, data: bytes) -> None:
        if self.until is not None and data:
            self.until = now + TIME_OUT
        super().handle_bytes(now, data)


def setup(driver: Any = Ranger, board: Any = Board, **changed: Any) -> laws.Setup:
    """Return the setup of a driver and its board."""
    arguments: dict[str, Any] = {
        "byte_time": "87 us",
        "ports": [Output("distance", "m"), Input("command", "m")],
        "commands": lambda transfer, _: 0.001 * transfer,
        "period": "10 ms",
        "recovery": 1,
        "deadline": 3 * TIME_OUT,
        "numbered_answers": True,
        "foreign_frames": [frame(ANSWER, ADDRESS + 1, 0, 1234)],
        **changed,
    }
    return laws.Setup(driver=driver, devices=[board], **arguments)
