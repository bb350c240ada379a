"""The commands that let clang read, and not compile, each source that is no generated one, a zero byte after
each: read_with_clang.py COMPILE_COMMANDS"""

import json
import shlex
import sys

for entry in json.load(open(sys.argv[1], encoding="utf-8")):
    if not entry["file"].startswith(entry["directory"]):
        command = entry["command"].rpartition(" -o ")[0]
        folder, file = shlex.quote(entry["directory"]), shlex.quote(entry["file"])
        sys.stdout.write(f"cd {folder} && exec {command} -fsyntax-only {file}\0")
