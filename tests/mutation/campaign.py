#!/usr/bin/env python3
"""Small mistakes, made on purpose: does a test notice each of them?

    tests/mutation/campaign.py [--count N] [--only REGEX] [--tests REGEX] [--most SECONDS] [--again]
                               [--report]

Of all places that points.py finds in the rooms below, N (320) are taken, spread over the files, the
same ones in every run. All of them are compiled into one copy of the sources in build/mutation;
a variable of the environment says which of them a program makes. First the tests run without a
mistake and note which of the places they pass. Then each mutant runs against the tests that pass
its place, quick ones first, up to the first that fails. What all of them let through survives.

Results stay in build/mutation/results.jsonl, so that a run goes on where one ended. Survivors must
be in tests/mutation/survivors.txt with the reason why they change no picture, bound or answer:
others end the run with exit status 1.
"""

import argparse
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import points  # noqa: E402

SOURCE = Path(os.environ.get("SHADED_SOURCE", Path(__file__).resolve().parents[2]))
FOLDER = SOURCE / "build" / "mutation"
COPY, BUILD = FOLDER / "source", FOLDER / "build"
RESULTS, SEEN = FOLDER / "results.jsonl", FOLDER / "seen"
REASONS = Path(__file__).with_name("survivors.txt")
ROOMS = {"plan": 3, "bound": 4, "sight": 5, "shade": 4, "color": 3, "render": 6, "server": 4}  # shares

# C programs are found by their names; these are too slow for what they add, or not about a picture,
# a bound or an answer.
LEFT_OUT = re.compile(r"(unit_base_|unit_image_jpeg)")
SCRIPTS = ["golden/answers_test.py", "golden/closed_form_test.py", "golden/reference_test.py", "golden/colors_test.py",
           "conformance/schema_test.py", "property/compare_test.py", "e2e/explain_test.py",
           "e2e/compare_test.py", "e2e/render_test.py", "e2e/http_test.py", "e2e/malformed_test.py",
           "e2e/cache_test.py", "e2e/access_test.py", "e2e/preview_test.py",
           "e2e/daemon_test.py", "e2e/formats_test.py", "e2e/queue_test.py",
           "e2e/load_test.py", "e2e/slow_test.py"]
SERVER_ONLY = re.compile(r"e2e/(http|malformed|cache|access|preview|daemon|queue|load|slow)_test")
# What could notice a mistake in each room. Of these the tests that pass its place run, but kernels
# do not note what is passed: for them all.
ROOM_TESTS = {
    "plan": "unit_(plan|describe|shade)|property_|answers_test|reference_test|explain_test|"
            "compare_test|attack",
    "bound": "unit_(plan|describe|shade)|property_|answers_test|reference_test|explain_test|"
             "compare_test|attack",
    "sight": "unit_sight|property_|answers_test|reference_test|closed_form|formats_test|attack",
    "shade": "unit_shade|property_|answers_test|reference_test|closed_form|attack",
    "color": "unit_(color|plan)|golden_|property_co|colors_test|formats_test|render_test",
    "render": "unit_(plan|describe)|property_|reference_test|closed_form|_test[.]py|attack",
    "server": "unit_server|e2e/"}
FAILED = re.compile(rb"\[  FAILED  \]|^(FAIL|ERROR): |^--seed ", re.M)

HEADER = """
#ifndef SHD_MUTANT
#define SHD_MUTANT
extern int shd_mutant_number;
extern unsigned char shd_mutant_seen[];
#ifdef SHD_ISA /* noting what is passed would keep loops from being vectors */
#define shd_mutant(n) (shd_mutant_number == (n))
#else
#define shd_mutant(n) (shd_mutant_seen[n] = 1, shd_mutant_number == (n))
#endif
#endif
"""
MAIN = """
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
int shd_mutant_number = -1;
unsigned char shd_mutant_seen[100000];
static void note(void) {
    const char *folder = getenv("MUTANT_SEEN");
    char name[4096];
    if (!folder) return;
    snprintf(name, sizeof name, "%s/%d", folder, (int)getpid());
    FILE *out = fopen(name, "w");
    for (int i = 0; out && i < 100000; i++)
        if (shd_mutant_seen[i]) fprintf(out, "%d\\n", i);
    if (out) fclose(out);
}
__attribute__((constructor)) static void begin(void) {
    const char *number = getenv("MUTANT");
    if (number) shd_mutant_number = atoi(number);
    atexit(note);
}
"""


