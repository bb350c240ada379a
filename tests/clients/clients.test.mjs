// What others make of the contract: linters find nothing in it, and generators make clients of it
// whose types every example has, and broken scenes have not.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";

const packages = process.env.SHADED_PACKAGES;
const load = createRequire(packages + "/");
const program = name => join(packages, "node_modules/.bin", name);
const contract = name => join(process.env.SHADED_SOURCE, "api", name);
const folder = mkdtempSync(join(tmpdir(), "shaded-clients-"));
after(() => rmSync(folder, { recursive: true }));

const examples = readdirSync(contract("examples")).filter(name => name.endsWith(".json"))
    .map(name => [name.replace(".json", ""), readFileSync(contract(`examples/${name}`), "utf8")]);

// Each is wrong in one way that types can tell.
const BROKEN = {
    noObjects: {},
    unknownMember: { objects: [], amibent: 0 },
    unknownShape: { objects: [{ type: "blob" }] },
    noType: { objects: [{ radius: 1 }] },
    otherShapesMember: { objects: [{ type: "box", radius: 1 }] },
    meshWithoutPositions: { objects: [{ type: "mesh" }] },
    unknownLight: { objects: [], lights: [{ type: "lamp" }] },
    noLight: { objects: [], lights: [{ intensity: 2 }] },
    otherLightsMember: { objects: [], lights: [{ type: "point", angle: 30 }] },
    otherCamerasMember: { objects: [], camera: { type: "orthographic", fov: 40 } },
    textForNumber: { objects: [{ type: "sphere", radius: "1" }] },
    unknownFormat: { objects: [], output: { format: "gif" } },
    namelessOutput: { objects: [], outputs: [{ format: "png" }] },
    noTier: { objects: [], accuracy: { tier: "best" } },
    meshByNumber: { objects: [{ type: "mesh", data: 1 }] },
    nullIndices: { objects: [{ type: "mesh", positions: [], indices: null }] },
};

// Also right, and in no example.
const SOUND = {
    smallest: { objects: [{ type: "sphere" }] },
    annotated: { $schema: "scene.schema.json", lights: [{ type: "ambient", name: "sky" }],
                 objects: [{ type: "plane", name: "ground" }] },
    homogeneous: { objects: [], lights: [{ position: [1, 1, 1, 0] }, { type: "point", position: [1, 2, 3] },
                                         { type: "spot", position: [1, 2, 3, 4] }] },
    transparent: { objects: [], background: null, output: { bitDepth: 16, quality: 3 } },
    region: { objects: [], image: { region: [0, 0, 1, 1] } },
    meshByName: { objects: [{ type: "mesh", data: `sha256-${"0".repeat(64)}`, material: "brass" }] },
    budget: { objects: [], accuracy: { maxError: 0.5 } },
};

// Type-checks scenes against `Scene`, as a line of TypeScript imports it.
function checkTypes(name, importScene) {
    const write = (file, text) => writeFileSync(join(folder, name, file), text);
    const scene = text => `${importScene}\nexport const scene: Scene = ${text};\n`;
    for (const [example, text] of examples) write(`example-${example}.ts`, scene(text));
    for (const [part, value] of Object.entries(SOUND)) write(`${part}.ts`, scene(JSON.stringify(value)));
    for (const [part, value] of Object.entries(BROKEN))
        write(`${part}.ts`, scene(JSON.stringify(value)).replace("export", "// @ts-expect-error\nexport"));
    const files = readdirSync(join(folder, name)).filter(file => file.endsWith(".ts"));
    assert.ok(files.length > examples.length + 20);
    execFileSync(program("tsc"), ["--noEmit", "--strict", "--target", "es2022", "--module", "esnext",
                                  "--moduleResolution", "bundler", "--lib", "es2022,dom,dom.iterable",
                                  ...files],
                 { cwd: join(folder, name), stdio: "inherit" });
}

test("redocly finds nothing", async () => {
    const { createConfig, lint } = load("@redocly/openapi-core");
    const config = await createConfig({ extends: ["recommended"] });
    for (const name of ["openapi.yaml", "openapi.json"]) {
        const found = await lint({ ref: contract(name), config });
        assert.deepEqual(found.map(({ ruleId, message }) => `${ruleId}: ${message}`), []);
    }
});

test("spectral finds nothing", async () => {
    const { Document, Spectral } = load("@stoplight/spectral-core");
    const { oas } = load("@stoplight/spectral-rulesets");
    const { Yaml } = load("@stoplight/spectral-parsers");
    const spectral = new Spectral();
    // Examples are held against their schemas by tests/conformance and tests/api. Here each takes minutes.
    spectral.setRuleset({ extends: [oas], rules: { "oas3-valid-media-example": "off", "oas3-valid-schema-example": "off" } });
    const found = await spectral.run(new Document(readFileSync(contract("openapi.yaml"), "utf8"), Yaml));
    assert.deepEqual(found.map(({ code, path, message }) => `${code}: ${path.join("/")}: ${message}`), []);
});

test("openapi-typescript makes types that the examples have", () => {
    mkdirSync(join(folder, "typescript"));
    execFileSync(program("openapi-typescript"), [contract("openapi.yaml"), "-o",
                                                 join(folder, "typescript/api.ts")]);
    checkTypes("typescript", 'import type { components } from "./api";\n' +
                             'type Scene = components["schemas"]["Scene"];');
});

test("hey-api makes a client whose types the examples have", () => {
    mkdirSync(join(folder, "hey"));
    execFileSync(program("openapi-ts"), ["-i", contract("openapi.json"), "-o", join(folder, "hey/client"),
                                         "--no-log-file"], { cwd: folder });
    writeFileSync(join(folder, "hey/render.ts"), `
        import { render, type Scene } from "./client";
        export const draw = (body: Scene) => render({ body, baseUrl: "http://127.0.0.1:8080" });\n`);
    checkTypes("hey", 'import type { Scene } from "./client";');
});

// quicktype's classes leave out members that are null. JSON.stringify makes -0 a 0.
const withoutNulls = value =>
    JSON.parse(JSON.stringify(value, (key, item) => item === null ? undefined : item));

test("quicktype makes Python classes that carry the examples through", async () => {
    const { FetchingJSONSchemaStore, InputData, JSONSchemaInput, quicktype } = load("quicktype-core");
    const source = new JSONSchemaInput(new FetchingJSONSchemaStore());
    await source.addSource({ name: "Scene", schema: readFileSync(contract("scene.schema.json"), "utf8") });
    const inputData = new InputData();
    inputData.addInput(source);
    const { lines } = await quicktype({ inputData, lang: "python",
                                        rendererOptions: { "python-version": "3.7" } });
    writeFileSync(join(folder, "scene.py"), lines.join("\n"));
    const script = "import json, scene, sys\n" +
        "for text in json.load(sys.stdin): print(json.dumps(scene.scene_to_dict(scene.scene_from_dict(text))))";
    const input = JSON.stringify(examples.map(([, text]) => JSON.parse(text)));
    const output = execFileSync("python3", ["-B", "-c", script], { cwd: folder, input, encoding: "utf8" });
    const back = output.trim().split("\n").map(line => JSON.parse(line));
    for (const [i, [name, text]] of examples.entries())
        assert.deepEqual(withoutNulls(back[i]), withoutNulls(JSON.parse(text)), name);
});
