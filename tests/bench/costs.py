"""What `shade explain` estimates beside what is measured, in milliseconds of one core: python3
tests/bench/costs.py, where `./dev bench` has built the programs. src/render/cost.c has its
constants from here."""

import json
import random
import statistics

import programs
import scenes

EXAMPLES = sorted((programs.SOURCE / "api/examples").glob("*.json"))
SHAPES = ("sphere", "box", "cylinder", "cone", "torus", "disc", "plane")


def one(shape, **more):
    turned = {"transform": {"rotate": [40, 20, 0]}}
    return {"type": shape, "material": scenes.MATERIAL, **turned, **more}


def crowd(count, radius):
    place = random.Random(3)
    return [one("sphere", radius=radius, transform={
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
        yield f"{count} spheres", {**plain, "objects": crowd(count, radius)}


def estimate(document):
    told = programs.run([programs.BUILD / "shade", "explain", "-"],
                        input=json.dumps(document).encode())
    return json.loads(told.stdout)["milliseconds"]


def main():
    factors = []
    print("| scene | tier | visibility: estimated | measured | shade: estimated | measured |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, document in documents():
        for tier in ("standard", "exact"):
            document = {**document, "accuracy": {"tier": tier}}
            job = {"text": json.dumps(document), "keep": False}
            measured = programs.medians(programs.library([job], 5, warm=1)[0])
            told = estimate(document)
            print(f"| {name} | {tier} | {told['visibility']:.3g} | {measured['visibility']:.3g} | "
                  f"{told['shade']:.3g} | {measured['shade']:.3g} |", flush=True)
            factors.append((told["visibility"] + told["shade"])
                           / (measured["visibility"] + measured["shade"]))
    apart = sorted(max(f, 1 / f) for f in factors)
    print(f"\nBoth together are a factor of {statistics.median(apart):.2g} apart in the median, "
          f"{apart[int(0.9 * len(apart))]:.2g} in nine of ten, {apart[-1]:.2g} at most.")


if __name__ == "__main__":
    main()
