"""Functions of src/ have at most 50 lines, files at most 500."""

import os
import re
import unittest
from pathlib import Path

SOURCE = Path(os.environ["SHADED_SOURCE"]) / "src"
FUNCTION_LINES, FILE_LINES = 50, 500


def long_functions(text):
    """[(line, lines)]: bodies from `) {` at the end of a line to a `}` at the beginning of one, as
    clang-format lays functions out."""
    found, start, signature = [], None, False
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"[A-Za-z_]", line):
            signature = line.endswith((",", "(")) or "(" in line
        if signature and line.endswith(") {"):
            start, signature = number, False
        elif line.startswith("}") and start:
            if number - start - 1 > FUNCTION_LINES:
                found.append((start, number - start - 1))
            start = None
    return found


class Sizes(unittest.TestCase):
    def sources(self):
        found = [path for suffix in ("c", "h", "cpp", "hpp") for path in SOURCE.rglob(f"*.{suffix}")]
        self.assertGreater(len(found), 200)
        return sorted(found)

    def test_functions(self):
        for path in self.sources():
            for line, lines in long_functions(path.read_text(encoding="utf-8")):
                with self.subTest(function=f"{path.relative_to(SOURCE)}:{line}"):
                    self.assertLessEqual(lines, FUNCTION_LINES)

    def test_files(self):
        for path in self.sources():
            with self.subTest(file=str(path.relative_to(SOURCE))):
                self.assertLessEqual(len(path.read_text(encoding="utf-8").splitlines()), FILE_LINES)

    def test_a_long_function_is_found(self):
        body = "    x++;\n" * (FUNCTION_LINES + 1)
        for head in ("static void f(int x) {\n", "void f(int x,\n       int y) {\n"):
            self.assertEqual(len(long_functions(f"int y;\n{head}{body}}}\n")), 1)
        body = "    x++;\n" * FUNCTION_LINES
        self.assertEqual(long_functions(f"void f(int x) {{\n{body}}}\n"), [])


if __name__ == "__main__":
    unittest.main()