def say(*words):
    print(time.strftime("%H:%M:%S"), *words, flush=True)


# ---- Mutants. ----

def choose(count):
    """`count` mutants, spread over the rooms by their shares and over each room's files evenly."""
    texts = {p: p.read_text() for p in sorted((SOURCE / "src").rglob("*.[ch]"))}
    margins = points.margins_of(texts.values())
    chosen = []
    for room, share in ROOMS.items():
        queues = []
        for path, text in texts.items():
            file = path.relative_to(SOURCE / "src")
            if file.parts[0] == room:
                found = points.mutants_of(file.as_posix(), text, margins)
                queues.append(sorted(found, key=lambda m: m.rank))
        wanted, depth = round(count * share / sum(ROOMS.values())), 0
        taken = []
        while len(taken) < wanted and any(depth < len(q) for q in queues):
            # A long file has more turns than a short one.
            for queue in queues:
                turns = 1 + len(queue) // 150
                taken += queue[depth * turns:(depth + 1) * turns]
            depth += 1
        chosen += sorted(taken, key=lambda m: m.rank)[:wanted]
    for number, mutant in enumerate(chosen):
        mutant.number = number
    return chosen


# ---- The build. ----

def run(*command, **more):
    return subprocess.run(command, check=True, **more)


def write_sources(mutants):
    (COPY / "src/base/mutant.c").write_text(MAIN)
    (FOLDER / "mutant.h").write_text(HEADER)
    by_file = {}
    for mutant in mutants:
        by_file.setdefault(mutant.file, []).append(mutant)
    for path in sorted((SOURCE / "src").rglob("*.[ch]")):
        file = path.relative_to(SOURCE / "src").as_posix()
        text = points.rewritten(path.read_text(), by_file.get(file, []))
        target = COPY / "src" / file
        if not target.exists() or target.read_text() != text:
            target.write_text(text)


def drop_those_that_do_not_compile(mutants):
    """Compilers name lines; mutants on them go."""
    while True:
        write_sources(mutants)
        out = subprocess.run(["cmake", "--build", str(BUILD), "--", "-k", "0", "-j", "2"],
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                             check=False)
        if out.returncode == 0:
            return mutants
        bad = set(re.findall(r"/src/([\w/]+/[\w.]+):(\d+):\d+: error", out.stdout))
        bad = {(file, int(line)) for file, line in bad}
        kept = [m for m in mutants if not any((m.file, line) in bad
                                              for line in range(m.lines[0], m.lines[1] + 1))]
        if len(kept) == len(mutants):
            raise SystemExit(out.stdout[-8000:])
        say(f"{len(mutants) - len(kept)} mutants do not compile")
        mutants = kept


def build(mutants):
    if not (BUILD / "build.ninja").exists():
        shutil.rmtree(COPY, ignore_errors=True)
        shutil.copytree(SOURCE, COPY, ignore=shutil.ignore_patterns("build", ".git"))
        write_sources(mutants)
        run("cmake", "-S", str(COPY), "-B", str(BUILD), "-G", "Ninja", "-DBUILD_TESTING=ON",
            "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_C_FLAGS=-w -include {FOLDER}/mutant.h",
            "-DCMAKE_CXX_FLAGS=-w", "--log-level=WARNING", stdout=subprocess.DEVNULL)
    return drop_those_that_do_not_compile(mutants)


# ---- Tests. ----

def tests():
    programs = sorted(p for layer in ("unit", "property", "golden")
                      for p in (BUILD / "tests").glob(f"{layer}_*") if p.is_file())
    named = {p.name: [str(p)] for p in programs if not LEFT_OUT.search(p.name)}
    for script in SCRIPTS:
        if (COPY / "tests" / script).exists():
            named[script] = ["/usr/bin/python3", "-B", str(COPY / "tests" / script), "-f"]
    named["attack"] = [str(BUILD / "tests/attack"), "--rounds", "6", "--threads", "1",
                       "--folder", str(FOLDER / "attack")]
    return named


def run_test(command, seconds, **more):
    """Whether it passes; it is stopped where its first claim fails. And the seconds of processor."""
    env = {**os.environ, "SHADED_BUILD": str(BUILD), "SHADED_SOURCE": str(COPY),
           "SHADED_SANITIZE": "", "PYTHONPATH": str(COPY / "tests"), **more}

    def limit():
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=env,
                               cwd=COPY, preexec_fn=limit)
    timer = threading.Timer(20 * seconds + 30, os.killpg, (process.pid, signal.SIGKILL))
    timer.start()
    passed, tail = True, b""
    for line in process.stdout:
        tail = (tail + line)[-2000:]
        if FAILED.search(line):
            passed = False
            break
    if not passed:
        os.killpg(process.pid, signal.SIGKILL)
    passed = process.wait() in (0, 77) and passed
    timer.cancel()
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return passed, used, tail


