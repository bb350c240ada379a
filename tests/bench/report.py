"""Makes docs/speed-and-error.md and what it links to of measured figures: report.py FOLDER

FOLDER/bench has a file of results for each processor, PROCESSOR.json. FOLDER gets
speed-and-error.md, bench/PROCESSOR.md and bench/PROCESSOR-*.svg; without gnuplot the plots of
lights stay as they are."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import chart

TIERS = ("standard", "exact")


def three(value):
    """Three digits."""
    if value == 0:
        return "0"
    if value >= 1e5 or value < 1e-3:
        return f"{value:.1e}"
    return f"{value:.{max(0, 2 - len(str(int(value))) + (1 if value < 1000 else 0))}f}"


def percent(share):
    """Rounded down: 100 % is all."""
    return f"{int(1e6 * share) / 1e4:.4f} %" if share < 1 else "100 %"


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
                     + ["| " + " | ".join(map(str, row)) + " |" for row in rows]) + "\n"


def find(entries, **wanted):
    return next(e for e in entries if all(e.get(k) == v for k, v in wanted.items()))


class Report:
    """Of one processor's results, in the file SLUG.json."""

    def __init__(self, slug, result):
        self.slug = slug
        self.result = result
        self.peers = result["peers"]

    # ---- Asked for and reached ----

    def targets(self):
        """(what, wanted in words, reached in words, whether it is)"""
        r, peers = self.result, self.peers
        rows = []

        def at_least(what, over, under, wanted):
            ratio = over / under
            rows.append((what, f"at least {wanted} times faster", f"{three(ratio)} times "
                         f"({three(over)} : {three(under)} ms)", ratio >= wanted))

        def below(what, over, under, wanted, words, unit="ms"):
            ratio = over / under
            rows.append((what, words, f"{three(ratio)} times ({three(over)} : {three(under)} "
                         f"{unit})", ratio < wanted))

        at_least("cast + shade + sRGB in the library, against llvmpipe with readback (CPU)",
                 peers["llvmpipe"]["cpu"], peers["library"]["seen"], 8)
        at_least("HTTP request to PNG, against three.js: frame + PNG blob",
                 peers["three.js png"]["blob"], peers["http png, one core for both"]["wall"], 8)
        at_least("HTTP request to JPEG q90, against three.js: frame + JPEG blob",
                 peers["three.js jpeg"]["blob"], peers["http jpeg, one core for both"]["wall"], 18)
        first, again = (find(r["reuse"], lights=4, request=name) for name in
                        ("first", "repainted"))
        at_least("all stages before encoding after a change of colors, against the first request",
                 first["before_encoding"], again["before_encoding"], 4)
        at_least("the same for the JPEG request over HTTP with default samples and 16 lights",
                 *(peers[f"http jpeg 16 lights{kind}, one core for both"]["wall"]
                   for kind in ("", " repainted")), 3)
        at_least("`shade render` to PNG, cold, against POV-Ray's process",
                 peers["povray"]["process"], peers["shade png"]["process"], 15)
        for name, words, figure, most in (
                ("torus", "visibility of a torus, 4 samples (CPU)", "visibility", 8),
                ("ball", "cast + shade + sRGB of a mesh of 960 triangles, 4 samples (CPU)", "seen", 25)):
            for e in r.get("objects", []):
                if (e["object"], e["kernel"]) == (name, r["kernels"][-1]):
                    rows.append((words, f"under {most} ms", f"{three(e[figure])} ms",
                                 e[figure] < most))
        base = find(r["stages"], lights=4, samples=1)
        four = find(r["stages"], lights=4, samples=4)
        below("sRGB color stage against shade stage", base["color"], base["shade"], 0.5,
              "under half")
        below("samples 4 against samples 1, request to PNG (CPU)", four["cpu"], base["cpu"], 2,
              "under 2 times")
        scaled = [find(r["scaling"], format="jpeg", threads=n)["wall"]
                  for n in (1, r["machine"]["cores"])]
        at_least(f"2048x2048 to JPEG on {r['machine']['cores']} cores, against one", *scaled, 1.8)
        most = max(e["lights"] for e in r["light_cost"])
        for name, words, wanted in (("plain", "flat or falling", 1.05),
                                    ("attenuated", "flat or falling", 1.05),
                                    ("lamps, deltaE 0.5", "falling", 1)):
            costs = [find(r["light_cost"], lights=n, scene=name)["ns"] for n in (most, 4)]
            below(f"cost of a light at a point, {most} lights against 4 ({name})", *costs, wanted,
                  words, "ns")
        rows.extend(self.error_targets())
        rows.extend(self.front_targets())
        return rows

    def front_targets(self):
        """Whether each tier is at least 1.5 times left of the next; one that renders as another is not."""
        front = [e for e in self.result.get("front", []) if "tier" in e]
        for slow, fast in (("exact", "standard"), ("standard", "draft")):
            for kernel in self.result["kernels"] if front else ():
                over, under = (find(front, tier=tier, kernel=kernel) for tier in (slow, fast))
                ratio = over["seen"] / under["seen"]
                same = chart.rendered(under) != fast
                yield (f"{fast} against {slow}, {kernel} (CPU)", "at least 1.5 times faster",
                       f"renders as {slow}" if same else
                       f"{three(ratio)} times ({three(over['seen'])} : {three(under['seen'])} ms)",
                       not same and ratio >= 1.5)

    def error_targets(self):
        errors = self.result["ladder"]["errors"]
        standard = [e["error"]["code"] for e in errors if e["tier"] == "standard"]
        worst, equal = max(c["max"] for c in standard), min(c["equal"] for c in standard)
        yield ("codes of standard against exact", "1 apart at most, 99.9 % equal",
               f"{worst:.0f} apart at most, {percent(equal)} equal", worst <= 1 and equal >= .999)
        for shininess, limit in {10: 4e-7, 1000: 2.4e-6, 100000: 3e-5}.items():
            found = [e["error"]["linear"]["max"] for e in errors
                     if (e["tier"], e["shininess"]) == ("standard", shininess)]
            if found:
                yield (f"largest linear error of standard, shininess {shininess}",
                       f"at most {limit:.1e}", f"{max(found):.1e}", max(found) <= limit)

    # ---- Tables ----

    def peer_table(self):
        rows = []
        own = {"seen": self.peers["library"]["seen"], "png": self.peers["http png, one core for both"]["wall"],
               "jpeg": self.peers["http jpeg, one core for both"]["wall"],
               "process": self.peers["shade png"]["process"]}
        for what, name, figure, unit in (
                ("library: cast + shade + sRGB codes (CPU)", "library", "seen", "seen"),
                ("the same, keeping hits and sums of light", "library keeping", "seen", "seen"),
                ("llvmpipe, scene in uniforms, read back (CPU)", "llvmpipe", "cpu", "seen"),
                ("llvmpipe, scene folded into the shader (CPU)", "llvmpipe folded", "cpu", "seen"),
                ("POV-Ray, its own tracing time (CPU)", "povray", "trace", "seen"),
                ("shaded, HTTP to PNG", "http png, one core for both", "wall", "png"),
                ("shaded, the client on another core", "http png", "wall", "png"),
                ("three.js, 128 x 64 segments, to PNG", "three.js png", "blob", "png"),
                ("three.js, 64 x 32 segments, to PNG", "three.js coarse png", "blob", "png"),
                ("shaded, HTTP to JPEG q90", "http jpeg, one core for both", "wall", "jpeg"),
                ("shaded, the client on another core", "http jpeg", "wall", "jpeg"),
                ("shaded, HTTP to JPEG q89, 4:2:0 as the browser's",
                 "http jpeg 4:2:0, one core for both", "wall", "jpeg"),
                ("three.js, 128 x 64 segments, to JPEG q90", "three.js jpeg", "blob", "jpeg"),
                ("three.js, 64 x 32 segments, to JPEG q90", "three.js coarse jpeg", "blob", "jpeg"),
                ("`shade render` to PNG, a process", "shade png", "process", "process"),
                ("`shade render` to JPEG, a process", "shade jpeg", "process", "process"),
                ("POV-Ray to PNG, a process", "povray", "process", "process"),
                ("three.js, browser's start to first PNG", "three.js cold", "process", "process")):
            entry = self.peers[name]
            quartiles = entry.get(f"{figure}_quartiles")
            rows.append((what, three(entry[figure]), " - ".join(map(three, quartiles[::2]))
                         if quartiles else "", three(entry[figure] / own[unit])))
        return table(("what", "median ms", "middle half", "times ours"), rows)

    def difference_table(self):
        named = {"llvmpipe": "llvmpipe", "three.js png": "three.js, 128 x 64 segments",
                 "three.js coarse png": "three.js, 64 x 32 segments", "povray": "POV-Ray"}
        rows = [(words, d["mean"], f"{100 * d['equal_or_one']:.2f} %", d["pixels_over_2"])
                for name, words in named.items() for d in [self.result["differences"][name]]]
        return table(("picture of", "mean difference (codes)", "within 1 code",
                      "pixels more than 2 off"), rows)

    def stage_table(self):
        names = ("parse", "plan", "visibility", "shade", "color", "encode", "rest")
        rows = [(e["lights"], e["samples"], *(three(e[n]) for n in names), three(e["cpu"]))
                for e in self.result["stages"]]
        return table(("lights", "samples", *names, "request"), rows)

    def object_table(self):
        names = ("visibility", "shade", "seen")
        rows = [(e["object"], e["kernel"], *(three(e[n]) for n in names))
                for e in self.result.get("objects", [])]
        return "Not measured on this processor.\n" if not rows else table(("object", "kernel", *names[:-1], "cast + shade + sRGB"), rows)

    def reuse_table(self):
        names = ("parse", "plan", "visibility", "shade", "color", "encode", "rest",
                 "before_encoding", "wall")
        rows = [(f"{e['lights']} lights, {e['samples']} samples", e["request"],
                 *(three(e[n]) for n in names)) for e in self.result["reuse"]]
        return table(("scene", "request", *names[:-2], "before encoding", "wall"), rows)

    def scaling_table(self):
        rows = []
        for form in ("jpeg", "png"):
            entries = [e for e in self.result["scaling"] if e["format"] == form]
            for e in entries:
                rows.append((form, e["threads"], three(e["tiles"]), three(e["wall"]),
                             three(entries[0]["tiles"] / e["tiles"]),
                             three(entries[0]["wall"] / e["wall"])))
        return table(("format", "threads", "ms to the last tile", "ms in all", "speed-up of tiles",
                      "in all"), rows)

    def light_table(self):
        entries = self.result["light_cost"]
        names = sorted({e["scene"] for e in entries}, key=[e["scene"] for e in entries].index)
        rows = [(n, *(f"{three(e['ns'])} ({three(e['shade'])})" for name in names
                      for e in [find(entries, lights=n, scene=name)]))
                for n in sorted({e["lights"] for e in entries})]
        return table(("lights", *names), rows)

    def error_table(self):
        errors, rows = self.result["ladder"]["errors"], []
        for tier in TIERS[:1]:
            for shininess in sorted({e["shininess"] for e in errors}):
                cells = [e for e in errors if (e["tier"], e["shininess"]) == (tier, shininess)]
                found = [e["error"] for e in cells]
                rows.append((tier, shininess, self.bound(cells),
                             *(three(max(f["linear"][k] for f in found))
                               for k in ("max", "mean", "p99")),
                             f"{max(f['code']['max'] for f in found):.0f}",
                             percent(min(f["code"]["equal"] for f in found)),
                             three(max(f["deltaE2000"]["max"] for f in found))))
        return table(("tier", "shininess", "bound", "linear max", "mean", "p99", "codes max",
                      "codes equal", "deltaE2000 max"), rows)

    @staticmethod
    def bound(cells):
        """The largest bound, and how many times the largest error it is, at most and at least."""
        slack = sorted(e["bound"]["linear"] / e["error"]["linear"]["max"] for e in cells)
        return (f"{max(e['bound']['linear'] for e in cells):.1e} "
                f"({three(slack[0])} - {three(slack[-1])} times)")

    def budget_table(self):
        rows = []
        for e in self.result["budgets"]:
            exact = find(self.result["budgets"], metric=e["metric"], most=0)
            rows.append((e["metric"], e["most"] or "exact tier", three(e["error"]) if e["error"] is not None else "not measured",
                         three(e["before_encoding"]),
                         three(exact["before_encoding"] / e["before_encoding"]), e["plan_line"]))
        return table(("metric", "budget", "measured", "ms before encoding", "times faster than exact",
                      "plan"), rows)

    def time_table(self):
        times, rows = self.result["ladder"]["times"], []
        counts = sorted({e["lights"] for e in times})
        for tier in TIERS:
            for kernel in self.result["kernels"]:
                row = []
                for count in counts:
                    seen = [e["seen"] for e in times if
                            (e["tier"], e["kernel"], e["lights"]) == (tier, kernel, count)]
                    low, high = three(min(seen)), three(max(seen))
                    row.append(low if low == high else f"{low} - {high}")
                rows.append((tier, kernel, *row))
        return table(("tier", "kernel", *(f"{n} light{'s' * (n > 1)}" for n in counts)), rows)

    # ---- Plots ----

    def others(self):
        """[(name, ms, mean difference in codes)] of the peers, without what follows the codes."""
        places = (("llvmpipe", "llvmpipe", "llvmpipe", "cpu"),
                  ("llvmpipe, scene compiled in", "llvmpipe folded", "llvmpipe folded", "cpu"),
                  ("three.js, 128 x 64", "three.js png", "three.js png", "frame"),
                  ("three.js, 64 x 32", "three.js coarse png", "three.js coarse png", "frame"),
                  ("POV-Ray", "povray", "povray", "trace"))
        return [(words, self.peers[name][figure], self.result["differences"][other]["mean"])
                for words, name, other, figure in places if other in self.result["differences"]]

    def front_chart(self):
        return chart.draw(self.processor(), self.result["front"], self.others())

    def front_table(self):
        rows = [(e.get("tier") or f"maxError {e['most']:g}, {e['metric']}",
                 e.get("kernel", self.result["kernels"][-1]), three(e["seen"]),
                 three(e["codes"]["mean"]), e["codes"]["max"], e["plan_line"])
                for e in self.result.get("front", [])]
        return table(("asked for", "kernel", "ms", "mean difference (codes)", "largest", "plan"),
                     rows) if rows else ""

    def front_text(self):
        if "front" not in self.result:
            return "Not measured on this processor.\n"
        load = self.result.get("front_load")
        apart = "" if load is None else (
            " Tiers and\nbudgets were measured after the other programs, when the machine had other work: a load "
            f"average of {load}.")
        return template("front.md").format(slug=self.slug, apart=apart, front=self.front_table())

    def plot(self, path, setup, series):
        """series: [(title, style, [(x, y)])]"""
        blocks = "".join(f"$data{i} << end\n" + "\n".join(f"{x} {y}" for x, y in points)
                         + "\nend\n" for i, (_, _, points) in enumerate(series))
        curves = ", ".join(f"$data{i} with {style} title '{title}'"
                           for i, (title, style, _) in enumerate(series))
        script = (f"set terminal svg size 760,420 background 'white'\nset output '{path}'\n"
                  f"set grid\nset key outside right\n{setup}\n{blocks}plot {curves}\n")
        subprocess.run(["gnuplot"], input=script.encode(), check=True)

    def plots(self, folder):
        if shutil.which("gnuplot"):
            self.light_plot(folder)
        if "front" in self.result:
            (folder / f"{self.slug}-front.svg").write_text(self.front_chart())

    def light_plot(self, folder):
        entries = self.result["light_cost"]
        names = sorted({e["scene"] for e in entries}, key=[e["scene"] for e in entries].index)
        self.plot(folder / f"{self.slug}-lights.svg", "set logscale xy\nset xlabel 'lights'\n"
                  "set ylabel 'shade stage, ns a light and point'",
                  [(name, f"linespoints lw 2 lc {i + 1}",
                    [(e["lights"], e["ns"]) for e in entries if e["scene"] == name])
                   for i, name in enumerate(names)])

    # ---- The page ----

    def processor(self):
        return self.result["machine"]["processor"]

    def page(self):
        m, r = self.result["machine"], self.result
        browser, pipe = r["about"]["three.js"], r["about"]["llvmpipe"]
        quick = "\n**A quick run, good for a glance only.**\n" if r["quick"] else ""
        return template("machine.md").format(
            quick=quick, processor=self.processor(), slug=self.slug, file=f"{self.slug}.json",
            peers=self.peer_table(),
            differences=self.difference_table(), stages=self.stage_table(),
            objects=self.object_table(), reuse=self.reuse_table(), scaling=self.scaling_table(), lights=self.light_table(),
            budgets=self.budget_table(), errors=self.error_table(), times=self.time_table(), front=self.front_text(), covered=r["covered"],
            runs=r["peers"]["library"]["runs"], processes=r["peers"]["povray"]["runs"],
            load=f"{r['load'][0]} at its beginning and {r['load'][1]} at its end",
            priority="; all that was measured went before what else ran (`nice -19`)"
                     if r["priority"] else "",
            machine=", ".join([m["processor"], f"{m['cores']} cores",
                               *(f"{k} {v} a core" for k, v in m["caches"].items()), m["memory"]]),
            versions=f"{m['system']}; {m['compiler']}; Mesa {pipe['version'].split()[-1]}, "
                     f"{pipe['renderer']}; three.js r{browser['version']} in Chromium "
                     f"{browser['browser']}, {gpu(browser['renderer'])}; POV-Ray {m['povray']}")


def gpu(name):
    return "SwiftShader" if "SwiftShader" in name else name


def template(name):
    return (Path(__file__).parent / name).read_text()


def read(folder):
    """A report for each processor that FOLDER/bench has results of."""
    return [Report(path.stem, json.loads(path.read_text()))
            for path in sorted((folder / "bench").glob("*.json"))]


def overview(reports):
    """speed-and-error.md: what is asked for, with a column for each processor."""
    asked = {}
    for report in reports:
        for what, wanted, reached, met in report.targets():
            cells = asked.setdefault((what, wanted), {})
            cells[report.slug] = reached if met else f"{reached}, **not reached**"
    return template("report.md").format(
        pages="".join(f"- [{r.processor()}](bench/{r.slug}.md)\n" for r in reports),
        targets=table(("what", "asked for", *(r.processor() for r in reports)),
                      [(*words, *(cells.get(r.slug, "not measured") for r in reports))
                       for words, cells in asked.items()]))


def main():
    folder = Path(sys.argv[1])
    reports = read(folder)
    (folder / "speed-and-error.md").write_text(overview(reports))
    for report in reports:
        (folder / "bench" / f"{report.slug}.md").write_text(report.page())
        report.plots(folder / "bench")


if __name__ == "__main__":
    main()
