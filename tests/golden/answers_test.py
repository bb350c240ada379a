"""Pictures, plans and bounds are those of answers.json, which `./dev answers` writes.

What a picture must be is held by closed_form_test.py and reference_test.py, and that bounds hold, by
property.bounds and property.attack. Here is what they leave open: that a bound is no looser than it
was, what is told of costs and of errors, codes. Where a change is wanted, `./dev answers` takes
it, and the difference of answers.json shows it: one document a line.
"""

import hashlib
import json
import os
import re
import sys
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

SOURCE = Path(os.environ["SHADED_SOURCE"])
sys.path[:0] = [str(SOURCE / "tests"), str(SOURCE / "tests" / "same")]
from e2e.daemon import Daemon  # noqa: E402
from reference import program  # noqa: E402
import answers  # noqa: E402
import scenes  # noqa: E402

KEPT = SOURCE / "tests" / "golden" / "answers.json"
MOST_TOLD = 12
# Relative to what is told. Sine, power and exponential are another machine's last digit; what is
# measured between two tiers consists of last digits.
TOLD, MEASURED = 1e-5, 1e-3
CODES = 3  # of a whole picture
ROUNDING = 1e-7  # of a sum of floats


def shape_and_numbers(value, numbers):
    """All that is said but its fractions, which go to the list; text without its figures."""
    if isinstance(value, dict):
        return {k: shape_and_numbers(v, numbers) for k, v in sorted(value.items())}
    if isinstance(value, list):
        return [shape_and_numbers(v, numbers) for v in value]
    if isinstance(value, float):
        numbers.append(float(f"{value:.6g}"))
        return 0
    return re.sub(r"[0-9.e+-]+", "#", value) if isinstance(value, str) else value


def spoken(value):
    numbers = []
    shape = json.dumps(shape_and_numbers(value, numbers)).encode()
    return [hashlib.sha256(shape).hexdigest()[:8], *numbers]


def sums(answer):
    """Of a picture: the sum of each channel by weights, and what a difference is held against."""
    kind = answer.headers["Content-Type"].split("/")[1]
    samples, names = program.read(answer.body, {"x-exr": "exr"}.get(kind, kind))
    flat = samples.reshape(-1, samples.shape[-1])
    flat = np.where(np.abs(flat) < 1e30, flat, 0)  # depth, where nothing is seen
    weights = (np.arange(len(flat)) * 2654435761 % 2 ** 32 / 2 ** 32 + 0.5)[:, None]
    scale = 0 if kind == "png" else np.abs(flat).sum()
    return [float(f"{v:.10g}") for v in [*(flat * weights).sum(0), scale]]


def answered(daemon, number, document):
    """{what was asked: figures}"""
    out = {}

    def ask(what, path, scene, figures):
        answer = daemon.post(path, scene)
        if answer.status == 200:
            out[what] = figures(answer)
        else:
            out[what] = spoken([answer.status, json.loads(answer.body).get("errors")])
        return answer

    for tier in ("standard", "exact"):
        ask(tier, "/v1/render", {**document, "accuracy": {"tier": tier}}, sums)
    picture = ask("picture", "/v1/render", document, sums)
    out["plan"] = picture.headers.get("Shaded-Plan")
    out["warnings"] = picture.headers.get_all("Shaded-Warning", [])
    ask("explain", "/v1/explain", document, lambda a: spoken(json.loads(a.body)))
    if number % 6 == 0:
        ask("compare", "/v1/compare", document,
            lambda a: spoken(answers.without_times(json.loads(a.body))))
    return out


def differences(what, new, old):
    """(figure, as kept) where they differ."""
    if not isinstance(new, list) or not isinstance(old, list) or len(new) != len(old):
        return [(new, old)] if new != old else []

    def near(a, b):
        if not isinstance(a, float) or not isinstance(b, float):
            return a == b
        if isinstance(old[0], str):  # spoken
            return abs(a - b) <= (MEASURED if what == "compare" else TOLD) * abs(b) + 1e-12
        return abs(a - b) <= (ROUNDING * old[-1] or CODES)

    return [(a, b) for a, b in zip(new, old) if not near(a, b)]


def what_there_is(daemon):
    """{path: figures} of what is asked for by GET."""
    out = {path: spoken(json.loads(daemon.get(path).body))
           for path in ("/v1/materials", "/v1/shapes", "/v1/colorspaces")}
    for shape in json.loads(daemon.get("/v1/shapes").body)["shapes"]:
        path = f"/v1/preview/brass?size=24&shape={shape['type']}"
        answer = daemon.get(path)
        out[path] = sums(answer) if answer.status == 200 else spoken([answer.status])
    return out


def all_answers():
    """(name, figures), in the order of scenes.py."""
    with Daemon("--kernel", "portable", *answers.OPTIONS) as daemon, \
            ThreadPoolExecutor(2) as clients:
        documents = [(n, *pair) for n, pair in enumerate(scenes.good()) if "outputs" not in pair[1]]
        yield "what there is", what_there_is(daemon)
        yield from clients.map(lambda d: (d[1], answered(daemon, d[0], d[2])), documents)


class Answers(unittest.TestCase):
    def test_answers_are_those_that_are_kept(self):
        kept, told = json.loads(KEPT.read_text()), []
        seen = set()
        for name, figures in all_answers():
            seen.add(name)
            old = kept.get(name, {})
            for what in sorted({*figures, *old}):
                pairs = differences(what, figures.get(what), old.get(what))
                told += [f"{name}: {what}: {new}, kept: {was}" for new, was in pairs]
            if len(told) >= MOST_TOLD:
                break
        else:
            self.assertEqual(seen, set(kept))
        if told:
            self.fail("These differ; `./dev answers` keeps what is so now:\n" +
                      "\n".join(told[:MOST_TOLD]))


def write():
    lines = [f"{json.dumps(name)}: {json.dumps(figures)}" for name, figures in all_answers()]
    KEPT.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        write()
    else:
        unittest.main()
