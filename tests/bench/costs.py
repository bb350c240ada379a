"""What `shade explain` estimates beside what is measured, in milliseconds of one core: python3
tests/bench/costs.py [NAME...], where `./dev bench` has built the programs; a NAME is the beginning
of a scene's, and without any all are measured. src/plan/cost.c and src/render/tell/cost.c have their
constants from here."""

import itertools
import json
import random
import statistics
import sys

import measure
import programs
import scenes

EXAMPLES = sorted((programs.SOURCE / "api/examples").glob("*.json"))
SHAPES = ("sphere", "box", "cylinder", "cone", "torus", "disc", "plane")


def one(shape, **more):
    turned = {"transform": {"rotate": [40, 20, 0]}}
    return {"type": shape, "material": scenes.MATERIAL, **turned, **more}


def crowd(count, shape, **sizes):
    place = random.Random(3)
    return [one(shape, **sizes, transform={
        "rotate": [place.uniform(0, 180) for _ in range(3)],
        "translate": [place.uniform(-1, 1) for _ in range(3)]}) for _ in range(count)]


def documents():
    for path in EXAMPLES:
        document = json.loads(path.read_text())
        if "outputs" not in document and "layers" not in document.get("output", {}):
            yield path.stem, document
    plain = scenes.plain(scenes.scene(scenes.lights(4, scenes.FADING)))
    for count in (1, 16, 256):
        yield f"{count} lights", {**plain, "lights": scenes.lights(count, scenes.FADING)}
    for shape in SHAPES:
        yield shape, {**plain, "objects": [one(shape)]}
    for shape in ("sphere", "torus"):
        for interpolation in ("flat", "gouraud"):
            yield f"{interpolation} {shape}", {
                **plain, "objects": [one(shape, interpolation=interpolation)]}
    yield "needle", {**plain, "objects": [one("cylinder", radius=0.02, height=2)]}
    yield "plate", {**plain, "objects": [one("box", size=[2, 0.01, 2])]}
    for count, radius in ((200, 0.2), (2000, 0.06)):
        yield f"{count} spheres", {**plain, "objects": crowd(count, "sphere", radius=radius)}
    small = {**plain, "image": {"width": 128, "height": 128, "samples": 16}}
    for count, radius in ((1, 0.8), (1000, 0.01), (1000, 0.05)):
        yield f"{count} spheres of {radius}, 16 samples", {
            **small, "objects": crowd(count, "sphere", radius=radius)}
    for shape in ("cylinder", "cone"):
        yield f"100 needles: {shape}", {
            **small, "objects": crowd(100, shape, radius=0.005, height=1.5)}
    yield "50 rings", {**small, "objects": crowd(50, "torus", radius=0.2, tube=0.02)}


def estimate(document, kernel):
    told = programs.run([programs.BUILD / "shade", "explain", "-", "--kernel", kernel],
                        input=json.dumps(document).encode())
    return json.loads(told.stdout)["milliseconds"]


def main():
    factors = []
    print("| scene | kernel | tier | visibility: estimated | measured | shade: estimated "
          "| measured |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    wanted = tuple(sys.argv[1:]) or ""
    for name, document in documents():
        if not name.startswith(wanted):
            continue
        for kernel, tier in itertools.product(measure.kernels(), ("standard", "exact")):
            document = {**document, "accuracy": {"tier": tier}}
            job = {"text": json.dumps(document), "keep": False, "kernel": kernel}
            measured = programs.medians(programs.library([job], 5, warm=1)[0])
            told = estimate(document, kernel)
            print(f"| {name} | {kernel} | {tier} | {told['visibility']:.3g} "
                  f"| {measured['visibility']:.3g} | {told['shade']:.3g} "
                  f"| {measured['shade']:.3g} |", flush=True)
            factors.append((told["visibility"] + told["shade"])
                           / (measured["visibility"] + measured["shade"]))
    apart = sorted(max(f, 1 / f) for f in factors)
    within = sum(factor <= 2 for factor in apart) / len(apart)
    print(f"\nBoth together are {statistics.median(factors):.2g} times what is measured in the "
          f"median, within a factor of 2 in {within:.0%}, and {apart[-1]:.2g} apart at most.")


if __name__ == "__main__":
    main()
