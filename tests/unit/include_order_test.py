"""The rooms of src/ include each other in one direction only, and C++ stays in its files."""

import os
import re
import unittest
from pathlib import Path

SOURCE = Path(os.environ["SHADED_SOURCE"])


def read_table():
    """What the files of a room, or of a room's folder, may include besides the headers beside them,
    as ARCHITECTURE.md has it. A file's path stands for that header alone; "" is shaded.h itself."""
    text = (SOURCE / "ARCHITECTURE.md").read_text(encoding="utf-8")
    chapter = re.search(r"^### What may include what$(.*?)^##", text, re.M | re.S).group(1)
    rows = re.findall(r"^\| `([^`]+)` \|((?: `[^`]+`)*) \|$", chapter, re.M)
    return {"" if room == "shaded.h" else room.rstrip("/"):
            {name.rstrip("/") for name in re.findall("`([^`]+)`", names)} for room, names in rows}


ALLOWED = read_table()
CPP_FILES = {"color/ocio.hpp", "color/ocio.cpp", "color/ocio_codes.cpp", "color/ocio_config.cpp",
             "color/ocio_measure.cpp", "color/ocio_polar.cpp", "color/ocio_shelf.cpp",
             "color/ocio_transform.cpp", "color/ocio_walk.cpp", "image/oiio.hpp",
             "image/oiio.cpp", "image/oiio_read.cpp", "scene/quick.cpp"}
