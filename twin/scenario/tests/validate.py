"""Validates scenarios against a JSON schema with the packages `tomllib` and `jsonschema`.

Reads `{"schema": …, "documents": [text, …], "mutants": count}` from standard input. Prints
`{"errors": [[message, …], …], "mutants": [{"text": …, "errors": [message, …]}, …]}`: the errors in
each document, and in mutants of the valid ones. In a mutant a key is removed, added, or has another
value, about half of the time one of a key of that name in another document. The same documents
give the same mutants.
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
    """Yields all tables of a document, the document first."""
    if isinstance(node, dict):
        yield node
        for value in node.values():
            yield from tables(value)
    elif isinstance(node, list):
        for value in node:
            yield from tables(value)


def mutant(rng, documents, values_by_key):
    document = copy.deepcopy(rng.choice(documents))
    table = rng.choice([table for table in tables(document)])
    for _ in range(rng.choice([1, 1, 2])):
        keys = list(table)
        key = rng.choice(keys) if keys else "key"
        action = rng.randrange(6)
        if action == 0:
            table.pop(key, None)
        elif action == 1:
            table[rng.choice(list(values_by_key))] = copy.deepcopy(rng.choice(VALUES))
        elif action == 2:
            table[key] = copy.deepcopy(rng.choice(VALUES))
        elif action == 3:
            table[key] = copy.deepcopy(rng.choice(values_by_key.get(key, VALUES)))
        else:
            # A key of another table, with a value that it has there.
            name = rng.choice(list(values_by_key))
            table[name] = copy.deepcopy(rng.choice(values_by_key[name]))
    return document


def inline_toml(value):
    """Returns a value in inline TOML notation."""
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value)
        case int() | float():
            return repr(value)
        case list():
            return "[" + ", ".join(inline_toml(item) for item in value) + "]"
        case dict():
            return "{" + ", ".join(f"{json.dumps(key)} = {inline_toml(item)}" for key, item in value.items()) + "}"
    raise TypeError(f"{value!r} has no TOML notation")


def main():
    request = json.load(sys.stdin)
    Draft202012Validator.check_schema(request["schema"])
    validator = Draft202012Validator(request["schema"])
    errors_of_documents, valid, values_by_key = [], [], {}
    for text in request["documents"]:
        try:
            document = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            errors_of_documents.append([f"not TOML: {error}"])
            continue
        errors_of_documents.append(errors(validator, document))
        if not errors_of_documents[-1]:
            valid.append(document)
            for table in tables(document):
                for key, value in table.items():
                    values_by_key.setdefault(key, []).append(value)
    rng = random.Random(26)
    mutants = []
    for _ in range(request["mutants"]):
        document = mutant(rng, valid, values_by_key)
        text = "\n".join(f"{json.dumps(key)} = {inline_toml(value)}" for key, value in document.items())
        mutants.append({"text": text, "errors": errors(validator, document)})
    json.dump({"errors": errors_of_documents, "mutants": mutants}, sys.stdout)


if __name__ == "__main__":
    main()
