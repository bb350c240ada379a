// Random scenes: valid by the schema, and made from these by mistakes.
import { createHash } from "node:crypto";

import { fc } from "./packages.mjs";
import { schema } from "./contract.mjs";
import { Values } from "./values.mjs";

// Has the daemon know the mesh that random scenes name, and returns its digest.
export async function keepMesh(daemon) {
    const mesh = Buffer.from('{"positions": [0,0,0, 1,0,0, 0,1,0]}');
    const digest = createHash("sha256").update(mesh).digest("hex");
    await daemon.ask({ method: "PUT", path: `/v1/meshes/${digest}`, body: mesh,
                       headers: { "Content-Type": "application/json" } });
    return digest;
}

// The same for a picture.
export async function keepPicture(daemon) {
    const scene = { objects: [{ type: "sphere" }], image: { width: 6, height: 5 } };
    const picture = (await daemon.post("/v1/render", scene)).body;
    const digest = createHash("sha256").update(picture).digest("hex");
    await daemon.ask({ method: "PUT", path: `/v1/assets/${digest}`, body: picture,
                       headers: { "Content-Type": "image/png" } });
    return digest;
}

// What the schema leaves open and the reader knows: names, and numbers that fit together. From the
// schema alone come scenes of which almost all are refused.
async function hints(daemon) {
    const read = async path => JSON.parse((await daemon.ask({ method: "GET", path })).body);
    const { spaces, displays, looks } = await read("/v1/colorspaces");
    const { materials } = await read("/v1/materials");
    const named = list => fc.constantFrom(...list.map(entry => entry.name));
    const linear = named(spaces.filter(entry => entry.sceneLinear));
    const number = fc.integer({ min: -8, max: 8 }).map(step => step / 4);
    const triangle = fc.array(number, { minLength: 9, maxLength: 9 });
    const part = fc.integer({ min: 0, max: 20 }).map(step => step * 5);
    const opaque = fc.oneof(
        fc.constantFrom("red", "RebeccaPurple", " white ", "#1af", "#1af0b2", "#1afF", "color(srgb 1 0.5 none)"),
        fc.constantFrom("rgb", "rgba", "hwb", "lab", "lch", "oklab", "oklch", "color(xyz", "color(display-p3")
            .chain(name => fc.tuple(part, part, part).map(parts =>
                `${name}${name.includes("(") ? " " : "("}${parts.join(name === "rgba" ? "," : " ")})`)));
    const seenThrough = fc.oneof(opaque, fc.constantFrom("transparent", "#1af8", "hsl(20deg 50% 50% / 30%)"));
    const colors = ["color", "colors", "ambient", "emissive", "diffuse", "specular", "matte", "tint"];
    const digest = await keepMesh(daemon), picture = await keepPicture(daemon);
    // Other models behind shadows of lights with a shape take a millisecond a sample.
    const side = fc.integer({ min: 3, max: 12 });
    return {
        names: {
            workingSpace: linear,
            colorSpace: fc.oneof({ arbitrary: linear, weight: 3 }, named(spaces)),
            space: named(spaces),
            display: named(displays),
            view: fc.constantFrom(displays[0].views[0]),
            looks: named(looks),
            preset: named(materials.filter(entry => entry.model === "phong")),
            ...Object.fromEntries(colors.map(name => [name, opaque])),
            background: seenThrough,
            material: named(materials),
        },
        members: {
            f0: fc.constantFrom(0.04, 0.9, [0.9, 0.6, 0.3]),
            opacity: fc.constantFrom(1, 0, 0.5),
            reflection: fc.constantFrom(0, 0.5),
            transmission: fc.constantFrom(0, 0.75, 1.5),
            depth: fc.constantFrom(0, 1, 3), // deep paths with coefficients above 1 exceed the limit `work`
            shadowSamples: fc.constantFrom(1, 16),
            data: fc.constant(`sha256-${digest}`),
            texture: fc.constant(`sha256-${picture}`),
            wavelengths: fc.constantFrom([400, 500, 600, 700], [380, 381, 540.5, 5000]),
            values: fc.array(fc.integer({ min: 1, max: 8 }).map(step => step / 8),
                             { minLength: 4, maxLength: 4 }),
            positions: triangle,
            normals: triangle,
            uvs: fc.array(number, { minLength: 6, maxLength: 6 }),
            indices: fc.constantFrom([0, 1, 2], [2, 1, 0], [0, 1, 2, 1, 0, 2]),
            width: side,
            height: side,
            samples: fc.integer({ min: 1, max: 4 }),
            region: fc.constantFrom([0, 0, 1, 1], [1, 0, 2, 3], [0, 1, 3, 2]),
            channel: fc.constantFrom("R", "G", "B", "A"),
            dither: fc.constantFrom(...Array(7).fill(false), true),
            gamma: fc.constantFrom(1, 1, 1, 2.2),
            layers: fc.constantFrom(["beauty"], ["diffuse", "specular", "emissive", "ambient"],
                                    ["normal", "position", "depth", "object"]),
        },
    };
}

// Without an image of their own, scenes have more pixels than the daemon's limit.
const sized = {
    ...schema,
    required: [...schema.required, "image"],
    $defs: { ...schema.$defs, Image: { ...schema.$defs.Image, required: ["width", "height"] } },
};

