"""Programs of others on the bus of emulated servos 1, 2 and 3 of a leg: libraries, unmodified.

    servos.py CLIENT PORT

prints as JSON what the client has found and read. Each request is repeated until it is answered, as
on any bus: this machine may be late.
"""

import json
import sys
import time

IDS = [1, 2, 3]
ABSENT = 9
BAUD = 1_000_000
GOALS = [2148, 1998, 2048]
GOALS_OF_AX = [612, 462, 512]
GOALS_OF_SCS = [611, 461, 511]
# Friction and weight of the leg; a third of that of AX-12A and SCS0009, whose counts are larger.
WITHIN = 60
ATTEMPTS = 50


def repeated(request, port=None):
    """Calls `request` until it returns a result. What arrives late is not the answer to the next
    one: the libraries would take it for that, and fail by an index where it is too short."""
    for _ in range(ATTEMPTS):
        try:
            result = request()
        except IndexError:
            result = None
        if result is not None:
            return result
        time.sleep(0.1)
        if port:
            port.ser.reset_input_buffer()
    raise RuntimeError("no answer")


def settled(positions, within=WITHIN, goals=GOALS):
    """Reads positions until they are near the goals, or are not after 10 s."""
    for _ in range(200):
        found = positions()
        if all(abs(it - goal) <= within for it, goal in zip(found, goals)):
            break
        time.sleep(0.05)
    return found


class Sdk:
    """`dynamixel_sdk`, protocol 2.0, or `scservo_sdk`, whose interface is that of 1.0."""

    def __init__(self, sdk, version, path):
        self.sdk = sdk
        self.port = sdk.PortHandler(path)
        assert self.port.openPort() and self.port.setBaudRate(BAUD)
        self.packets = sdk.PacketHandler(version)

    def ok(self, answer):
        *values, result, error = answer
        return (values[0] if values else 0, error) if result == self.sdk.COMM_SUCCESS else None

    def repeated(self, request):
        return repeated(request, self.port)

    def ping(self, number):
        return self.repeated(lambda: self.ok(self.packets.ping(self.port, number)))[0]

    def absent(self):
        _, result, _ = self.packets.ping(self.port, ABSENT)
        return self.packets.getTxRxResult(result)

    def read(self, number, address, length):
        answer = self.repeated(
            lambda: self.ok(self.packets.readTxRx(self.port, number, address, length))
        )
        return list(answer[0])

    def write(self, number, address, data):
        write = lambda: self.packets.writeTxRx(self.port, number, address, len(data), data)
        return self.repeated(lambda: self.ok(write()))[1]

    def sync_write(self, address, words, size):
        group = self.sdk.GroupSyncWrite(self.port, self.packets, address, size)
        for number, word in zip(IDS, words):
            assert group.addParam(number, list(word.to_bytes(size, "little")))
        assert group.txPacket() == self.sdk.COMM_SUCCESS

    def sync_read(self, address, size, fast=False):
        group = self.sdk.GroupSyncRead(self.port, self.packets, address, size)
        for number in IDS:
            assert group.addParam(number)
        read = group.fastSyncRead if fast else group.txRxPacket
        self.repeated(lambda: True if read() == self.sdk.COMM_SUCCESS else None)
        return [group.getData(number, address, size) for number in IDS]


def dynamixel_sdk(path):
    import dynamixel_sdk as sdk

    bus = Sdk(sdk, 2.0, path)
    found = {number: bus.ping(number) for number in IDS}
    absent = bus.absent()
    all_found = bus.repeated(
        lambda: (lambda it: it[0] if it[1] == sdk.COMM_SUCCESS and len(it[0]) == 3 else None)(
            bus.packets.broadcastPing(bus.port)
        )
    )
    table = bus.read(1, 0, 64)
    refused = [bus.write(1, 64, [2]), bus.write(1, 132, [0, 0, 0, 0])]
    for number in IDS:
        bus.write(number, 9, [0])
        assert bus.write(number, 64, [1]) == 0
    bus.sync_write(116, GOALS, 4)
    positions = settled(lambda: bus.sync_read(132, 4))
    bulk = sdk.GroupBulkRead(bus.port, bus.packets)
    for number in IDS:
        assert bulk.addParam(number, 132, 4)

    def bulk_read():
        bus.repeated(lambda: True if bulk.txRxPacket() == sdk.COMM_SUCCESS else None)
        return [bulk.getData(number, 132, 4) for number in IDS]

    registers = lambda: bus.packets.regWriteTxRx(bus.port, 1, 65, 1, [1])
    bus.repeated(lambda: bus.ok(registers()))
    waiting = bus.read(1, 65, 5)
    bus.repeated(lambda: True if bus.packets.action(bus.port, 1) == sdk.COMM_SUCCESS else None)
    time.sleep(0.1)
    return {
        "found": found,
        "absent": absent,
        "all": {number: model for number, (model, _) in all_found.items()},
        "table": table,
        "refused": refused,
        "positions": positions,
        "fast": settled(lambda: bus.sync_read(132, 4, fast=True)),
        "bulk": settled(bulk_read),
        "registered": [waiting[0], waiting[4]],
        "executed": bus.read(1, 65, 1)[0],
    }


