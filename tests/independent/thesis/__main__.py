"""`python -m tests.independent.thesis`: computes every number again and writes `values.json`; some four minutes.

`--table` computes nothing and prints the file: entry, what the thesis prints, value, error, and whether they agree in
the printed digits.
"""

import argparse
import json
import sys
from typing import Any

from .chapters import entries
from .values import FILE, agreement, load, numbers


def write() -> None:
    """Computes all entries. The file is written at the end, as a whole."""
    found = {}
    for one in entries():
        sys.stderr.write(f"{one.name}\n")
        found[one.name] = one.record()
    FILE.write_text(in_lines(found), encoding="utf-8")


def in_lines(found: dict[str, dict[str, Any]]) -> str:
    """JSON with a line for each variant."""
    blocks = []
    for name, one in found.items():
        head = ", ".join(f"{json.dumps(key)}: {json.dumps(one[key])}" for key in ("printed", "unit", "conditions"))
        variants = ",\n".join(f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in one["values"].items())
        blocks.append(f'{json.dumps(name)}: {{\n {head}, "values": {{\n{variants}\n }}\n}}')
    return "{\n" + ",\n".join(blocks) + "\n}\n"


def table() -> None:
    for name, one in load().items():
        sys.stdout.write(f"{name}: {' '.join(one['printed']) or 'none'} {one['unit']} ({one['conditions']})\n")
        for variant, found in one["values"].items():
            value = ", ".join(f"{v:.6g}" for v in numbers(found["value"]))
            error = max(numbers(found["error"]))
            sys.stdout.write(f"    {variant}: {value} ± {error:.0e}  {agreement(one['printed'], found['value'])}\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--table", action="store_true", help="print values.json")
    if not parser.parse_args().table:
        write()
    table()