// A schema cannot say which presets are of which model, nor what facets can send each other for ever: most
// materials have a preset of their own model, or none, and most that are simulated send on less than arrives.
function calmMaterials(value, materials) {
    if (!value || typeof value !== "object") return value;
    if (Array.isArray(value)) return value.map(item => calmMaterials(item, materials));
    const calm = { ...value };
    const named = materials.find(entry => entry.name === value.preset);
    const model = value.model ?? (value.fresnel || value.lobes?.[0]?.roughness !== undefined ? "cook-torrance" :
        value.sigma !== undefined ? "oren-nayar" : "phong");
    const other = materials.find(entry => entry.model === model);
    if (named && model !== named.model) {
        delete calm.preset;
        if (other) Object.assign(calm, { model, preset: other.name });
    }
    if (value.microgeometry && "diffuse" in value && typeof value.diffuse !== "string") calm.diffuse = 0.5;
    return Object.fromEntries(Object.entries(calm).map(([key, item]) => [key, calmMaterials(item, materials)]));
}

const has = (value, test) => test(value) ||
    (value !== null && typeof value === "object" && Object.values(value).some(item => has(item, test)));
const member = (name, test = () => true) => value => value !== null && typeof value === "object" &&
    Object.hasOwn(value, name) && test(value[name]);

// Nor can it say what patterns and pictures may not be with, nor environments, nor which pictures there are: most
// scenes have what goes together, and most meshes by name have one that is there.
function calmScene(scene) {
    const calm = structuredClone(scene);
    const objects = Array.isArray(calm.objects) ? calm.objects : [];
    const shared = Object.keys(calm.meshes ?? {})[0];
    for (const object of objects)
        if (object.mesh !== undefined && shared !== undefined) object.mesh = shared;
        else if (object.mesh !== undefined) { delete object.mesh; object.type = "sphere"; }
    if (has(calm, member("pattern")) || has(calm, member("texture"))) {
        delete calm.spectral;
        delete calm.interpolation;
        delete calm.trace;
        for (const object of objects) {
            delete object.interpolation;
            if (["mesh", "teapot", "ball"].includes(object.type)) object.material = {};
            if (object.material?.microgeometry) object.material = { diffuse: object.material.diffuse ?? 1 };
        }
    }
    if (!Array.isArray(calm.lights)) return calm;
    const others = has(calm, member("microgeometry")) || has(calm, member("preset")) ||
        objects.some(object => typeof object.material === "string");
    const around = calm.lights.filter(light => light.type === "environment");
    if (around.length && others) calm.lights = calm.lights.filter(light => light.type !== "environment");
    around.forEach((light, i) => {
        if (i) delete light.visible;
        if (light.map !== "studio") light.map = "sky"; /* there are no pictures */
    });
    return calm;
}

// Environments are integrated for a second a picture where the tier is exact, and for minutes by a sanitized
// daemon: tests/property/environment.c is their test there.
function withoutSlowLight(scene) {
    const slow = process.env.SHADED_SANITIZE || JSON.stringify(scene.accuracy ?? {}) !== "{}";
    if (!slow || !Array.isArray(scene.lights)) return scene;
    return { ...scene, lights: scene.lights.filter(light => light?.type !== "environment") };
}

export async function sceneArbitrary(daemon) {
    const known = await hints(daemon);
    const { materials } = JSON.parse((await daemon.ask({ method: "GET", path: "/v1/materials" })).body);
    const calmed = scene => calmScene(calmMaterials(scene, materials));
    const calm = new Values(sized, known).of(sized);
    const wild = new Values(sized, { ...known, wild: true }).of(sized);
    return fc.oneof({ arbitrary: calm.map(scene => withoutSlowLight(calmed(scene))), weight: 3 },
                    { arbitrary: wild.map(withoutSlowLight), weight: 1 });
}

export function* places(value, path = []) {
    yield path;
    if (value && typeof value === "object")
        for (const key of Object.keys(value)) yield* places(value[key], [...path, key]);
}

const at = (document, path) => path.reduce((value, key) => value[key], document);

// {scene, path}: a scene with one mistake, mostly, at `path`.
export function mutantArbitrary(scenes) {
    const value = fc.oneof(fc.jsonValue({ maxDepth: 1 }),
                           fc.constantFrom(null, true, -1, 0, 1.5, 181, "", "zzz", "phong", "#12345",
                                           [], {}, [0, 0, 0], [1, 2], "mesh", "exr", "half"));
    const change = fc.record({ how: fc.constantFrom("set", "set", "remove", "add", "repeat"), value,
                               name: fc.constantFrom("type", "zzz", "name", "matrix", "", "a/b~c") });
    return fc.tuple(scenes, fc.nat(), change).map(([original, choice, { how, value, name }]) => {
        const scene = structuredClone(original);
        const all = [...places(scene)].slice(1);
        const path = all[choice % all.length];
        const holder = at(scene, path.slice(0, -1)), key = path.at(-1), old = holder[key];
        if (how === "add" && old && typeof old === "object" && !Array.isArray(old)) old[name] = value;
        else if (how === "repeat" && Array.isArray(old) && old.length) old.push(old[0]);
        else if (how === "remove" && !Array.isArray(holder)) delete holder[key];
        else holder[key] = value;
        return { scene, path };
    });
}

// Whether a JSON Pointer leads to something in the document, or to where a member is missing.
export function leadsSomewhere(document, pointer) {
    const keys = pointer.split("/").slice(1)
        .map(key => key.replaceAll("~1", "/").replaceAll("~0", "~"));
    let value = document;
    return keys.every((key, i) => {
        if (!value || typeof value !== "object") return false;
        value = Object.hasOwn(value, key) ? value[key] : undefined;
        return value !== undefined || i === keys.length - 1;
    });
}
