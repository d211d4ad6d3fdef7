"""Prints the table of margins of ../robustness-scenarios.md, a row for each expectation.

    twin study robustness scenarios/*.toml scenarios/thesis/*.toml
    python3 docs/examples/margins.py studies/robustness-….md
"""

import re
import sys

ALL = ["32 of 32", "89.3 % to 100.0 %"]


def row(line: str) -> str:
    cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip()[1:-1])]
    name, held, margins, unit, unobserved, changes = (
        cells[0], cells[1:3], cells[3:8], cells[8], cells[9], cells[10])
    remarks = [f"holds in {held[0]}, {held[1]}"] if held != ALL else []
    remarks += [f"not observed in {unobserved}"] if unobserved else []
    remarks += [f"changes at {changes}"] if changes else []
    same = len(set(margins)) == 1
    return f"| {name} | {margins[0] if same else ' · '.join(margins)} | {unit} | {'; '.join(remarks)} |"


with open(sys.argv[1], encoding="utf-8") as file:
    sections = re.split(r"^## ", file.read(), flags=re.M)[1:]
print("| expectation | margins | unit | remark |\n|---|---|---|---|")
for section in sections:
    title, *lines = section.splitlines()
    print(f"| **{title}** | | | |")
    for line in [line for line in lines if line.startswith("|")][2:]:
        print(row(line))
