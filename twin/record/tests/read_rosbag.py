"""Reads a recording as a ROS 2 bag with the package `rosbags` and prints its contents as JSON.

Usage: read_rosbag.py FILE
"""

import json
import sys
from pathlib import Path

from plain import plain
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def differences(typestore):
    """Message types that a release of ROS 2 defines differently, and those that no release defines."""
    releases = [store for store in Stores if store.name.startswith("ROS2_")]
    known = {store: get_typestore(store).fielddefs for store in releases}
    other = [
        [name, store.name]
        for name, definition in typestore.fielddefs.items()
        for store in releases
        if name in known[store] and known[store][name] != definition
    ]
    own = [name for name in typestore.fielddefs if not any(name in types for types in known.values())]
    return {"releases": len(releases), "other": other, "own": sorted(own)}


def main(path):
    found = {"messages": {}, "types": {}}
    with AnyReader([Path(path)]) as reader:
        for connection in reader.connections:
            found["types"][connection.topic] = connection.msgtype
            found["messages"][connection.topic] = []
        for connection, time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found["messages"][connection.topic].append([time, plain(message)])
        found.update(differences(reader.typestore))
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