def survey(named):
    """What each test takes and passes, without a mistake."""
    known_file = FOLDER / "tests.json"
    known = json.loads(known_file.read_text()) if known_file.exists() else {}
    for name, command in named.items():
        if name in known:
            continue
        folder = SEEN / name.replace("/", "_")
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        passed, used, tail = run_test(command, 600, MUTANT_SEEN=str(folder))
        if not passed:
            say(f"{name} fails without a mutant, and is left out:\n{tail.decode(errors='replace')}")
        numbers = {int(n) for f in folder.iterdir() for n in f.read_text().split()}
        known[name] = {"passes": passed, "seconds": used, "seen": sorted(numbers)}
        known_file.write_text(json.dumps(known))
        say(f"{name}: {used:.1f} s, {len(numbers)} places")
    return {n: {**k, "seen": set(k["seen"])} for n, k in known.items()
            if k["passes"] and n in named}


def notice(mutant, named, known, most):
    """The test that notices it; None: none. And how many were tried."""
    room = mutant.file.split("/")[0]
    # Kernels include their rooms' headers.
    kernel = mutant.file.endswith(".simd.c") or mutant.file.endswith(".h") and room != "server"
    tried = 0
    for name in sorted(known, key=lambda n: known[n]["seconds"]):
        info = known[name]
        if info["seconds"] > (3 * most if room == "server" else most):
            continue
        if not kernel and mutant.number not in info["seen"]:
            continue
        if not re.search(ROOM_TESTS[room], name):
            continue
        if SERVER_ONLY.search(name) and room != "server":
            continue
        tried += 1
        if not run_test(named[name], 3 * info["seconds"] + 5, MUTANT=str(mutant.number))[0]:
            return name, tried
    return None, tried


# ---- The report. ----

def reasons():
    """{name of a mutant: why it may survive}"""
    known, why = {}, None
    for line in REASONS.read_text().splitlines() if REASONS.exists() else []:
        if line.startswith("# ") or not line.strip():
            continue
        if line.startswith("    "):
            known[line.strip()] = why
        else:
            why = line.strip()
    return known


def results():
    lines = RESULTS.read_text().splitlines() if RESULTS.exists() else []
    return {r["name"]: r for r in map(json.loads, lines)}


def report(mutants):
    done, known = results(), reasons()
    ran = [done[m.name] for m in mutants if m.name in done]
    left = [r for r in ran if not r["noticed"]]
    say(f"{len(ran)} mutants ran, {len(ran) - len(left)} were noticed, {len(left)} were not;",
        f"of these {sum(r['name'] in known for r in left)} have a reason")
    for r in left:
        if r["name"] not in known:
            print(f"    {r['name']}{'' if r['tried'] else '   (no test passes there)'}")
    return all(r["name"] in known for r in left)


def main():
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--count", type=int, default=320)
    options.add_argument("--only", default="", help="mutants whose name matches this")
    options.add_argument("--most", type=float, default=1e9, help="seconds of the slowest test")
    options.add_argument("--tests", default="", help="only tests whose names match this")
    options.add_argument("--again", action="store_true", help="also those that ran, and survived")
    options.add_argument("--report", action="store_true", help="only tell what is known")
    options = options.parse_args()
    mutants = choose(options.count)
    if not options.report:
        mutants = build(mutants)
        named = {n: c for n, c in tests().items() if re.search(options.tests, n)}
        known = survey(named)
        done = results()
        for mutant in sorted(mutants, key=lambda m: m.rank):
            earlier = done.get(mutant.name)
            if not re.search(options.only, mutant.name) or mutant.name in reasons():
                continue
            if earlier and (earlier["noticed"] or not options.again):
                continue
            name, tried = notice(mutant, named, known, options.most)
            with RESULTS.open("a") as out:
                out.write(json.dumps({"name": mutant.name, "noticed": name, "tried": tried}) + "\n")
            say(f"{name or 'SURVIVES'} ({tried}): {mutant.name}")
    return 0 if report(mutants) else 1


if __name__ == "__main__":
    sys.exit(main())
