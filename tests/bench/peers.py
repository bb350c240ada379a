"""Other programs that draw the same picture, measured beside ours: their turns alternate."""

import base64
import io
import json
import math
import os
import re
import shutil
import subprocess
import sys

import numpy as np
from PIL import Image

import programs
import scenes

HERE = programs.SOURCE / "tests/bench/peers"
WORK = programs.WORK
DOCUMENT = scenes.scene(scenes.lights(4, scenes.FADING))
PLAIN = scenes.plain(DOCUMENT)


def picture(path_or_bytes):
    source = io.BytesIO(path_or_bytes) if isinstance(path_or_bytes, bytes) else path_or_bytes
    return np.asarray(Image.open(source).convert("RGB")).astype(int)


def difference(ours, other):
    """How much another picture's 8-bit codes differ; the outline is where meshes show."""
    apart = np.abs(ours - other)
    return {"mean": round(float(apart.mean()), 4),
            "equal_or_one": round(float((apart <= 1).mean()), 6),
            "pixels_over_2": int((apart.max(-1) > 2).sum())}


# ---- llvmpipe ----

class Llvmpipe:
    """The full-screen cast with the scene in uniforms, as a program that draws any scene has it, or
    folded into the program as constants."""

    def __init__(self, name, folded):
        self.name, self.folded = name, folded
        head, values = scenes.glsl(PLAIN, folded)
        view = {"EYE": [scenes.EYE], "SLOPE": [math.tan(scenes.HALF)], "SIZE": [scenes.SIZE]}
        head += scenes.declared(view, folded)
        self.shader, self.uniforms = WORK / f"{name}.frag", WORK / f"{name}.txt"
        self.output = WORK / f"{name}.ppm"
        self.shader.write_text("#version 330 core\n" + head + (HERE / "phong.glsl").read_text()
                               + (HERE / "sphere.frag").read_text())
        lines = []
        for key, elements in {**values, **view}.items():
            flat = np.ravel(elements)
            lines.append(f"{len(flat) // len(elements)} {key} {len(elements)} "
                         + " ".join(map(repr, map(float, flat))))
        self.uniforms.write_text("" if folded else "\n".join(lines) + "\n")

    def measure(self, frames):
        done = programs.run(programs.pinned([programs.BUILD / "tests/bench_osmesa", frames, scenes.SIZE,
                                             self.shader, self.uniforms, self.output]),
                            env={"LP_NUM_THREADS": "0", "GALLIUM_DRIVER": "llvmpipe"})
        return json.loads(done.stdout)


# ---- three.js ----

