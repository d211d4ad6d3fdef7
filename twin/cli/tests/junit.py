"""Violations of two schemas in the JUnit documents at the paths in the arguments.

The rules are those of junit-10.xsd of Jenkins' xunit-plugin and of JUnit.xsd of
windyroad/JUnit-Schema (Apache Ant), for the elements that a report of runs has.
"""

import json
import re
import sys
from xml.etree import ElementTree

DECIMAL = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)")
WHOLE = re.compile(r"[+-]?[0-9]{1,9}")
DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}")
# Surefire's time of the Jenkins schema, without separators of thousands.
SECONDS = re.compile(r"[0-9]*(\.[0-9]{0,3})?")
TEXT = re.compile(r"(?s).*")
FILLED = re.compile(r"(?s).*\S.*")

RESULT = {"message": TEXT, "type": TEXT}
# Element: required attributes, optional ones, order of the children (letters of CHILDREN).
CHILDREN = {"properties": "p", "testcase": "c", "system-out": "o", "system-err": "e",
            "testsuite": "s", "property": "y", "failure": "f", "error": "x", "skipped": "k"}
ANT = {
    "testsuites": ({}, {}, "s*"),
    "testsuite": (
        {"name": FILLED, "package": TEXT, "id": WHOLE, "timestamp": DATE, "hostname": FILLED,
         "tests": WHOLE, "failures": WHOLE, "errors": WHOLE, "time": DECIMAL},
        {"skipped": WHOLE},
        "pc*oe",
    ),
    "properties": ({}, {}, "y*"),
    "property": ({"name": FILLED, "value": TEXT}, {}, ""),
    "testcase": ({"name": TEXT, "classname": TEXT, "time": DECIMAL}, {}, "[fxk]?"),
    "failure": ({"type": TEXT}, {"message": TEXT}, ""),
    "error": ({"type": TEXT}, {"message": TEXT}, ""),
    "skipped": ({}, RESULT, ""),
    "system-out": ({}, {}, ""),
    "system-err": ({}, {}, ""),
}
JENKINS = {
    "testsuites": ({}, {"name": TEXT, "time": SECONDS, "tests": TEXT, "failures": TEXT,
                        "errors": TEXT}, "s*"),
    "testsuite": (
        {"name": TEXT, "tests": TEXT, "failures": TEXT, "errors": TEXT},
        {"group": TEXT, "time": SECONDS, "skipped": TEXT, "timestamp": TEXT, "hostname": TEXT,
         "id": TEXT, "package": TEXT, "file": TEXT, "log": TEXT, "url": TEXT},
        "[spcoe]*",
    ),
    "properties": ({}, {}, "y*"),
    "property": ({"name": TEXT, "value": TEXT}, {}, ""),
    "testcase": ({"name": TEXT}, {"time": TEXT, "classname": TEXT, "group": TEXT}, "[kxfoe]*"),
    "failure": ({}, RESULT, ""),
    "error": ({}, RESULT, ""),
    "skipped": ({}, RESULT, ""),
    "system-out": ({}, {}, ""),
    "system-err": ({}, {}, ""),
}


def violations(element, rules):
    required, optional, order = rules[element.tag]
    known = required | optional
    for name in required.keys() - element.attrib.keys():
        yield f"{element.tag} has no {name}"
    for name, value in element.attrib.items():
        if name not in known:
            yield f"{element.tag} cannot have {name}"
        elif not known[name].fullmatch(value):
            yield f"{name} of {element.tag} cannot be {value!r}"
    children = "".join(CHILDREN.get(child.tag, "?") for child in element)
    if not re.fullmatch(order, children):
        yield f"the children of {element.tag} are {children}"
    for child in element:
        yield from violations(child, rules)


def counts(suite):
    """Numbers of a suite that are not those of its cases; names that are not unique."""
    cases = suite.findall("testcase")
    for attribute, tag in [("failures", "failure"), ("errors", "error"), ("skipped", "skipped")]:
        count = sum(case.find(tag) is not None for case in cases)
        if int(suite.get(attribute)) != count:
            yield f"{attribute} is {suite.get(attribute)} of {count}"
    if int(suite.get("tests")) != len(cases):
        yield f"tests is {suite.get('tests')} of {len(cases)}"
    times = sum(float(case.get("time")) for case in cases)
    if cases and abs(times - float(suite.get("time"))) > 0.5e-3 * (len(cases) + 1):
        yield f"the times of the cases sum up to {times}"


found = []
for path in sys.argv[1:]:
    root = ElementTree.parse(path).getroot()
    for rules in (ANT, JENKINS):
        found += violations(root, rules)
    found += [text for suite in root for text in counts(suite)]
    names = [(case.get("classname"), case.get("name")) for case in root.iter("testcase")]
    names += [(suite.get("name"), None) for suite in root]
    found += [f"{name} is there twice" for name in set(names) if names.count(name) > 1]
print(json.dumps(found))