def dynamixel_sdk_ax(path):
    import dynamixel_sdk as sdk

    bus = Sdk(sdk, 1.0, path)
    position = lambda number: int.from_bytes(bytes(bus.read(number, 36, 2)), "little")
    found = {number: bus.ping(number) for number in IDS}
    absent = bus.absent()
    table = bus.read(1, 0, 36)
    refused = [bus.write(1, 24, [2]), bus.write(1, 30, [0, 4])]
    for number in IDS:
        assert bus.write(number, 24, [1]) == 0
    bus.sync_write(30, GOALS_OF_AX, 2)
    single = lambda: [position(number) for number in IDS]
    return {
        "found": found,
        "absent": absent,
        "table": table,
        "refused": refused,
        "single": settled(single, WITHIN // 3, GOALS_OF_AX),
    }


def rustypot(kind, path):
    import rustypot

    bus = getattr(rustypot, kind)(path, BAUD, 1.0)
    positions = lambda: list(bus.sync_read_raw_present_position(IDS))
    for number in IDS:
        bus.write_raw_torque_enable(number, 1)
    bus.sync_write_raw_goal_position(IDS, GOALS)
    result = {
        "found": bus.scan([*IDS, ABSENT]),
        "positions": settled(positions),
        "single": settled(lambda: [bus.read_raw_present_position(number)[0] for number in IDS]),
    }
    if bus.supports_broadcast_ping():
        result["all"] = bus.broadcast_scan()
    if hasattr(bus, "set_fast_sync_read"):
        bus.set_fast_sync_read(True)
        result["fast"] = settled(positions)
    bus.close()
    return result


def scservo_sdk(path):
    import scservo_sdk as sdk

    bus = Sdk(sdk, 0, path)
    found = {number: bus.ping(number) for number in IDS}
    absent = bus.absent()
    for number in IDS:
        assert bus.write(number, 40, [1]) == 0
    bus.sync_write(42, GOALS, 2)
    position = lambda number: int.from_bytes(bytes(bus.read(number, 56, 2)), "little")
    return {
        "found": found,
        "absent": absent,
        "table": bus.read(1, 0, 40),
        "positions": settled(lambda: bus.sync_read(56, 2)),
        "single": settled(lambda: [position(number) for number in IDS]),
    }


def scservo_sdk_scs(path):
    import scservo_sdk as sdk

    bus = Sdk(sdk, 1, path)
    word = lambda number, address: bus.repeated(
        lambda: bus.ok(bus.packets.read2ByteTxRx(bus.port, number, address))
    )[0]
    found = {number: bus.ping(number) for number in IDS}
    for number, goal in zip(IDS, GOALS_OF_SCS):
        assert bus.write(number, 40, [1]) == 0
        write = lambda: bus.packets.write2ByteTxRx(bus.port, number, 42, goal)
        assert bus.repeated(lambda: bus.ok(write()))[1] == 0
    single = lambda: [word(number, 56) for number in IDS]
    return {
        "found": found,
        "table": bus.read(1, 0, 40),
        "single": settled(single, WITHIN // 3, GOALS_OF_SCS),
    }


CLIENTS = {
    "dynamixel_sdk": dynamixel_sdk,
    "dynamixel_sdk_ax": dynamixel_sdk_ax,
    "scservo_sdk": scservo_sdk,
    "scservo_sdk_scs": scservo_sdk_scs,
    "rustypot_xl330": lambda path: rustypot("Xl330PyController", path),
    "rustypot_sts3215": lambda path: rustypot("Sts3215PyController", path),
}

json.dump(CLIENTS[sys.argv[1]](sys.argv[2]), sys.stdout)
