"""Measures speed and error, beside the peers: measure.py [--quick] FOLDER

Writes FOLDER/PROCESSOR.json. Times are medians; what is compared takes turns. `./dev bench` builds
what this needs, runs it, and has report.py make docs/speed-and-error.md of the results."""

import json
import os
import re
import sys
from pathlib import Path

import errors
import peers
import programs
import scenes
from priority import raise_priority

TIERS = ("standard", "exact")
KERNELS = ("portable", "avx2", "avx512")
LIGHTS = (1, 4, 16, 256)
SHININESS = (1, 10, 100, 1000, 100000)
JPEG = {"format": "jpeg", "quality": 90}
BUDGET = {"maxError": 0.5, "metric": "deltaE2000"}


def say(text):
    print(f"bench: {text}", file=sys.stderr, flush=True)


def job(document, **more):
    return {"text": scenes.text(document), **more}


def timed(jobs, rounds, core=programs.FIRST, warm=2):
    """{key: job} -> [{**key, **medians in ms}]; keys are tuples of pairs."""
    samples = programs.library(list(jobs.values()), rounds, core, warm)
    return [{**dict(pairs), **programs.medians(s)} for pairs, s in zip(jobs, samples)]


def key(**pairs):
    return tuple(pairs.items())


def kernels():
    """Those that this machine can run."""
    probe = job(scenes.scene([], size=8))
    return [name for name in KERNELS if not programs.refused({**probe, "kernel": name})]


# ---- The parts ----

def ladder(quick):
    """Time and error of every tier, kernel, number of lights and shininess."""
    shininess = SHININESS[::2] if quick else SHININESS
    times, errors = {}, {}
    for count in LIGHTS[:3] if quick else LIGHTS:
        for ns in shininess:
            material = {**scenes.MATERIAL, "shininess": ns}
            for kernel in kernels():
                for tier in TIERS:
                    document = scenes.scene(scenes.lights(count, scenes.FADING), tier=tier,
                                            material=material)
                    times[key(lights=count, shininess=ns, kernel=kernel, tier=tier)] = \
                        job(document, kernel=kernel)
                errors[key(lights=count, shininess=ns, kernel=kernel)] = \
                    job(document, kernel=kernel, compare=True)
    compared = programs.library(list(errors.values()), 1)
    found = []
    for pairs, answer in zip(errors, compared):
        for tier in answer["compare"]["tiers"]:
            found.append({**dict(pairs), "tier": tier["tier"], "bound": short(tier["bound"]),
                          "error": short(tier["error"])})
    kept = ("lights", "shininess", "kernel", "tier", "plan_line", "wall", "seen", "visibility",
            "shade", "color")
    return {"times": [{name: entry[name] for name in kept}
                      for entry in timed(times, 2 if quick else 7)], "errors": found}


def short(value):
    """With four digits."""
    if isinstance(value, dict):
        return {name: short(inner) for name, inner in value.items() if name != "relative"}
    return programs.rounded(value) if isinstance(value, float) and value < 0.99 else value


def stages(quick):
    """Where the time goes: lights, samples and formats."""
    jobs = {}
    for count in (1, 4, 16):
        for samples in (1, 4, 16):
            document = scenes.scene(scenes.lights(count, scenes.FADING), samples=samples)
            jobs[key(lights=count, samples=samples)] = job(document)
    return timed(jobs, 3 if quick else 15, warm=8)


def objects(quick):
    """What other objects take than the sphere, by kernel."""
    jobs = {key(object=name, kernel=kernel): job(document, kernel=kernel)
            for name, document in scenes.objects() for kernel in kernels()}
    return timed(jobs, 3 if quick else 15, warm=4)


def light_cost(quick):
    """What a light costs a pixel, from few to very many."""
    jobs = {}
    for count in (4, 16, 64, 256) if quick else (4, 16, 64, 256, 1024):
        for name, document in {
                "plain": scenes.scene(scenes.lights(count)),
                "attenuated": scenes.scene(scenes.lights(count, scenes.FADING)),
                "lamps": scenes.scene(scenes.lamps(count)),
                "lamps, deltaE 0.5": scenes.scene(scenes.lamps(count), accuracy=BUDGET)}.items():
            jobs[key(lights=count, scene=name)] = job(document)
    result = timed(jobs, 3 if quick else 9)
    for entry in result:
        entry["ns"] = programs.rounded(1e6 * entry["shade"] / entry["lights"] / scenes.COVERED)
    return result


