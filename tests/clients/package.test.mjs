// The npm package, as others get it: packed, installed from its file, type-checked, and asked for
// pictures by a daemon.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";

import { Daemon } from "../api/daemon.mjs";

const source = process.env.SHADED_SOURCE;
const folder = mkdtempSync(join(tmpdir(), "shaded-npm-"));
const scene = { objects: [{ type: "sphere" }], image: { width: 16, height: 16 } };
let daemon, shaded, module;

before(async () => {
    execFileSync(join(source, "api/npm/make"), [folder], { stdio: ["ignore", "ignore", "inherit"] });
    const [packed] = readdirSync(folder).filter(name => name.endsWith(".tgz"));
    writeFileSync(join(folder, "package.json"), '{"private": true, "type": "module"}');
    execFileSync("npm", ["install", "--offline", "--no-audit", "--no-fund", "--loglevel=error", `./${packed}`],
                 { cwd: folder });
    writeFileSync(join(folder, "use.js"), 'export * from "shaded-client";\n');
    module = await import(pathToFileURL(join(folder, "use.js")));
    daemon = await Daemon.start();
    shaded = new module.Shaded(`http://127.0.0.1:${daemon.port}/`);
});
after(async () => {
    await daemon?.stop();
    rmSync(folder, { recursive: true });
});

const digest = bytes => createHash("sha256").update(bytes).digest("hex");

test("only what it says is in it, and the element is the daemon's", async () => {
    const installed = join(folder, "node_modules/shaded-client");
    assert.deepEqual(readdirSync(installed).sort(),
                     ["LICENSE", "README.md", "client.d.ts", "client.js", "element.d.ts", "element.js",
                      "package.json", "schema.d.ts"]);
    const { version } = JSON.parse(readFileSync(join(installed, "package.json"), "utf8"));
    assert.equal((await shaded.version()).version, version);
    const served = await daemon.ask({ method: "GET", path: "/shaded-preview.js" });
    assert.equal(digest(readFileSync(join(installed, "element.js"))), digest(served.body));
});

test("a picture is the one that the daemon answers, and is not sent twice", async () => {
    const picture = await shaded.render(scene);
    const plain = await daemon.post("/v1/render", scene, { Accept: "image/png" });
    assert.equal(digest(Buffer.from(await picture.blob.arrayBuffer())), digest(plain.body));
    assert.equal(picture.type, "image/png");
    assert.match(picture.plan, /^tier=/);
    assert.equal(await shaded.render(scene, { etag: picture.etag }), null);
});

test("links draw the same picture", async () => {
    const picture = await shaded.render(scene);
    const linked = await fetch(await shaded.sceneUrl(scene));
    assert.equal(linked.status, 200);
    assert.equal(digest(Buffer.from(await linked.arrayBuffer())),
                 digest(Buffer.from(await picture.blob.arrayBuffer())));
    const preview = await fetch(shaded.previewUrl("brass", { size: 16, shape: "torus" }));
    assert.equal(preview.headers.get("Content-Type"), "image/png");
});

test("refusals say what is wrong, and where", async () => {
    await assert.rejects(shaded.render({ ...scene, objects: [{ type: "sphere", radius: -1 }] }), error => {
        assert.ok(error instanceof module.ShadedError);
        assert.equal(error.status, 422);
        assert.equal(error.problem.errors[0].pointer, "/objects/0/radius");
        return true;
    });
    await assert.rejects(shaded.request("v1/nothing"), { name: "ShadedError", status: 404 });
});

test("a request ends with its signal", async () => {
    const gone = AbortSignal.abort();
    await assert.rejects(shaded.render(scene, { signal: gone }), { name: "AbortError" });
});

test("all that is told can be asked for", async () => {
    assert.ok((await shaded.materials()).materials.some(({ name }) => name === "brass"));
    assert.ok((await shaded.shapes()).shapes.length > 5);
    assert.ok((await shaded.colorspaces()).spaces.length > 5);
    assert.ok((await shaded.version()).features.includes("trace"));
    for (const ask of ["explain", "compare", "analyze", "brdf"])
        assert.equal(typeof await shaded[ask](scene), "object", ask);
    assert.match((await shaded.keepScene(scene)).digest, /^[0-9a-f]{64}$/);
    const { blob } = await shaded.render(scene);
    const bytes = await blob.arrayBuffer(), kept = "sha256-" + digest(Buffer.from(bytes));
    for (const picture of [blob, bytes, new Uint8Array(bytes)])
        assert.equal(await shaded.keepPicture(picture), kept);
    assert.equal((await shaded.diff(scene, kept)).differing, 0);
    const batch = await shaded.batch({ scene, variants: [{}, {}] });
    assert.match(batch.headers.get("Content-Type"), /^multipart\/form-data/);
    assert.ok((await batch.arrayBuffer()).byteLength > 100);
});

test("types hold what is right, and refuse what is wrong", () => {
    writeFileSync(join(folder, "right.ts"), `
        import { Shaded, ShadedError, type Picture, type Scene } from "shaded-client";
        import { ShadedPreview, type Bound } from "shaded-client/element";
        import type { components } from "shaded-client/schema";
        const shaded = new Shaded("http://127.0.0.1:8080", { token: "abc" });
        const scene: Scene = { objects: [{ type: "torus", material: { preset: "gold" } }] };
        export const same: components["schemas"]["Scene"] = scene;
        export async function draw(): Promise<Blob> {
            const picture: Picture = await shaded.render(scene, { accept: "image/webp" });
            const names: string[] = (await shaded.version()).features ?? [];
            const again: Picture | null = await shaded.render(scene, { etag: picture.etag ?? names[0] });
            await shaded.diff(scene, await shaded.keepPicture(picture.blob));
            await shaded.batch({ scene, sweep: { "/objects/0/radius": [1, 2] } });
            return (again ?? picture).blob;
        }
        export function show(error: unknown): string {
            return error instanceof ShadedError ? error.problem.errors?.[0]?.pointer ?? error.message : "";
        }
        const element: ShadedPreview = document.createElement("shaded-preview");
        element.scene = scene;
        element.addEventListener("bound", event => {
            const bound: Bound = (event as CustomEvent<Bound>).detail;
            console.log(bound.error.linear, bound.lights?.used);
        });
        // @ts-expect-error no such shape
        shaded.render({ objects: [{ type: "blob" }] });
        // @ts-expect-error no such member
        shaded.explain({ objects: [], amibent: 0 });
        // @ts-expect-error what is told is no text
        export const text: string = shaded.materials();
        // @ts-expect-error no such suffix
        shaded.sceneUrl(scene, "exr");
    `);
    execFileSync(join(process.env.SHADED_PACKAGES, "node_modules/.bin/tsc"),
                 ["--noEmit", "--strict", "--target", "es2022", "--module", "nodenext", "--moduleResolution",
                  "nodenext", "--lib", "es2022,dom,dom.iterable", "right.ts"],
                 { cwd: folder, stdio: "inherit" });
});
