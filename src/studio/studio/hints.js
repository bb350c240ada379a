/* What a schema does not say: how members are called on the page, and where their values usually
 * lie. Sliders go over [from, to]; the number beside them takes whatever the schema does. */

export const TITLES = {
    fov: "Field of view", ior: "Index (IOR)", minDistance: "Min. distance", ambient: "Ambient",
    shadowSamples: "Shadow samples", minContribution: "Cut below", sigma: "Roughness σ", side: "Sides",
    bitDepth: "Bit depth", colorSpace: "Color space", n: "Index n", k: "Absorption k", f0: "Reflectance F₀",
    maxError: "Max. error", uv: "UV", up: "Up", tube: "Tube radius", own: "Own ambient",
};
export const titleOf = name => TITLES[name] ??
    name.replace(/([A-Z])/g, c => " " + c.toLowerCase()).replace(/^./, c => c.toUpperCase());

/* Sliders that go by powers are marked `curve`: the share of the way is raised to it. */
const RANGES = {
    shininess: { from: 0, to: 1000, curve: 3 }, intensity: { from: 0, to: 4 }, fov: { from: 5, to: 120, unit: "°" },
    angle: { from: 1, to: 90, unit: "°" }, sigma: { from: 0, to: 90, unit: "°" }, exponent: { from: 0, to: 64, curve: 2 },
    penumbra: { from: 0, to: 1 }, minDistance: { from: 0, to: 5 }, radius: { from: 0.05, to: 2 },
    tube: { from: 0.02, to: 1 }, height: { from: 0.1, to: 5 }, roughness: { from: 0.01, to: 1, curve: 2 },
    weight: { from: 0, to: 1 }, ior: { from: 1, to: 3 }, samples: { from: 1, to: 64, curve: 2 },
    width: { from: 64, to: 1024, step: 16, unit: "px" }, segments: { from: 3, to: 128 },
    shadowSamples: { from: 1, to: 128 }, depth: { from: 0, to: 16 }, minContribution: { from: 0, to: 0.1 },
    exposure: { from: -6, to: 6, unit: "EV" }, gamma: { from: 0.2, to: 4 }, quality: { from: 1, to: 100 },
    effort: { from: 0, to: 6 }, maxError: { from: 0.001, to: 5, curve: 3 }, slope: { from: 0, to: 2 },
    attenuation: { from: 0, to: 1 }, size: { from: 0.05, to: 4 }, translate: { from: -4, to: 4 },
    rotate: { from: -180, to: 180, unit: "°" }, scale: { from: 0.1, to: 3 },
};

/* The least of a number that differs over a surface, which may be more than that of one that does not. */
export const leastVaried = (name, schema) => name === "shininess" ? 1 : schema.minimum;

export function rangeOf(name, schema) {
    const low = schema.minimum ?? schema.exclusiveMinimum, high = schema.maximum ?? schema.exclusiveMaximum;
    const hint = { ...RANGES[name] };
    if (name === "height" && schema.type === "integer") Object.assign(hint, RANGES.width);
    if (name === "width" && high === 1) Object.assign(hint, { from: 0.01, to: 0.99, step: null, unit: "" }); // of lines
    const from = Math.max(hint.from ?? low ?? 0, low ?? -Infinity);
    const to = Math.min(hint.to ?? high ?? Math.max(1, 4 * (schema.default ?? 1)), high ?? Infinity);
    const isWhole = schema.type === "integer";
    return { from, to, low, high, curve: hint.curve ?? 1, unit: hint.unit ?? "", isWhole, step: hint.step ?? (isWhole ? 1 : null) };
}
