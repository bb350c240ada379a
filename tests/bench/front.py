"""Time and error of tiers and budgets for the picture that the peers draw: front.py FOLDER

As a program it measures nothing else, and puts that into this processor's file of an earlier run of
measure.py, whose peers stay as they are."""

import json
import os
import sys
from pathlib import Path

import numpy as np

import measure
import peers
import programs
import scenes
from priority import raise_priority

TIERS = ("draft", "standard", "exact")
BUDGETS = {"linear": (1e-2, 1e-3, 1e-4, 1e-5), "deltaE2000": (2, 0.5, 0.1), "code": (4, 2, 1)}


def jobs():
    """{key: job}: every tier with every kernel, and budgets with the kernel that is taken anyway."""
    def job(accuracy, **more):
        return {"text": scenes.text({**peers.DOCUMENT, "accuracy": accuracy}), "keep": False,
                **more}

    return {**{measure.key(tier=tier, kernel=kernel): job({"tier": tier}, kernel=kernel)
               for kernel in measure.kernels() for tier in TIERS},
            **{measure.key(metric=metric, most=most): job({"maxError": most, "metric": metric})
               for metric, amounts in BUDGETS.items() for most in amounts}}


def front(quick):
    """Medians, and by how many 8-bit codes pictures differ from the exact tier's: in the mean, and
    at most."""
    entries = jobs()
    result = measure.timed(entries, 5 if quick else 31)
    # The pictures themselves: all of the same radius.
    paths = [programs.WORK / f"front{number}.png" for number in range(len(entries))]
    programs.library([{**entry, "text": entry["text"].replace("@", "0"), "save": str(path)}
                      for entry, path in zip(entries.values(), paths)], 1)
    pictures = [peers.picture(path) for path in paths]
    best = max(n for n, entry in enumerate(result) if entry.get("tier") == "exact")
    for entry, picture in zip(result, pictures):
        apart = np.abs(picture - pictures[best])
        entry["codes"] = {"mean": programs.rounded(float(apart.mean())), "max": int(apart.max())}
    kept = ("tier", "kernel", "metric", "most", "plan_line", "seen", "visibility", "shade", "color",
            "codes")
    return [{name: entry[name] for name in kept if name in entry} for entry in result]


def main():
    path = Path(sys.argv[1]) / f"{measure.slug(programs.machine()['processor'])}.json"
    if not path.exists():
        sys.exit(f"bench: {path} does not exist: measure everything first")
    programs.WORK.mkdir(parents=True, exist_ok=True)
    result = json.loads(path.read_text(encoding="utf-8"))
    raise_priority()
    load = round(os.getloadavg()[0], 2)
    result["front"], result["front_load"] = front(False), load
    path.write_text(measure.dumped(result), encoding="utf-8")


if __name__ == "__main__":
    main()
