"""Shared by the readers of recordings: messages as plain values, numbers with their exact bits."""

import struct


def plain(value):
    """Converts a decoded message of either package to JSON values."""
    if isinstance(value, float):
        return struct.pack(">d", value).hex()
    if isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    fields = [*getattr(type(value), "__slots__", ()), *vars(value)]
    # One of the packages lists the constants of a definition among its fields.
    fields = [name for name in fields if not name.startswith("_") and not name.isupper()]
    return {name: plain(getattr(value, name)) for name in fields}
