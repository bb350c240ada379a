"""Starts the programs that measure, on the cores that they may use, and reads what they print."""

import json
import os
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("SHADED_BUILD", SOURCE / "build"))
WORK = BUILD / "measured"
CORES = sorted(os.sched_getaffinity(0))
FIRST, LAST = CORES[0], CORES[-1]  # what is measured runs on the first one


def pinned(command, core=FIRST):
    return ["taskset", "-c", str(core), *map(str, command)]


def clean_environment(**more):
    kept = {name: value for name, value in os.environ.items() if not name.startswith("SHADED_")}
    return {**kept, **more}


def run(command, **options):
    done = subprocess.run(list(map(str, command)), capture_output=True, check=False,
                          env=clean_environment(**options.pop("env", {})), **options)
    if done.returncode:
        sys.exit(f"bench: {command[0]} exits {done.returncode}:\n{done.stderr.decode()[-2000:]}")
    return done


def run_jobs(command, jobs):
    lines = "".join(json.dumps(job) + "\n" for job in jobs)
    return json.loads(run(command, input=lines.encode()).stdout)


def library(jobs, rounds, core=FIRST, warm=0):
    """Samples of each job in the library, on one core or (None) on all; without those of the first
    `warm` rounds, in which what is kept between requests grows to its cap."""
    command = [BUILD / "tests/bench_library", rounds + warm]
    return later(run_jobs(command if core is None else pinned(command, core), jobs), warm)


def later(found, warm):
    return [{name: values[warm:] if is_samples(values) else values
             for name, values in samples.items()} for samples in found]


def refused(job):
    """Whether the library cannot do a job here."""
    done = subprocess.run([BUILD / "tests/bench_library", "1"], input=json.dumps(job).encode(),
                          capture_output=True, check=False, env=clean_environment())
    return done.returncode != 0


class Daemon:
    """`shaded` with one rendering thread, or more, pinned with all its threads to one core, or (None) to none."""

    def __init__(self, core=FIRST, threads=1):
        command = [BUILD / "shaded", "--threads", threads, "--listen", "127.0.0.1:0", "--admin", "off",
                   "--log-requests", "off", "--response-cache", "0"]
        command = [str(word) for word in command] if core is None else pinned(command, core)
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True,
                                        env=clean_environment())
        for line in self.process.stderr:
            event = json.loads(line)
            if event["event"] == "listening":
                self.address, self.port = event["address"].rsplit(":", 1)
                return
        sys.exit("bench: the daemon does not start")

    def requests(self, jobs, rounds, core=LAST, warm=0):
        command = [BUILD / "tests/bench_client", self.address, self.port, rounds + warm]
        return later(run_jobs(pinned(command, core), jobs), warm)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.communicate()


def process_seconds(command, **options):
    """Wall seconds of a process from its start to its end, and the process."""
    began = time.perf_counter()
    done = run(pinned(command), **options)
    return time.perf_counter() - began, done


# ---- Samples ----

STAGES = ("parse", "plan", "visibility", "shade", "color", "encode")
# Figures that are all of a request but for these stages: what no stage counts, the memory for one,
# is in them. "seen" is cast + shade + sRGB codes.
LEFT_OUT = {"seen": ("parse", "plan", "encode"), "before_encoding": ("encode",),
            "rest": STAGES}


def least(samples):
    """Lists of seconds -> the least of each in ms, which others on the machine change least."""
    return {name: rounded(1e3 * min(values)) for name, values in samples.items()
            if is_samples(values)}


def medians(samples):
    """Lists of seconds -> medians in ms, and what LEFT_OUT has; other values stay."""
    result = {name: rounded(1e3 * statistics.median(values)) if is_samples(values) else values
              for name, values in samples.items()}
    if "shade" in result and "cpu" in result:
        for name, left_out in LEFT_OUT.items():
            result[name] = rounded(1e3 * statistics.median(rest(samples, left_out)))
    return result


def rest(samples, stages):
    """Processor time of the whole request without some stages, run by run."""
    return [whole - sum(parts) for whole, *parts in
            zip(samples["cpu"], *(samples[name] for name in stages))]


def rounded(value):
    return float(f"{value:.4g}")


def is_samples(values):
    return isinstance(values, list) and values and isinstance(values[0], float)


def spread(values):
    """Quartiles in ms of a list of seconds."""
    quarters = statistics.quantiles(values, n=4, method="inclusive") if len(values) > 1 \
        else values * 3
    return [rounded(1e3 * q) for q in quarters]


def merged(runs):
    """Samples of several runs of the same jobs, as if of one: [run][job] -> [job]."""
    result = []
    for pieces in zip(*runs):
        joined = dict(pieces[-1])
        for name, values in joined.items():
            if is_samples(values):
                joined[name] = [v for piece in pieces for v in piece[name]]
        result.append(joined)
    return result


# ---- The machine ----

def first_line(command, pattern):
    try:
        done = subprocess.run(command, capture_output=True, check=False, timeout=60)
    except OSError:
        return None
    match = re.search(pattern, (done.stdout + done.stderr).decode(errors="replace"))
    return match.group(1) if match else None


def machine():
    """What figures depend on; no names of hosts or people."""
    cpu = Path("/proc/cpuinfo").read_text()
    model = re.search(r"model name\s*: (.*)", cpu)
    flags = re.search(r"flags\s*: (.*)", cpu)
    caches = {}
    for folder in Path("/sys/devices/system/cpu/cpu0/cache").glob("index*"):
        kind, level, size = ((folder / name).read_text().strip()
                             for name in ("type", "level", "size"))
        if kind != "Instruction":
            caches[f"L{level}"] = size
    release = Path("/etc/os-release").read_text()
    return {
        "processor": model.group(1) if model else "unknown", "cores": len(CORES),
        "vectors": [f for f in ("avx2", "avx512f") if flags and f in flags.group(1).split()],
        "caches": dict(sorted(caches.items())),
        "memory": f"{os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 2**30:.0f} GiB",
        "system": re.search(r'PRETTY_NAME="(.*)"', release).group(1),
        "compiler": first_line(["cc", "--version"], r"(.*)\n"),
        "shaded": first_line([BUILD / "shade", "--version"], r"shade (.*)\n"),
        "povray": first_line(["povray", "--version"], r"POV-Ray (\S+)"),
    }
