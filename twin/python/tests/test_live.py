"""``twin live`` with a client of others: the package ``websockets``, in Foxglove's protocol."""

from __future__ import annotations

import asyncio
import json
import math
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import time
import urllib.request
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import pytest
import twinrig
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

ROOT = Path(__file__).resolve().parents[3]
TROT = ROOT / "scenarios/trot.toml"
PROTOCOL = Subprotocol("foxglove.sdk.v1")


class Twin:
    """A program ``twin live``."""

    def __init__(self, out: Path, *arguments: str) -> None:
        words = [sys.executable, "-m", "twinrig", "live", *arguments, "--out", str(out)]
        words += ["--socket", "0", "--page", "0", "--json"]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        places = json.loads(self.process.stdout.readline())
        self.socket: str = places["socket"]
        self.page: str = places["page"]

    def resident(self) -> float:
        """Resident memory [MB]."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        line = next(line for line in status.splitlines() if line.startswith("VmRSS"))
        return int(line.split()[1]) / 1e3

    def end(self) -> str:
        """End it as Ctrl-C does, and return what it prints."""
        self.process.send_signal(signal.SIGINT)
        out, _ = self.process.communicate(timeout=20)
        assert self.process.returncode == 0
        return out


@contextmanager
def twin(out: Path, *arguments: str) -> Iterator[Twin]:
    live = Twin(out, *arguments)
    try:
        yield live
    finally:
        live.process.kill()
        live.process.communicate()


class Visitor:
    """A client: subscriptions by topic, services and parameters by name."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, int] = {}
        self.topics: dict[int, str] = {}
        self.latest: dict[str, bytes] = {}
        self.answers: dict[object, asyncio.Future[Any]] = {}
        self.info: dict[str, Any] = {}

    async def listen(self) -> None:
        async for message in self.connection:
            if isinstance(message, str):
                self.read(json.loads(message))
            elif message[0] == 1:
                (number,) = struct.unpack_from("<I", message, 1)
                self.latest[self.topics[number]] = message[13:]
            elif message[0] == 3:
                _, call, length = struct.unpack_from("<III", message, 1)
                self.answers.pop(call).set_result(json.loads(message[13 + length :]))

    def read(self, message: dict[str, Any]) -> None:
        match message["op"]:
            case "serverInfo":
                self.info = message
            case "advertise":
                self.channels |= {it["topic"]: it for it in message["channels"]}
            case "advertiseServices":
                self.services |= {it["name"]: it["id"] for it in message["services"]}
            case "serviceCallFailure":
                failure = RuntimeError(message["message"])
                self.answers.pop(message["callId"]).set_exception(failure)
            case "parameterValues" if message.get("id") in self.answers:
                self.answers.pop(message["id"]).set_result(message["parameters"])

    async def answer(self, key: object) -> Any:
        self.answers[key] = asyncio.get_running_loop().create_future()
        return await asyncio.wait_for(self.answers[key], 20)

    async def call(self, service: str, **body: object) -> Any:
        number = len(self.answers) + random.getrandbits(24)
        payload = struct.pack("<BIII", 2, self.services[service], number, 4) + b"json"
        await self.connection.send(payload + json.dumps(body).encode())
        return await self.answer(number)

    async def set_parameter(self, name: str, value: float) -> Any:
        parameter = {"name": name, "value": value, "type": "float64"}
        request = {"op": "setParameters", "parameters": [parameter], "id": "set"}
        await self.connection.send(json.dumps(request))
        return await self.answer("set")

    async def parameters(self) -> dict[str, object]:
        request = {"op": "getParameters", "parameterNames": [], "id": "get"}
        await self.connection.send(json.dumps(request))
        return {it["name"]: it["value"] for it in await self.answer("get")}

    async def subscribe(self, *topics: str) -> None:
        for topic in topics:
            number = len(self.topics) + 1
            self.topics[number] = topic
            wanted = {"id": number, "channelId": self.channels[topic]["id"]}
            request = {"op": "subscribe", "subscriptions": [wanted]}
            await self.connection.send(json.dumps(request))

    async def state(self, holds: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the first state for which a condition holds."""
        for _ in range(2000):
            state = json.loads(self.latest.get("/live/state", b"null"))
            if state and holds(state):
                assert isinstance(state, dict)
                return state
            await asyncio.sleep(0.02)
        raise AssertionError("no such state in 40 s")


@asynccontextmanager
async def visitor(live: Twin) -> AsyncIterator[Visitor]:
    async with connect(live.socket, subprotocols=[PROTOCOL]) as connection:
        one = Visitor(connection)
        listening = asyncio.create_task(one.listen())
        while not (one.channels and one.services and one.info):
            await asyncio.sleep(0.01)
        await one.subscribe("/live/state")
        yield one
        listening.cancel()


def run(test: Awaitable[None]) -> None:
    async def limited() -> None:
        await asyncio.wait_for(test, 100)

    asyncio.run(limited())


def test_branch_and_original(folder: Path) -> None:
    """Someone changes a parameter, pauses, goes back 2 s and branches: the branch is the run of its
    file, and the original goes on as without visitors."""

    async def visit(live: Twin) -> None:
        async with visitor(live) as one:
            assert {"time", "playbackControl", "parameters"} <= set(one.info["capabilities"])
            await one.subscribe("/plant", "/tf", "/live/frame")
            await one.state(lambda it: it["now_s"] > 2.5)
            assert await one.call("pause") == {"ok": True}
            paused = await one.state(lambda it: it["status"] == "paused")
            assert {"/plant", "/tf", "/live/frame"} <= set(one.latest)
            about = (await one.parameters())["frequency.about"]
            assert about == "[0, ∞[ Hz, default 3 Hz"
            back = paused["now_s"] - 2
            await one.call("seek", at_s=back)
            (set_to,) = await one.set_parameter("frequency", 3.2)
            assert set_to["value"] == 3.2
            with pytest.raises(RuntimeError, match=r"frequency = -1 is not in \[0, ∞\["):
                await one.call("set", variable="frequency", value=-1)
            await one.call("speed", factor=0)
            await one.call("play")
            ended = await one.state(lambda it: it["status"] == "ended")
            original, branch = ended["branches"]
            assert (branch["parent"], branch["acts"]) == (0, 1)
            assert abs(branch["begin_s"] - back) < 1e-9
            file = Path(branch["file"])
            assert twinrig.run(file).fingerprint == branch["fingerprint"]
            compared = await one.call("compare", one=0, other=1)
            assert compared["futures"]["window_s"] == [branch["begin_s"], original["reached_s"]]

            await one.call("branch", number=0, at_s=None)
            await one.call("play")
            ended = await one.state(lambda it: it["branch"] == 0 and it["status"] == "ended")
            expected = twinrig.run(TROT, set={"until": "4 s"}).fingerprint
            assert ended["branches"][0]["fingerprint"] == expected

    with twin(folder, str(TROT), "--set", "until=4 s") as live:
        page = urllib.request.urlopen(live.page).read().decode()
        assert "live-data" in page
        run(visit(live))
        assert str(folder / "trot-1.toml") in live.end()


def test_robot_at_its_ports_is_tuned(folder: Path) -> None:
    """The program drives a served Oncilla over PTYs: a jump of a parameter is a ramp, which the
    scenario of the changes has; time travel is refused."""
    oncilla = ROOT / "scenarios/oncilla-trot.toml"
    links = {bus: folder / bus for bus in ("sbcp", "rb110")}
    places = [word for bus, link in links.items() for word in ("--pty", f"{bus}={link}")]
    words = [sys.executable, "-m", "twinrig", "serve", str(oncilla), *places]
    served = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    async def visit(live: Twin) -> None:
        async with visitor(live) as one:
            assert "playbackControl" not in one.info["capabilities"]
            await one.subscribe("/process_outputs", "/gauges")
            begun = await one.state(lambda it: it["now_s"] > 0)
            assert (begun["reach"], begun["branches"]) == (None, [])
            for service, body in (("pause", {}), ("seek", {"at_s": 0.0})):
                with pytest.raises(RuntimeError, match="on hardware"):
                    await one.call(service, **body)
            await one.call("save", name="begin")
            await one.call("slew", rate=0.5)
            assert (await one.set_parameter("frequency", 1.8))[0]["value"] == 1.8
            with pytest.raises(RuntimeError, match="frequency = -1 is not in"):
                await one.call("set", variable="frequency", value=-1)
            tuned = await one.state(lambda it: values(it)["frequency"] == 1.8)
            assert tuned["sets"] == ["begin"]
            assert {"/process_outputs", "/gauges"} <= set(one.latest)

    def values(state: dict[str, Any]) -> dict[str, float]:
        return {it["name"]: it["value"] for it in state["variables"]}

    try:
        while not all(link.exists() for link in links.values()):
            assert served.poll() is None
            time.sleep(0.05)
        ports = [word for bus, link in links.items() for word in ("--port", f"{bus}={link}")]
        # A machine under load answers late now and then.
        settings = ["--set", "until=4 s", "--set", "bus.sbcp.error_threshold=-1"]
        with twin(folder, str(oncilla), *ports, *settings) as live:
            page = urllib.request.urlopen(live.page).read().decode()
            assert '"hardware":true' in page
            run(visit(live))
            out, _ = live.process.communicate(timeout=60)
    finally:
        served.kill()
        served.wait()
    report = json.loads(out)
    assert report["recording"] == str(folder / "oncilla-trot-0.mcap")
    assert twinrig.read(report["recording"]).notes["at_hardware"] == "true"
    changed = (folder / "oncilla-trot-0.toml").read_text()
    ramp = [float(it) for it in re.findall(r'set = "frequency"\nto = "([0-9.]+) Hz"', changed)]
    assert changed.count("[[change]]") == len(ramp)
    # Half of the default frequency of 3 Hz in a second, in periods of 2 ms; rounding of a sum.
    step = 3 * 0.5 * 2e-3
    steps = [before - after for before, after in zip([2.039, *ramp], ramp, strict=False)]
    assert (ramp[-1], len(ramp)) == (1.8, math.ceil((2.039 - 1.8) / step))
    assert all(0 < it <= step * (1 + 1e-9) for it in steps)


def test_visitors_neither_stop_nor_grow_it(folder: Path) -> None:
    """Many connections, one that never reads, and garbage at 10 MB/s: memory stays within 5 MB."""

    async def visit(live: Twin) -> None:
        await asyncio.sleep(2)
        start = live.resident()
        for _ in range(100):
            async with connect(live.socket, subprotocols=[PROTOCOL]) as connection:
                await connection.recv()
        async with visitor(live) as deaf:
            await deaf.subscribe(*(topic for topic in deaf.channels if topic != "/live/state"))
            deaf.connection.transport.pause_reading()
            await asyncio.sleep(3)
            assert live.resident() - start < 5
            deaf.connection.transport.abort()
        junk = random.Random(1).randbytes(1 << 20)
        for send in (flood_of_bytes, flood_of_frames):
            await send(live, junk)
            assert live.resident() - start < 5
        async with visitor(live) as one:
            first = await one.state(lambda _: True)
            await one.state(lambda it: it["now_s"] > first["now_s"])

    with twin(folder, str(TROT), "--set", "duration=100 s", "--memory", "1") as live:
        run(visit(live))
        live.end()


RATE = 10e6
FLOOD_S = 3.0


async def flood_of_bytes(live: Twin, junk: bytes) -> None:
    """Bytes that are no handshake."""
    host, port = live.socket.removeprefix("ws://").split(":")
    begin, sent = time.monotonic(), 0
    while (passed := time.monotonic() - begin) < FLOOD_S:
        try:
            with socket.create_connection((host, int(port)), timeout=1) as stream:
                stream.sendall(junk[: 1 << 18])
        except OSError:
            pass
        sent += 1 << 18
        await asyncio.sleep(max(0.0, sent / RATE - passed))


async def flood_of_frames(live: Twin, junk: bytes) -> None:
    """Messages that mean nothing, in a valid connection as long as it is one."""
    begin, sent, sizes = time.monotonic(), 0, random.Random(2)
    while time.monotonic() - begin < FLOOD_S:
        try:
            async with connect(live.socket, subprotocols=[PROTOCOL]) as connection:
                while (passed := time.monotonic() - begin) < FLOOD_S:
                    size = sizes.choice([10, 1000, 100_000, 1 << 20])
                    await connection.send(junk[:size])
                    await connection.send(junk[:50].hex())
                    sent += size
                    await asyncio.sleep(max(0.0, sent / RATE - passed))
        except (ConnectionClosed, OSError):
            pass