class ThreeJs:
    """A page in headless Chromium, all of whose processes share one core. Each turn starts and ends
    its own: an idle browser is not quite idle."""

    def __init__(self, segments):
        head, values = scenes.glsl(PLAIN)
        scene = {"size": scenes.SIZE, "fov": scenes.FOV, "eye": scenes.EYE, "segments": segments,
                 "shader": head + (HERE / "phong.glsl").read_text(), "uniforms": values}
        self.process = subprocess.Popen(
            programs.pinned([shutil.which("node"), HERE / "three.mjs", WORK / "peers"]),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.about = self.ask(scene)

    def ask(self, wish):
        self.process.stdin.write(json.dumps(wish) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit("bench: three.mjs ended")
        return json.loads(line)

    def measure(self, frames, kind):
        return self.ask({"frames": frames, "type": f"image/{kind}", "quality": 0.9})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.wait()


def install_three():
    """node_modules beside the build, from the lock file."""
    folder = WORK / "peers"
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "package-lock.json"):
        shutil.copy(HERE / name, folder / name)
    if not (folder / "node_modules/three/package.json").exists():
        programs.run(["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts",
                      "--loglevel=error"], cwd=folder)


# ---- POV-Ray ----

class PovRay:
    def __init__(self):
        # The golden tests' translation; `no_shadow`, because nothing here casts any.
        os.environ.setdefault("SHADED_BUILD", str(programs.BUILD))
        sys.path[:0] = [str(programs.SOURCE / "tests"), str(programs.SOURCE / "tests/golden")]
        from povray_test import sdl
        text = sdl(PLAIN).replace("sphere { 0, 1", "sphere { 0, 1 no_shadow")
        (WORK / "scene.pov").write_text(text)

    def measure(self):
        """Seconds of the whole process, and processor seconds of tracing as it says itself."""
        seconds, done = programs.process_seconds(
            ["povray", "+Iscene.pov", "+Opovray.png", "+FN8", f"+W{scenes.SIZE}",
             f"+H{scenes.SIZE}", "-D", "-A", "+WT1", "File_Gamma=sRGB"], cwd=WORK,
            env={"HOME": str(WORK)})
        said = done.stderr.decode()
        traced = re.search(r"Trace Time:.*\n.* with ([\d.]+) CPU-seconds", said)
        return {"process": [seconds], "trace": [float(traced.group(1))]}


# ---- All ----

def shade_process(kind):
    target = WORK / f"cold.{kind}"
    seconds, _ = programs.process_seconds(
        [programs.BUILD / "shade", "render", WORK / "scene.json", "-o", target, "--threads", "1"])
    return {"process": [seconds]}


def measure(rounds, frames):
    """{name: samples}, {name: how the picture differs}, what there is about the peers."""
    WORK.mkdir(parents=True, exist_ok=True)
    install_three()
    (WORK / "scene.json").write_text(json.dumps(PLAIN))
    job = {"text": scenes.text(DOCUMENT)}
    # Peers keep nothing for the next picture.
    jobs = [{**job, "keep": False, "save": str(WORK / "own.png")}, job]
    sixteen = scenes.scene(scenes.lights(16, scenes.FADING), samples=None,
                           output={"format": "jpeg", "quality": 90})
    repainted = scenes.scene(sixteen["lights"], samples=None, output=sixteen["output"],
                             material=scenes.REPAINTED)
    jpeg = {**DOCUMENT, "output": {"format": "jpeg", "quality": 90}}
    # Below quality 90 colors are at half resolution (4:2:0), which is what browsers write.
    halved = {**DOCUMENT, "output": {"format": "jpeg", "quality": 89}}
    posts = {"http png": job, "http jpeg": {"text": scenes.text(jpeg)},
             "http jpeg 4:2:0": {"text": scenes.text(halved)},
             "http jpeg 16 lights": {"text": scenes.text(sixteen)},
             "http jpeg 16 lights repainted": {"text": scenes.text(repainted), "again": True}}
    pipes = [Llvmpipe("llvmpipe", False), Llvmpipe("llvmpipe folded", True)]
    povray, turns, about = PovRay(), {}, {}

    def note(name, samples):
        turns.setdefault(name, []).append([samples])

    for _ in range(rounds):
        for pipe in pipes:
            note(pipe.name, pipe.measure(frames))
        for name, samples in zip(("library", "library keeping"),
                                 programs.library(jobs, frames, warm=60)):
            note(name, samples)
        for name, segments in (("three.js", 128), ("three.js coarse", 64)):
            with ThreeJs(segments) as page:
                about = {**about, "three.js": page.about}
                note(f"{name} cold", {"process": [page.about["first"]]})
                for kind in ("png", "jpeg"):
                    note(f"{name} {kind}", page.measure(frames, kind))
        with programs.Daemon() as daemon:
            for core, where, warm in ((programs.LAST, "", 15),
                                      (programs.FIRST, ", one core for both", 1)):
                for name, samples in zip(posts, daemon.requests(posts.values(), frames, core,
                                                                warm)):
                    note(name + where, samples)
        note("povray", povray.measure())
        note("shade png", shade_process("png"))
        note("shade jpeg", shade_process("jpg"))

    samples = {name: programs.merged(runs)[0] for name, runs in turns.items()}
    ours = picture(WORK / "own.png")
    others = {name: base64.b64decode(samples[name].pop("picture"))
              for name in list(samples) if "picture" in samples[name]}
    differences = {
        **{pipe.name: difference(ours, picture(pipe.output)) for pipe in pipes},
        **{name: difference(ours, picture(data)) for name, data in others.items()},
        "povray": difference(ours, picture(WORK / "povray.png"))}
    about["llvmpipe"] = {key: samples["llvmpipe"][key] for key in ("renderer", "version")}
    return ({name: told(s) for name, s in samples.items()}, differences, about)


def told(samples):
    """Medians, and the quartiles of what is compared."""
    samples = dict(samples)
    if "shade" in samples and "cpu" in samples:
        samples["seen"] = programs.rest(samples, programs.LEFT_OUT["seen"])
    whole = {f"{name}_quartiles": programs.spread(samples[name])
             for name in ("wall", "cpu", "seen", "blob", "process") if name in samples}
    runs = {"runs": len(next(v for v in samples.values() if programs.is_samples(v)))}
    return {**programs.medians(samples), **whole, **runs}


if __name__ == "__main__":
    print(json.dumps(measure(2, 5), indent=1))
