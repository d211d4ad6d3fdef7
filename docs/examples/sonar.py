"""Stands in for a range finder at a serial port: answers every `R` by a distance in millimetres.

    python3 docs/examples/sonar.py sonar [--sum]    # makes the link `sonar` to a PTY

The distance rises by 1 mm with every answer, from 120 to 140 and again. With --sum the answers have
a checksum. Ends with Ctrl-C, or when its standard input is closed.
"""

import os
import select
import sys
import time
import tty

MEASUREMENT_S = 0.005

device, port = os.openpty()
tty.setraw(device)
link = sys.argv[1]
if os.path.islink(link):
    os.remove(link)
os.symlink(os.ttyname(port), link)
print(f"connect with: --port sonar={link}", flush=True)
answers = 0
try:
    while True:
        ready = select.select([device, sys.stdin], [], [])[0]
        if device in ready:
            for _ in range(os.read(device, 256).count(b"R")):
                time.sleep(MEASUREMENT_S)
                digits = str(120 + answers % 21)
                end = f"*{sum(digits.encode()) % 256:02X}" if "--sum" in sys.argv else ""
                os.write(device, f"R{digits}{end}\n".encode())
                answers += 1
        elif not sys.stdin.read(1):
            break
except KeyboardInterrupt:
    pass
os.remove(link)
print(f"{answers} answers")
