"""Holds scenarios against a JSON schema with the packages `tomllib` and `jsonschema`.

Reads `{"schema": …, "documents": [text, …], "mutants": count}` from standard input. Prints `{"errors": [[message, …], …],
"mutants": [{"text": …, "errors": [message, …]}, …]}`: what the validator finds in each document (nothing where it accepts
it), and in mutants of those that it accepts. A mutant lacks a key, has one more, or has another value somewhere, as often
as not one that another document has at a key of that name. The same documents give the same mutants.
"""

import copy
import json
import random
import sys
import tomllib

from jsonschema import Draft202012Validator

VALUES = [
    0, 1, -1, 7, 0.5, -0.25, 1e6, True, False, "", "none", "all", "x", "LF", "0.5", "2 %", "-1 %", "20 ppm",
    "1 s", "2 ms", "0 ms", "-1 s", "5 us", "3 Hz", "-3 Hz", "1 kHz", "2 cm", "-1 mm", "1 m/s", "30 deg", "-0.1 rad",
    "2 rad/s", "3 N", "1 N·s", "2 N·m", "4 g", "1 V", "1 furlong", "+3e-3 m", "1e400 m", " 2 m ", "2m", "3 N*m",
    [], ["LF"], ["LF", "RH"], [["LF", "RH"], "LH"], ["1 ms"], {}, {"min": 1}, {"max": "1 m"}, {"near": 1, "within": "5 %"},
    {"near": "1 Hz", "within": "5 %"}, {"min": "1 ms", "max": "2 ms"}, {"trace": ["1 ms"]}, {"fore": 0.5}, {"LF": "3 deg"},
    {"grid": "1 ms"}, {"grid": "1 ms", "inputs": "held"},
]  # fmt: skip


def errors(validator, document):
    return [f"{error.json_path}: {error.message}" for error in validator.iter_errors(document)]


def tables(node):
    """Every table in a document, the document first."""
    if isinstance(node, dict):
        yield node
        for value in node.values():
            yield from tables(value)
    elif isinstance(node, list):
        for value in node:
            yield from tables(value)


def mutant(chance, documents, seen):
    document = copy.deepcopy(chance.choice(documents))
    table = chance.choice([table for table in tables(document)])
    for _ in range(chance.choice([1, 1, 2])):
        keys = list(table)
        key = chance.choice(keys) if keys else "key"
        action = chance.randrange(6)
        if action == 0:
            table.pop(key, None)
        elif action == 1:
            table[chance.choice(list(seen))] = copy.deepcopy(chance.choice(VALUES))
        elif action == 2:
            table[key] = copy.deepcopy(chance.choice(VALUES))
        elif action == 3:
            table[key] = copy.deepcopy(chance.choice(seen.get(key, VALUES)))
        else:
            # A key that is known in a table like this one, with a value that it had there.
            name = chance.choice(list(seen))
            table[name] = copy.deepcopy(chance.choice(seen[name]))
    return document


def written(value):
    """A value as TOML has it within a line."""
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value)
        case int() | float():
            return repr(value)
        case list():
            return "[" + ", ".join(written(item) for item in value) + "]"
        case dict():
            return "{" + ", ".join(f"{json.dumps(key)} = {written(item)}" for key, item in value.items()) + "}"
    raise TypeError(f"{value!r} is not in any scenario")


def main():
    given = json.load(sys.stdin)
    Draft202012Validator.check_schema(given["schema"])
    validator = Draft202012Validator(given["schema"])
    found, sound, seen = [], [], {}
    for text in given["documents"]:
        try:
            document = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            found.append([f"not TOML: {error}"])
            continue
        found.append(errors(validator, document))
        if not found[-1]:
            sound.append(document)
            for table in tables(document):
                for key, value in table.items():
                    seen.setdefault(key, []).append(value)
    chance = random.Random(26)
    mutants = []
    for _ in range(given["mutants"]):
        document = mutant(chance, sound, seen)
        text = "\n".join(f"{json.dumps(key)} = {written(value)}" for key, value in document.items())
        mutants.append({"text": text, "errors": errors(validator, document)})
    json.dump({"errors": found, "mutants": mutants}, sys.stdout)


if __name__ == "__main__":
    main()
