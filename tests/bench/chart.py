"""Draws the chart of time against error, for light and dark pages, as SVG."""

import math
from html import escape

WIDTH, HEIGHT = 760, 520
LEFT, RIGHT, TOP, BOTTOM = 84, 736, 96, 410
NONE = 442  # the row of pictures that are equal
LOW, HIGH = -6, 0  # decades of error
STYLE = """
svg { --page: #ffffff; --ink: #22262e; --soft: #5a606c; --line: #dfe2e8;
  --exact: #1f5fbf; --standard: #c2560c; --draft: #14794a; --budget: #8a2fa8; --other: #4b5563; }
@media (prefers-color-scheme: dark) {
  svg { --page: #14171c; --ink: #e8eaef; --soft: #a4abb8; --line: #303640;
    --exact: #7fb0ff; --standard: #ffa25e; --draft: #66d19e; --budget: #d79bf0; --other: #c3c9d4; } }
text { font-size: 12px; fill: var(--ink); }
.soft { fill: var(--soft); } .title { font-size: 17px; } .grid { stroke: var(--line); }
.front { stroke: var(--soft); stroke-dasharray: 4 3; fill: none; }
"""
SHAPES = {"portable": "M-5-5h10v10h-10z", "avx2": "M0-6L6 5H-6z",
          "avx512": "M-5.5 0a5.5 5.5 0 1 0 11 0a5.5 5.5 0 1 0-11 0z"}
DIAMOND, RING = "M0-6L6 0L0 6L-6 0z", "M-9 0a9 9 0 1 0 18 0a9 9 0 1 0-18 0z"
KERNELS = {"portable": "portable", "avx2": "AVX2", "avx512": "AVX-512"}


class Chart:
    def __init__(self, times):
        self.parts = []
        self.first = math.floor(2 * math.log10(min(times))) / 2
        self.last = math.ceil(2 * math.log10(max(times)) + 0.2) / 2

    def x(self, ms):
        return LEFT + (RIGHT - LEFT) * (math.log10(ms) - self.first) / (self.last - self.first)

    @staticmethod
    def y(codes):
        if codes < 10 ** LOW:
            return NONE
        return BOTTOM - (BOTTOM - TOP) * (math.log10(codes) - LOW) / (HIGH - LOW)

    def text(self, x, y, words, name="", anchor="start", more=""):
        self.parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"'
                          f'{f" class={chr(34)}{name}{chr(34)}" if name else ""}{more}>'
                          f'{escape(words)}</text>')

    def line(self, x1, y1, x2, y2):
        self.parts.append(f'<path class="grid" d="M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}"/>')

    def mark(self, ms, codes, shape, color, words, hollow=False):
        paint = f'fill="none" stroke-width="1.5" stroke="var(--{color})"' if hollow \
            else f'fill="var(--{color})"'
        self.parts.append(f'<path d="{shape}" transform="translate({self.x(ms):.1f} '
                          f'{self.y(codes):.1f})" {paint}><title>{escape(words)}</title></path>')

    def axes(self):
        for decade in range(LOW, HIGH + 1):
            self.line(LEFT, self.y(10 ** decade), RIGHT, self.y(10 ** decade))
            self.text(LEFT - 8, self.y(10 ** decade) + 4, f"{10.0 ** decade:.6f}".rstrip("0").rstrip("."), "soft",
                      "end")
        self.line(LEFT, NONE, RIGHT, NONE)
        self.text(LEFT - 8, NONE + 4, "0", "soft", "end")
        for decade in range(math.floor(self.first), math.ceil(self.last) + 1):
            for digit in (1, 2, 5):
                ms = digit * 10.0 ** decade
                if self.first <= math.log10(ms) <= self.last:
                    self.line(self.x(ms), TOP, self.x(ms), NONE + 10)
                    self.text(self.x(ms), NONE + 26, f"{ms:g}", "soft", "middle")
        self.text((LEFT + RIGHT) / 2, NONE + 46, "milliseconds on one core, from rays to 8-bit "
                  "sRGB codes (left is faster)", anchor="middle")
        middle = (TOP + NONE) / 2
        self.text(20, middle, "mean difference from exact, in codes", anchor="middle",
                  more=f' transform="rotate(-90 20 {middle:.1f})"')

    def legend(self):
        x = LEFT
        for kernel, words in KERNELS.items():
            self.parts.append(f'<path d="{SHAPES[kernel]}" transform="translate({x + 6} 72)" '
                              'fill="var(--soft)"/>')
            self.text(x + 18, 76, words, "soft")
            x += 40 + 7 * len(words)
        for shape, words, color, hollow in ((RING, "error budget", "budget", True),
                                            (DIAMOND, "other program", "other", False)):
            paint = f'fill="none" stroke-width="1.5" stroke="var(--{color})"' if hollow \
                else f'fill="var(--{color})"'
            self.parts.append(f'<path d="{shape}" transform="translate({x + 9} 72)" {paint}/>')
            self.text(x + 24, 76, words, "soft")
            x += 46 + 7 * len(words)

    def svg(self, title, under):
        head = (f'<svg xmlns="http://www.w3.org/2000/svg" role="img" width="{WIDTH}" '
                f'height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif">\n'
                f"<title>{escape(title)}. {escape(under)}</title>\n<style>{STYLE}</style>\n"
                f'<path d="M0 0h{WIDTH}v{HEIGHT}H0z" fill="var(--page)"/>\n'
                f'<text class="title" x="20" y="28">{escape(title)}</text>\n'
                f'<text class="soft" x="20" y="48">{escape(under)}</text>\n')
        return head + "\n".join(self.parts) + "\n</svg>\n"


