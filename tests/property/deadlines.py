"""How much is done between two looks at the flag that cancels, of each of property_cancel's documents:
in instructions, as valgrind's callgrind tells them at each look; and how long a processor works on once
another thread has cancelled. Writes a table of docs/deadlines.md; fails where more is done than a
processor of half an instruction a nanosecond does in a tenth of a second, or in half a second with
portable kernels.

    deadlines.py [--portable] [STAGE...]    all, unless some are named: these are only told"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

TESTS = Path(os.environ["SHADED_BUILD"]) / "tests"
PROGRAM = TESTS / "property_cancel"
PAGE = Path(os.environ["SHADED_SOURCE"]) / "docs" / "deadlines.md"
MOST = {"auto": 50_000_000, "portable": 250_000_000}


def stages():
    done = subprocess.run([PROGRAM, "gaps", "?"], capture_output=True, text=True, check=False)
    return done.stdout.splitlines()


def gaps(stage, kernel):
    """Instructions of all threads between the looks of a stage, from its begin to its end."""
    with tempfile.NamedTemporaryFile("r", prefix="gaps-") as log:
        subprocess.run(["valgrind", "--tool=callgrind", "--instr-atstart=no",
                        "--callgrind-out-file=/dev/null", f"--log-file={log.name}", PROGRAM, "gaps",
                        stage, kernel], check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "LD_PRELOAD": str(TESTS / "hwy_timer.so")})
        totals = []
        for line in log:
            if line.startswith("events: "):
                totals.append(0)
            elif match := re.match(r"events-\d+: (\d+)", line):
                totals[-1] += int(match[1])
    return [after - before for before, after in zip(totals, totals[1:])]


def late(stage, kernel):
    """Processor milliseconds after it was cancelled by another thread, at most."""
    done = subprocess.run([PROGRAM, "late", stage, kernel], check=True, capture_output=True,
                          text=True)
    return done.stdout.strip()


def measure(names, kernel):
    """The table's lines, and the documents of which too much is done."""
    lines = ["| document | looks | millions of instructions between two, at most | ms after |",
             "| --- | ---: | ---: | ---: |"]
    slow = []
    for stage in names:
        found = gaps(stage, kernel)
        lines.append(f"| {stage} | {len(found) - 1} | {max(found) / 1e6:.1f} "
                     f"| {late(stage, kernel)} |")
        print(lines[-1], flush=True)
        slow += [stage] if max(found) > MOST[kernel] else []
    return lines, slow


def main():
    names = [word for word in sys.argv[1:] if word != "--portable"]
    kernel = "portable" if "--portable" in sys.argv else "auto"
    lines, slow = measure(names or stages(), kernel)
    if not names:
        mark = f"<!-- {kernel} -->\n"
        head, rest = PAGE.read_text().split(mark)[::2]
        PAGE.write_text(head + mark + "\n".join(lines) + "\n" + mark + rest)
    if slow:
        sys.exit(f"much is done between two looks: {', '.join(slow)}")


if __name__ == "__main__":
    main()
