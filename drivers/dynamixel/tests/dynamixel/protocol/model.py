"""Prints the control table of a model in `dynamixel_easy_sdk`: `[[address, size, name]]`.

Reads `{"model": NAME}`; the name is that of the model's file.
"""

import json
import pathlib
import sys

import dynamixel_easy_sdk

folder = pathlib.Path(dynamixel_easy_sdk.__file__).parent / "control_table"
text = (folder / f"{json.load(sys.stdin)['model']}.model").read_text()
rows = [row.split("\t") for row in text.split("[control table]")[1].splitlines()[2:]]
items = [[int(address), int(size), name] for address, size, name in (row for row in rows if len(row) == 3)]
json.dump(items, sys.stdout)