def rendered(entry):
    """The tier that the plan took."""
    return entry["plan_line"].split(";")[0].removeprefix("tier=")


def tiers(front):
    """{tier: {kernel: entry}} of the tiers that rendered as themselves."""
    found = {}
    for entry in front:
        if entry.get("tier") and entry["tier"] == rendered(entry):
            found.setdefault(entry["tier"], {})[entry["kernel"]] = entry
    return found


def draw(processor, front, others):
    """The chart as text; others: [(name, ms, codes)]."""
    chart = Chart([e["seen"] for e in front] + [ms for _, ms, _ in others])
    chart.axes()
    chart.legend()
    found, budgets = tiers(front), [e for e in front if "metric" in e]
    for kernel in KERNELS:
        ends = [(e["seen"], e["codes"]["mean"]) for kind in found.values()
                for e in [kind.get(kernel)] if e]
        places = " ".join(f"{chart.x(ms):.1f},{chart.y(codes):.1f}" for ms, codes in ends)
        chart.parts.append(f'<polyline class="front" points="{places}"/>')
    for e in budgets:
        chart.mark(e["seen"], e["codes"]["mean"], RING, "budget",
                   f"maxError {e['most']:g} {e['metric']}: {e['seen']:g} ms", hollow=True)
    for tier, kernels in found.items():
        for kernel, e in kernels.items():
            chart.mark(e["seen"], e["codes"]["mean"], SHAPES[kernel], tier,
                       f"{tier}, {KERNELS[kernel]}: {e['seen']:g} ms")
    name_own(chart, found, budgets, {rendered(e) for e in front if e.get("tier") == "draft"})
    place_others(chart, others)
    return chart.svg(f"Time against error: {processor}",
                     "512x512, one sphere, 4 attenuated point lights, one sample. "
                     "Down is closer to the exact tier.")


def name_own(chart, found, budgets, drafts):
    """Names beside the right-most point of each tier, with what draft rendered as, and of budgets."""
    for tier, kernels in found.items():
        e = max(kernels.values(), key=lambda e: e["seen"])
        chart.text(chart.x(e["seen"]) + 12, chart.y(e["codes"]["mean"]) + 4,
                   f"{tier}, which draft renders as" if tier in drafts - {"draft"} else tier,
                   more=f' style="fill: var(--{tier})"')
    standard = max((e["codes"]["mean"] for e in found.get("standard", {}).values()), default=0)
    near = [e for e in budgets if e["codes"]["mean"] <= 2 * standard]
    if near:
        e = max(near, key=lambda e: e["seen"])
        chart.text(chart.x(e["seen"]) - 20, chart.y(e["codes"]["mean"]) - 16,
                   f"{len(near)} budgets, beside tiers", more=' style="fill: var(--budget)"')
    for e in budgets:
        if e not in near:
            chart.text(chart.x(e["seen"]) + 14, chart.y(e["codes"]["mean"]) + 4,
                       f"maxError {e['most']:g}, {e['metric']}",
                       more=' style="fill: var(--budget)"')


def place_others(chart, others):
    """Names at the left in the right half; those of points close together above and below."""
    for i, (name, ms, codes) in enumerate(others):
        chart.mark(ms, codes, DIAMOND, "other", f"{name}: {ms:g} ms")
        x, y = chart.x(ms), chart.y(codes)
        crowd = [(a, b) for j, (_, a, b) in enumerate(others) if j != i
                 and abs(chart.x(a) - x) < 200 and abs(chart.y(b) - y) < 14]
        right = x > (LEFT + RIGHT) / 2
        lift = 0 if not crowd else -14 if ms > crowd[0][0] else 16
        chart.text(x + (0 if crowd else -12 if right else 12), y + 4 + lift, name,
                   anchor="middle" if crowd else "end" if right else "start")