def scaling(quick):
    """A large picture on one and on all cores; nothing is pinned."""
    jobs = {}
    for form in ("jpeg", "png"):
        for threads in sorted({1, len(programs.CORES)}):
            document = scenes.scene(scenes.lights(16, scenes.FADING), size=2048,
                                    output={"format": form})
            jobs[key(format=form, threads=threads)] = job(document, threads=threads)
    return timed(jobs, 3 if quick else 9, core=None)


def reuse(quick):
    """A first request, and the same one with other colors of its material."""
    jobs = {}
    for count, samples in ((4, 1), (16, 4)):
        for name, material in (("first", scenes.MATERIAL), ("repainted", scenes.REPAINTED)):
            document = scenes.scene(scenes.lights(count, scenes.FADING), samples=samples,
                                    material=material, output=JPEG)
            jobs[key(lights=count, samples=samples, request=name)] = \
                job(document, again=name == "repainted")
    return timed(jobs, 5 if quick else 21, warm=30)


BUDGETS = {"linear": (1e-2, 1e-3, 1e-4, 1e-5), "deltaE2000": (2, 1, 0.5, 0.1), "code": (2, 1)}


def budgets(quick):
    """What error budgets save, and what is left of them: 64 lamps, 4 samples."""
    jobs = {}
    for metric, amounts in BUDGETS.items():
        form = {"format": "exr", "bitDepth": "float", "colorSpace": "lin_rec709"} \
            if metric == "linear" else {"format": "png", "bitDepth": 8 if metric == "code" else 16}
        for most in (0, *amounts):
            accuracy = {"maxError": most, "metric": metric} if most else {"tier": "exact"}
            entry = job(scenes.scene(scenes.lamps(64), samples=4, accuracy=accuracy, output=form))
            if not programs.refused(entry):
                jobs[key(metric=metric, most=most)] = entry
    result = timed(jobs, 2 if quick else 7)
    # The pictures themselves: all of the same radius.
    for number, entry in enumerate(jobs.values()):
        entry.update(text=entry["text"].replace("@", "0"), save=str(programs.WORK / f"b{number}"))
    programs.library(list(jobs.values()), 1)
    for number, entry in enumerate(result):
        if not entry["most"]:
            exact = number
        entry["error"] = short(errors.between(*(programs.WORK / f"b{n}" for n in (exact, number)),
                                              entry["metric"]))
    return result


def main():
    quick = "--quick" in sys.argv
    folder = Path(sys.argv[-1])
    folder.mkdir(parents=True, exist_ok=True)
    programs.WORK.mkdir(parents=True, exist_ok=True)
    result = {"machine": programs.machine(), "quick": quick, "priority": raise_priority(),
              "kernels": kernels(),
              "load": [round(os.getloadavg()[0], 2)], "covered": round(scenes.COVERED)}
    say("peers")
    result["peers"], result["differences"], result["about"] = \
        peers.measure(*((2, 5) if quick else (7, 15)))
    from front import front  # which needs this module
    for part in (stages, objects, reuse, scaling, light_cost, budgets, front, ladder):
        say(part.__name__)
        result[part.__name__] = part(quick)
    result["load"].append(round(os.getloadavg()[0], 2))
    name = f"{slug(result['machine']['processor'])}.json"
    (folder / name).write_text(dumped(result), encoding="utf-8")


def slug(processor):
    """intel-xeon-processor of "Intel(R) Xeon(R) Processor"."""
    words = re.sub(r"\((R|TM)\)|@.*", " ", processor).lower()
    return re.sub(r"[^a-z0-9]+", "-", words).strip("-")


def dumped(result):
    """A line for each measurement: small, and good to compare."""
    parts = []
    for name, value in result.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            lines = ",\n  ".join(json.dumps(entry) for entry in value)
            parts.append(f'"{name}": [\n  {lines}\n ]')
        elif isinstance(value, dict):
            inner = ",\n  ".join(
                f'"{k}": ' + ("[\n   " + ",\n   ".join(map(json.dumps, v)) + "\n  ]"
                              if isinstance(v, list) and v and isinstance(v[0], dict)
                              else json.dumps(v)) for k, v in value.items())
            parts.append(f'"{name}": {{\n  {inner}\n }}')
        else:
            parts.append(f'"{name}": {json.dumps(value)}')
    return "{\n " + ",\n ".join(parts) + "\n}\n"


if __name__ == "__main__":
    main()