# Pages and other things that are no C.
ROOMS_WITHOUT_CODE = {"studio"}

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', re.MULTILINE)
# Comments and texts.
LITERAL = re.compile(r'/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.S)
NAME = re.compile(r"\bshd_\w+")
# A function that other files see, at the beginning of a line as clang-format lays it out.
DEFINITION = re.compile(r"^(?!static|typedef)[A-Za-z_][^;{}()=]*?\b(shd_\w+)\([^;{}]*?\)\s*\{", re.M)
SUFFIXES = {".c", ".h", ".inc", ".cpp", ".hpp", ".cc", ".cxx"}


def room_of(path):
    """The first folder of a path below src/; "" for a file directly in it."""
    return path.split("/")[0] if "/" in path else ""


def beginnings(path):
    """The path, its folders and its room, in that order."""
    return [path.rsplit("/", n)[0] for n in range(path.count("/") + 1)]


def place_of(path):
    """The folder, or else the room, whose line of the table a file is held to."""
    return next((part for part in beginnings(path)[1:] if part in ALLOWED), room_of(path))


def violations(files):
    """What is wrong in `files`, a dictionary from paths below src/ to their texts."""
    found = []
    for path, text in sorted(files.items()):
        room, place = room_of(path), place_of(path)
        if room not in ALLOWED:
            found.append(f"{path}: '{room}' is no room that the table knows")
            continue
        if Path(path).suffix in {".cpp", ".hpp", ".cc", ".cxx"} and path not in CPP_FILES:
            found.append(f"{path}: C++ outside {' and '.join(sorted(CPP_FILES))}")
        for bracket, target in INCLUDE.findall(text):
            if bracket == '"' and f"{Path(path).parent}/{target}" in files:
                continue  # a neighbour in the same folder
            ours = target in files or room_of(target) in ALLOWED and "/" in target
            if bracket == "<":
                if target in files:
                    found.append(f"{path}: <{target}> is ours and wants quotes")
                continue
            if not ours:
                found.append(f"{path}: \"{target}\" is not written from src/, or not there")
            elif place_of(target) != place and not ALLOWED[place] & set(beginnings(target)):
                found.append(f"{path}: {place or 'shaded.h'} may not include \"{target}\"")
    return found


def read_sources():
    source, files = SOURCE / "src", {}
    for path in source.rglob("*"):
        below = path.relative_to(source).as_posix()
        if path.suffix in SUFFIXES and room_of(below) not in ROOMS_WITHOUT_CODE:
            files[below] = path.read_text(encoding="utf-8")
    return files


def find_way(edges):
    """A way along `edges`, a dictionary from nodes to nodes, that comes back; [] if there is none."""
    done = set()

    def follow(node, way):
        if node in way:
            return way[way.index(node):]
        if node in done:
            return []
        circle = next(filter(None, (follow(to, way + [node]) for to in sorted(edges.get(node, ())))), [])
        done.add(node)
        return circle

    return next(filter(None, (follow(node, []) for node in sorted(edges))), [])


def find_circle(files):
    """Files that include each other by a way that comes back; [] if there are none."""
    return find_way({path: [name for _, target in INCLUDE.findall(text)
                            for name in (f"{Path(path).parent}/{target}", target) if name in files]
                     for path, text in files.items()})


def find_call_circle(files):
    """Sources that use each other by a way that comes back; [] if there are none. A source uses
    another one if it calls what that alone defines or, below server/, includes its header."""
    code = {path: LITERAL.sub(" ", text) for path, text in files.items() if path.endswith((".c", ".cpp"))}
    owners = {}
    for path, text in code.items():
        for name in DEFINITION.findall(text):
            owners.setdefault(name, set()).add(path)

    def used(path, text):
        for name in set(NAME.findall(text)):
            if len(owners.get(name, ())) == 1:
                yield from owners[name] - {path}
        header = path.rsplit(".", 1)[0] + ".h"
        if room_of(path) == "server":
            for _, target in INCLUDE.findall(files[path] + files.get(header, "")):
                source = target[:-2] + ".c"
                yield from {name for name in (f"{Path(path).parent}/{source}", source)
                            if name in code} - {path}

    return find_way({path: set(used(path, text)) for path, text in code.items()})


class IncludeOrder(unittest.TestCase):
    def test_sources_keep_the_order(self):
        files = read_sources()
        self.assertGreater(len(files), 20, "too few sources found: is the path right?")
        self.assertEqual(violations(files), [])

    def test_table_names_what_is_there(self):
        names = set().union(*ALLOWED.values(), ALLOWED) - {""}
        self.assertGreater(len(names), 12)
        self.assertEqual([name for name in sorted(names) if not (SOURCE / "src" / name).exists()], [])

    def test_headers_include_each_other_in_no_circle(self):
        self.assertEqual(find_circle(read_sources()), [])

    def test_sources_call_each_other_in_no_circle(self):
        self.assertEqual(find_call_circle(read_sources()), [])

    # The check itself: it must see what it is there for.

    def test_lower_room_may_not_include_higher(self):
        files = {"scene/scene.h": "", "base/arena.c": '#include "scene/scene.h"\n'}
        self.assertIn("base may not include", violations(files)[0])

    def test_stages_may_not_include_each_other(self):
        files = {"image/image.h": "", "color/ocio_walk.cpp": '  #  include "image/image.h"\n'}
        self.assertIn("color may not include", violations(files)[0])

    def test_doors_see_only_the_public_header(self):
        files = {"shaded.h": '#include "base/status.h"', "base/status.h": "",
                 "cli/main.c": '#include "shaded.h"\n#include "render/engine.h"\n'}
        self.assertEqual(len(violations(files)), 1)
        self.assertIn("render/engine.h", violations(files)[0])

    def test_shade_sees_only_the_gbuffer_of_sight(self):
        files = {"sight/gbuffer.h": "", "sight/rays.h": "",
                 "shade/a.c": '#include "sight/gbuffer.h"\n',
                 "shade/b.c": '#include "sight/rays.h"\n'}
        self.assertEqual(len(violations(files)), 1)
        self.assertIn("shade/b.c", violations(files)[0])

    def test_tiles_do_not_know_the_request(self):
        files = {"render/request.h": "", "render/rendering.h": "",
                 "render/tiles/a.c": '#include "render/rendering.h"\n',
                 "render/tiles/b.c": '#include "render/request.h"\n',
                 "render/show/c.c": '#include "render/request.h"\n'}
        self.assertEqual(len(violations(files)), 2)
        self.assertIn("render/tiles may not include", violations(files)[1])

    def test_includes_are_written_from_src(self):
        files = {"sight/rays.h": "", "base/arena.c": '#include "../sight/rays.h"\n',
                 "base/pool.c": "#include <sight/rays.h>\n"}
        self.assertEqual(len(violations(files)), 2)

    def test_cpp_stays_in_its_files(self):
        self.assertEqual(violations(dict.fromkeys(CPP_FILES, "")), [])
        self.assertEqual(len(violations({"sight/cast.cpp": ""})), 1)

    def test_a_circle_is_found(self):
        files = {"base/a.h": '#include "base/b.h"\n', "base/b.h": '#include "base/c.h"\n',
                 "base/c.h": '#include "base/b.h"\n'}
        self.assertEqual(find_circle(files), ["base/b.h", "base/c.h"])

    def test_a_circle_of_calls_is_found(self):
        files = {"base/a.c": "void shd_a(int x,\n           int y) {\n    shd_b();\n}\n",
                 "base/b.c": "shd_status *shd_b(void) {\n    shd_c();\n}\n",
                 "base/c.c": "int shd_c(void) {\n    shd_b();\n}\n"}
        self.assertEqual(find_call_circle(files), ["base/b.c", "base/c.c"])
        files["base/c.c"] = 'int shd_c(void) {\n    /* shd_b() */ puts("shd_b");\n}\n'
        self.assertEqual(find_call_circle(files), [])

    def test_a_circle_of_headers_is_found_in_the_server(self):
        files = {"server/jobs/a.c": '#include "a.h"\n#include "server/conn/b.h"\n', "server/jobs/a.h": "",
                 "server/conn/b.c": "", "server/conn/b.h": '#include "server/jobs/a.h"\n'}
        self.assertEqual(find_call_circle(files), ["server/conn/b.c", "server/jobs/a.c"])
        files["server/conn/b.h"] = ""
        self.assertEqual(find_call_circle(files), [])

    def test_unknown_rooms_are_refused(self):
        self.assertEqual(len(violations({"misc/util.c": ""})), 1)


if __name__ == "__main__":
    unittest.main()
