"""Reads a recording with the packages `mcap` and `mcap-ros2-support` and prints what it found as JSON.

Usage: read_recording.py FILE
"""

import json
import struct
import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory


def bits(message, field):
    """The exact bits of a field, as hexadecimal numbers."""
    value = getattr(message, field)
    values = value if isinstance(value, (list, tuple)) else [value]
    return [struct.pack(">d", number).hex() for number in values]


def main(path):
    found = {"samples": {}, "json": {}, "schemas": {}}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        found["message_count"] = summary.statistics.message_count
        for schema in summary.schemas.values():
            found["schemas"][schema.name] = schema.encoding
        for schema, channel, message in reader.iter_messages():
            if channel.message_encoding == "json":
                found["json"].setdefault(channel.topic, []).append(json.loads(message.data))
        for schema, channel, message, decoded in reader.iter_decoded_messages(
            topics=[c.topic for c in summary.channels.values() if c.message_encoding == "cdr"]
        ):
            signals = json.loads(channel.metadata["signals"])
            values = {signal["name"]: bits(decoded, signal["field"]) for signal in signals}
            found["samples"].setdefault(channel.topic, []).append(
                [message.log_time, values, message.sequence]
            )
        found["attachments"] = {a.name: a.data.decode() for a in reader.iter_attachments()}
        found["metadata"] = {m.name: m.metadata for m in reader.iter_metadata()}
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
