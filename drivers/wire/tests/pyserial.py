"""Client of both transports by pySerial: arguments are the URLs of an echo, by `socket://` and by
`rfc2217://`; standard input has the bytes and the baud rate. Prints what came back."""

import json
import sys

import serial

given = json.load(sys.stdin)
sent = bytes(given["bytes"])


def echoes(port):
    found = []
    for _ in range(3):
        port.write(sent)
        found.append(list(port.read(len(sent))))
    return found


raw, remote = sys.argv[1:]
with serial.serial_for_url(raw, timeout=10) as port:
    found = [echoes(port)]
with serial.serial_for_url(remote, baudrate=given["baud"], timeout=10) as port:
    found.append(echoes(port))
    lines = {"cts": port.cts, "dsr": port.dsr, "cd": port.cd}
    port.rts = False
    port.reset_input_buffer()
try:
    serial.serial_for_url(remote, baudrate=9600).close()
    refused = "opened"
except ValueError as error:
    refused = str(error)
print(json.dumps({"echoes": found, "lines": lines, "refused": refused}))
