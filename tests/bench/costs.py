"""What `shade explain` estimates beside what is measured, in milliseconds of one core: python3
tests/bench/costs.py [NAME...], where `./dev bench` has built the programs; a NAME is the beginning
of a scene's, and without any all are measured. With --beyond first, what is measured are scenes beyond
Phong and the examples, all in f64, of which the whole time to colors is told, in processor time. src/plan/cost.c,
src/plan/paths.c and src/render/tell/explain.c have their constants from here."""

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


SHAPED = {"point": {"type": "point"},
          "rect": {"type": "rect", "direction": [-1, -1, -1], "size": [2, 2]},
          "disc": {"type": "disc", "direction": [-1, -1, -1], "radius": 1},
          "ball": {"type": "sphere", "radius": 1}}
MODELS = {"lambert": {"diffuse": 0.5},
          "phong": {"diffuse": 0.3, "specular": 0.4, "shininess": 30},
          "phong 30.5": {"diffuse": 0.3, "specular": 0.4, "shininess": 30.5},
          "blinn-phong": {"model": "blinn-phong", "diffuse": 0.3, "specular": 0.4, "shininess": 120},
          "phong-normalized": {"model": "phong-normalized", "diffuse": 0.3, "specular": 0.3, "shininess": 30},
          "oren-nayar": {"model": "oren-nayar", "diffuse": 0.5, "sigma": 30},
          "cook-torrance": {"model": "cook-torrance", "diffuse": 0.3, "lobes": [{"roughness": 0.2}]},
          "westin": {"model": "westin", "diffuse": 0.7, "microgeometry": {"type": "grooves"}}}


def beyond():
    """Every shape of a light with every model, shadows of few things and of many, mirrors; and the examples."""
    place = random.Random(1)
    around = [{"type": "sphere", "radius": 0.3, "transform": {"translate": [
        place.uniform(-2, 2), 0.3, place.uniform(-2, 2)]}} for _ in range(12)]
    plain = {"image": {"width": 192, "height": 192}, "accuracy": {"tier": "exact"}}
    for shape, light in SHAPED.items():
        lit = {**plain, "lights": [{**light, "position": [3, 3, 3], "intensity": 0.3}]}
        for model, material in MODELS.items():
            one = {**lit, "objects": [{"type": "sphere", "material": material}]}
            if shape != "point" and model not in ("lambert", "phong"):
                one["image"] = {"width": 32, "height": 32}  # by quadrature
            yield f"{shape}, {model}", one
            if model in ("lambert", "phong", "cook-torrance"):
                yield f"{shape}, {model}, shadows", {**one, "trace": {"shadows": True}}
        for material, trace in (({}, {"shadows": True}), ({"reflection": 0.4}, {"depth": 3}),
                                ({"reflection": 0.4}, {"depth": 3, "shadows": True})):
            yield f"{shape}, 12 spheres on a plane, {json.dumps(trace)}", {
                **lit, "objects": [{"type": "plane", "material": material}, *around], "trace": trace,
                "camera": {"position": [0, 4, 6]}}
    for path in EXAMPLES:
        document = json.loads(path.read_text())
        if "outputs" not in document:
            yield path.stem, document


def measure_beyond(wanted):
    factors = []
    print("| scene | visibility | shade | shadow | trace | estimated: all to colors | measured | estimated / measured |")
    print("| --- " * 8 + "|")
    for name, document in beyond():
        if not name.startswith(wanted):
            continue
        job = {"text": json.dumps(document), "keep": False, "format": "png"}
        runs = programs.library([job], 3, warm=1)[0]
        measured = 1e3 * min(programs.rest(runs, ("parse", "plan", "encode")))
        told = json.loads(programs.run([programs.BUILD / "shade", "explain", "-"],
                                       input=json.dumps(document).encode()).stdout)["milliseconds"]
        told["visibility"] += told.get("build", 0)
        parts = [told.get(stage, 0) for stage in ("visibility", "shade", "shadow", "trace", "color")]
        factors.append(sum(parts) / measured)
        print(f"| {name} | " + " | ".join(f"{part:.3g}" for part in parts[:4]) +
              f" | {sum(parts):.3g} | {measured:.3g} | {factors[-1]:.2f} |", flush=True)
    within = sum(1 / 2 <= factor <= 2 for factor in factors) / len(factors)
    print(f"\nEstimates are within a factor of 2 of what is measured in {within:.0%} of {len(factors)} scenes; "
          f"the least is {min(factors):.2g} times it, the most {max(factors):.2g} times.")


def estimate(document, kernel):
    told = programs.run([programs.BUILD / "shade", "explain", "-", "--kernel", kernel],
                        input=json.dumps(document).encode())
    milliseconds = json.loads(told.stdout)["milliseconds"]
    milliseconds["visibility"] += milliseconds.get("build", 0)
    return milliseconds


def main():
    if sys.argv[1:2] == ["--beyond"]:
        measure_beyond(tuple(sys.argv[2:]) or "")
        return
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
            measured["visibility"] += measured["build"]
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
