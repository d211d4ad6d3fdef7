"""Prints the first bytes of a recording, and how long the devices took to answer.

    pip install mcap mcap-ros2-support
    python docs/examples/round_trips.py recordings/first-contact-seed1.mcap [BUS]

BUS is the name of the bus, `sbcp` if it is missing.

The scenario has to have `[record] bytes = true`.
"""

import statistics
import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

PRINTED = 6
BUS = sys.argv[2] if len(sys.argv) > 2 else "sbcp"
OUT, IN = f"/wire/{BUS}/out", f"/wire/{BUS}/in"

written, answered, round_trips, lines = None, None, [], 0
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    for _, channel, message, wire in reader.iter_decoded_messages(topics=[OUT, IN]):
        time = message.log_time / 1e9 - 1  # recordings begin at 1 s
        if channel.topic == OUT:
            if written is not None and answered is not None:
                round_trips.append(answered - written)
            written, answered = time, None
        else:
            answered = time  # the last bytes before the next request
        if lines < PRINTED:
            print(f"{time:6.3f} s  {'>' if channel.topic == OUT else '<'} {wire.data.hex(' ')}")
        lines += 1

# Everything before the first step of the controller has time 0 on hardware.
timed = [1e3 * time for time in round_trips if time > 0]
if timed:
    median, longest = statistics.median(timed), max(timed)
    print(f"{len(timed)} round trips: median {median:.2f} ms, longest {longest:.1f} ms")
else:
    print(f"no round trip: {lines} pieces of bytes on the bus `{BUS}`, all before the first step")
