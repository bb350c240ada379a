"""`shade batch`: lines of a file become pictures in a folder."""

import itertools
import json
import signal
import subprocess
import time
import unittest

from cli_test import LONG, SHADE, SMALL, Case

RED = {**SMALL, "background": [1, 0, 0]}


class BatchTest(Case):
    def write(self, *lines):
        (self.folder / "list.jsonl").write_text(
            "\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines))

    def batch(self, *arguments, path="list.jsonl", **options):
        return self.shade("batch", path, "-o", "out", *arguments, **options)

    def made(self):
        out = self.folder / "out"
        return sorted(str(path.relative_to(out)) for path in out.rglob("*") if path.is_file())

    def rendered(self, document):
        done = self.shade("render", "-", "-o", "-", input=json.dumps(document).encode())
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def bytes_of(self, name):
        return (self.folder / "out" / name).read_bytes()

    def test_each_line_is_the_picture_of_its_scene(self):
        self.write(SMALL, "", {"name": "red ball", "scene": RED},
                   {"scene": SMALL, "variants": [{"background": [0, 1, 0]}, {"output": {"format": "jpeg"}}]},
                   {"name": "swept", "scene": SMALL, "sweep": {"/background": [[0, 0, i / 11] for i in range(11)]}})
        done = self.batch()
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, b"", b""))
        swept = [f"swept-{i:02}.png" for i in range(11)]
        self.assertEqual(self.made(), sorted(["000001.png", "red ball.png", "000004-0.png",
                                              "000004-1.jpeg", *swept]))
        self.assertEqual(self.bytes_of("000001.png"), self.rendered(SMALL))
        self.assertEqual(self.bytes_of("red ball.png"), self.rendered(RED))
        self.assertEqual(self.bytes_of("000004-0.png"), self.rendered({**SMALL, "background": [0, 1, 0]}))
        self.assertEqual(self.bytes_of("swept-10.png"), self.rendered({**SMALL, "background": [0, 0, 10 / 11]}))

    def test_a_sheet_and_a_turntable_are_one_file(self):
        swept = {"scene": SMALL, "sweep": {"/background": [0.1, 0.2, 0.3]}}
        self.write({"name": "all", **swept, "sheet": {"columns": 3, "labels": False}},
                   {"scene": {**SMALL, "output": {"format": "jpeg"}}, "sheet": {}},
                   {"name": "around", "scene": SMALL, "turntable": {"frames": 3}},
                   {"name": "round", "scene": SMALL, "turntable": {"frames": 3, "format": "apng"}})
        done = self.batch()
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        self.assertEqual(self.made(), ["000002.jpeg", "all.png", "around.webp", "round.png"])
        self.assertIn(b"acTL", self.bytes_of("round.png"))
        self.assertIn(b"ANIM", self.bytes_of("around.webp"))
        self.write({"scene": SMALL, "variants": [{}, {"camera": {"fov": 900}}], "sheet": {}})
        done = self.batch()
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"/variants/1", done.stderr)

    def test_outputs_become_a_folder(self):
        self.write({"name": "both", "scene": {**SMALL, "outputs": [{"name": "a"}, {"name": "b", "format": "jpeg"}]}})
        self.assertEqual(self.batch().returncode, 0)
        self.assertEqual(self.made(), ["both/a.png", "both/b.jpeg"])

    def test_shards_have_each_line_once(self):
        self.write(*({**SMALL, "background": [i / 20, 0, 0]} for i in range(20)))
        found = []
        for shard in range(3):
            self.assertEqual(self.batch("--shard", f"{shard}/3").returncode, 0)
            found.append(set(self.made()).difference(*found))
        self.assertEqual([len(part) for part in found], [7, 7, 6])
        self.assertEqual(found[1], {f"{line:06}.png" for line in range(2, 21, 3)})

    def test_a_line_that_fails_is_told_and_others_are_made(self):
        self.write(SMALL, '{"image": ', {**SMALL, "lights": [{"type": "pont"}]},
                   {"name": "../up", "scene": SMALL}, {"name": "a/b", "scene": SMALL}, {"name": "twice", "scene": SMALL},
                   {"name": "twice", "scene": RED}, {"name": "", "scene": SMALL, "sweep": {"/objects/7/radius": [1]}},
                   {"name": "some", "scene": SMALL, "variants": [{"image": {"width": 0}}, {}]}, "[]", RED)
        done = self.batch("--threads", "1")
        self.assert_fails(done, 1, "list.jsonl:2:10: ", "list.jsonl:3: /lights/0/type: ",
                          "list.jsonl:4: /name: ", "list.jsonl:5: /name: ", "list.jsonl:7: /name: another",
                          "list.jsonl:8: /sweep: ", "list.jsonl:9: /image/width: ", "list.jsonl:10: ",
                          "shade: 4 pictures were made, and 8 failed")
        self.assertEqual(self.made(), ["000001.png", "000011.png", "some-1.png", "twice.png"])
        self.assertEqual(self.bytes_of("twice.png"), self.rendered(SMALL))
        self.assertEqual([path.name for path in self.folder.parent.glob("up*")], [])

    def test_what_is_there_is_left_alone_if_asked(self):
        self.write(SMALL, RED)
        (self.folder / "out").mkdir()
        (self.folder / "out/000001.png").write_bytes(b"kept")
        self.assertEqual(self.batch("--resume").returncode, 0)
        self.assertEqual((self.bytes_of("000001.png"), self.bytes_of("000002.png")), (b"kept", self.rendered(RED)))
        self.assertEqual(self.batch().returncode, 0)
        self.assertEqual(self.bytes_of("000001.png"), self.rendered(SMALL))

    def test_lines_come_through_a_pipe(self):
        done = self.batch(path="-", input=json.dumps(SMALL).encode() + b"\r\n{")
        self.assert_fails(done, 1, "stdin:2:1: ")
        self.assertEqual(self.made(), ["000001.png"])

    def test_any_number_of_threads_makes_the_same(self):
        self.write(*({**SMALL, "background": [i / 40, 0, 0]} for i in range(40)))
        seen = []
        for threads in "1", "7":
            self.assertEqual(self.batch("--threads", threads).returncode, 0)
            seen.append([self.bytes_of(name) for name in self.made()])
        self.assertEqual(len(seen[0]), 40)
        self.assertEqual(*seen)

    def test_the_command_line(self):
        self.write(SMALL)
        for arguments, words in ((["--shard", "3/3"], "'3/3'"), (["--shard", "-1/3"], "'-1/3'"), (["--shard", "1"], "'1'"),
                                 (["--shard", "0/0"], "'0/0'"), (["other.jsonl"], "one file"), (["--json"], "explain")):
            self.assert_fails(self.batch(*arguments), 2, words)
        self.assert_fails(self.shade("batch", "list.jsonl"), 2, "-o FOLDER")
        self.assert_fails(self.shade("render", "list.jsonl", "-o", "x.png", "--resume"), 2, "are for batch")
        self.assert_fails(self.batch(path="nowhere.jsonl"), 1, "nowhere.jsonl")
        (self.folder / "list").write_text("")
        self.assert_fails(self.shade("batch", "list.jsonl", "-o", "list"), 1, "list")

    def test_an_empty_file_makes_nothing(self):
        self.write("", " ")
        self.assertEqual(self.batch().returncode, 0)
        self.assertEqual(self.made(), [])

    def test_an_interrupt_ends_it_and_leaves_whole_pictures(self):
        self.write(SMALL, *itertools.repeat(LONG, 8))
        process = subprocess.Popen([SHADE, "batch", "list.jsonl", "-o", "out", "--threads", "2"], cwd=self.folder,
                                   stderr=subprocess.PIPE)
        while not (self.folder / "out/000001.png").exists():
            self.assertIsNone(process.poll())
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        _, told = process.communicate(timeout=500)
        self.assertEqual((process.returncode, told), (-signal.SIGTERM, b""))
        self.assertEqual(self.made(), ["000001.png"])


if __name__ == "__main__":
    unittest.main()
