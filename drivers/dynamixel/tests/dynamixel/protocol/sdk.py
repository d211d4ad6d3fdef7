"""Packets as the vendors' libraries make and read them: `dynamixel_sdk` and `scservo_sdk`.

Reads `{"protocol": "1.0" | "2.0" | "scs", "calls": [[function, argument, ...]], "answers": [hex]}`
and prints `{"requests": [hex], "stuffed": [hex], "statuses": [[identifier, error, data] | null]}`:
the bytes that each call transmits, the same with byte stuffing, and what is received when a servo
answers by these bytes.

`Protocol2PacketHandler.txPacket` of `dynamixel_sdk` 4.1.0 drops the packet that `addStuffing`
returns, and transmits the one without stuffing.
"""

import json
import sys


class Port:
    """A port in memory."""

    is_using = False
    received = b""
    sent = []

    def clearPort(self):
        pass

    def writePort(self, packet):
        self.sent = list(packet)
        return len(packet)

    def readPort(self, length):
        taken, self.received = self.received[:length], self.received[length:]
        return list(taken)

    def setPacketTimeout(self, length):
        pass

    def setPacketTimeoutMillis(self, millis):
        pass

    def isPacketTimeout(self):
        return not self.received

    def getBaudRate(self):
        return 1_000_000


def handler(kind):
    if kind == "scs":
        import scservo_sdk

        return scservo_sdk.PacketHandler(0)
    import dynamixel_sdk

    return dynamixel_sdk.PacketHandler(float(kind))


def transmitted(packets, port, calls):
    requests = []
    for function, *arguments in calls:
        getattr(packets, function)(port, *arguments)
        port.is_using = False
        requests.append(bytes(port.sent).hex())
    return requests


def main():
    task = json.load(sys.stdin)
    packets, port = handler(task["protocol"]), Port()
    requests = stuffed = transmitted(packets, port, task["calls"])
    if task["protocol"] == "2.0":
        add_stuffing = packets.addStuffing

        def in_place(packet):
            packet[:] = add_stuffing(packet)

        packets.addStuffing = in_place
        stuffed = transmitted(packets, port, task["calls"])
        del packets.addStuffing
    statuses = []
    for answer in task["answers"]:
        port.received = bytes.fromhex(answer)
        fast = [False] if task["protocol"] == "2.0" else []
        packet, result = packets.rxPacket(port, *fast)
        data = None
        if result == 0:
            start, checksum = (8, 2) if task["protocol"] == "2.0" else (4, 1)
            identifier = packet[4 if start == 8 else 2]
            length = packet[5] + 256 * packet[6] if start == 8 else packet[3]
            end = (7 if start == 8 else 4) + length - checksum
            data = [identifier, packet[start], bytes(packet[start + 1 : end]).hex()]
        statuses.append(data)
    result = {"requests": requests, "stuffed": stuffed, "statuses": statuses}
    json.dump(result, sys.stdout)


main()
