"""Reads a recording with the packages `mcap` and `mcap-ros2-support` and prints its contents as JSON.

Usage: read_recording.py FILE
"""

import json
import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from plain import plain


def main(path):
    found = {"messages": {}, "schemas": {}, "channels": {}}
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        found["profile"] = reader.get_header().profile
        for schema in summary.schemas.values():
            found["schemas"][schema.name] = schema.encoding
        for channel in summary.channels.values():
            found["channels"][channel.topic] = [channel.message_encoding, channel.metadata]
            found["messages"][channel.topic] = []
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found["messages"][channel.topic].append([message.log_time, plain(decoded)])
        found["attachments"] = {a.name: a.data.decode() for a in reader.iter_attachments()}
        found["metadata"] = {m.name: m.metadata for m in reader.iter_metadata()}
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
