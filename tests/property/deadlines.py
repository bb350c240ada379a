"""How much is done between two looks at the flag that cancels, of each of property_cancel's documents:
in instructions, as valgrind's callgrind tells them at each look; and how long a processor works on once
another thread has cancelled. Writes the table of docs/deadlines.md; fails where more is done than a
processor of half an instruction a nanosecond does in a tenth of a second.

    deadlines.py [STAGE...]    all, unless some are named: these are only told"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = Path(os.environ["SHADED_BUILD"]) / "tests" / "property_cancel"
PAGE = Path(os.environ["SHADED_SOURCE"]) / "docs" / "deadlines.md"
MOST = 50_000_000


def stages():
    done = subprocess.run([PROGRAM, "gaps", "?"], capture_output=True, text=True, check=False)
    return done.stdout.splitlines()


def gaps(stage):
    """Instructions of all threads between the looks of a stage, from its begin to its end."""
    with tempfile.NamedTemporaryFile("r", prefix="gaps-") as log:
        subprocess.run(["valgrind", "--tool=callgrind", "--instr-atstart=no",
                        "--callgrind-out-file=/dev/null", f"--log-file={log.name}", PROGRAM, "gaps",
                        stage], check=True, stdout=subprocess.DEVNULL)
        totals = []
        for line in log:
            if line.startswith("events: "):
                totals.append(0)
            elif match := re.match(r"events-\d+: (\d+)", line):
                totals[-1] += int(match[1])
    return [after - before for before, after in zip(totals, totals[1:])]


def late(stage):
    """Processor milliseconds after it was cancelled by another thread, at most."""
    done = subprocess.run([PROGRAM, "late", stage], check=True, capture_output=True, text=True)
    return done.stdout.strip()


def main():
    lines = ["| document | looks | millions of instructions between two, at most | ms after |",
             "| --- | ---: | ---: | ---: |"]
    slow = []
    for stage in sys.argv[1:] or stages():
        found = gaps(stage)
        lines.append(f"| {stage} | {len(found) - 1} | {max(found) / 1e6:.1f} | {late(stage)} |")
        print(lines[-1], flush=True)
        slow += [stage] if max(found) > MOST else []
    if len(sys.argv) == 1:
        head, rest = PAGE.read_text().split("<!-- table -->\n")[::2]
        PAGE.write_text(f"{head}<!-- table -->\n" + "\n".join(lines) + f"\n<!-- table -->\n{rest}")
    if slow:
        sys.exit(f"much is done between two looks: {', '.join(slow)}")


if __name__ == "__main__":
    main()
