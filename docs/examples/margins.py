"""Prints the table of margins of ../robustness-scenarios.md, a row for each expectation.

    twin study robustness scenarios/*.toml scenarios/thesis/*.toml
    python3 docs/examples/margins.py studies/robustness-….json
"""

import json
import sys

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float) -> str:
    """Three digits, or two and a power of ten where the value is small."""
    if value == 0 or abs(value) >= 1e-3:
        return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    mantissa, exponent = f"{value:.1e}".replace(".0e", "e").split("e")
    power = "10" + str(int(exponent)).translate(SUPERSCRIPTS)
    return power if mantissa == "1" else f"{mantissa} × {power}"


def row(found: dict) -> str:
    margins = found["margins"]
    texts = [number(margins[key]) for key in ("min", "p5", "median", "p95", "max")]
    remarks = []
    if found["held"] < found["runs"]:
        low, high = (f"{100 * found['interval'][end]:.1f} %" for end in ("low", "high"))
        remarks.append(f"holds in {found['held']} of {found['runs']}, {low} to {high}")
    if found["unobserved"]:
        remarks.append(f"not observed in {found['unobserved']}")
    if (at := found["changes_at"]) is not None:
        remarks.append(f"changes at {at if at == '1 ulp' else format(at, '.1e')}")
    text = texts[0] if len(set(texts)) == 1 else " · ".join(texts)
    return f"| {found['name']} | {text} | {found['unit'] or 1} | {'; '.join(remarks)} |"


with open(sys.argv[1], encoding="utf-8") as file:
    results = json.load(file)["results"]
print("| expectation | margins | unit | remark |\n|---|---|---|---|")
for result in results:
    print(f"| **{result['case']['scenario']}, on {result['case']['plant']}** | | | |")
    for found in result["expectations"]:
        print(row(found))
