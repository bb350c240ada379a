// What must not change an answer, and what an entity tag promises.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { Daemon } from "./daemon.mjs";
import { fc, holds } from "./packages.mjs";
import { keepMesh, keepPicture, sceneArbitrary } from "./scenes.mjs";

// One renders everything anew, one has what earlier requests left.
let daemon, keeping, scenes;

before(async () => {
    daemon = await Daemon.start("--response-cache", "0", "--reuse", "0");
    keeping = await Daemon.start();
    scenes = await sceneArbitrary(daemon);
    await keepMesh(keeping);
    await keepPicture(keeping);
});
after(async () => {
    await daemon.stop();
    await keeping.stop();
});

const tagOf = answer => answer.headers.get("etag")?.[0];

function assertSame(first, again) {
    assert.equal(again.status, first.status);
    assert.equal(tagOf(again), tagOf(first));
    assert.ok(again.body.equals(first.body));
}

// Members in another order, at every depth.
function shuffled(value, pick) {
    if (Array.isArray(value)) return value.map(item => shuffled(item, pick));
    if (!value || typeof value !== "object") return value;
    const entries = Object.entries(value).map(([key, item]) => [pick(), key, shuffled(item, pick)]);
    entries.sort((a, b) => a[0] - b[0]);
    return Object.fromEntries(entries.map(([, key, item]) => [key, item]));
}

test("the same request gets the same bytes, and 304 where the client has them", async () => {
    let pictures = 0;
    await holds(50, scenes, async scene => {
        const first = await daemon.post("/v1/render", scene);
        for (const other of [daemon, keeping, keeping])
            assertSame(first, await other.post("/v1/render", scene));
        if (first.status !== 200) return;
        pictures++;
        for (const [tags, status] of [[tagOf(first), 304], [`"a", W/${tagOf(first)}`, 304], ["*", 200],
                                      ['"0123456789abcdef"', 200]]) {
            const answer = await daemon.post("/v1/render", scene, { "If-None-Match": tags });
            assert.equal(answer.status, status, tags);
            assert.equal(tagOf(answer), tagOf(first));
            assert.ok(status === 304 ? !answer.body.length : answer.body.equals(first.body));
        }
    });
    assert.ok(pictures > 10);
});

test("neither blanks nor the order of members change the picture or its tag", async () => {
    await holds(80, fc.tuple(scenes, fc.infiniteStream(fc.nat()), fc.constantFrom(0, 1, "\t", "\r\n  ")),
                async ([scene, order, indent]) => {
        const first = await daemon.post("/v1/render", scene);
        const other = shuffled(scene, () => order.next().value);
        const again = await daemon.post("/v1/render", ` ${JSON.stringify(other, null, indent)}\n`);
        if (first.status === 200) assertSame(first, again);
        else assert.equal(again.status, first.status);
    });
});

test("names, unused materials and spelled out defaults change neither", async () => {
    // Zeros are not black in ACEScct, HLG and in what integers store of YIQ.
    const black = scenes.filter(scene => !/^ACEScct$|HLG| file$/.test(scene.colorSpace));
    await holds(60, black, async scene => {
        const first = await daemon.post("/v1/render", scene);
        const again = await daemon.post("/v1/render", {
            $schema: "scene.schema.json", interpolation: "phong", ambient: 0, accuracy: {},
            background: [0, 0, 0], ...scene,
            materials: { ...scene.materials, "nobody's": { diffuse: 0.1 } },
            objects: scene.objects.map(object => ({ transform: {}, ...object, name: "one of them" })),
        });
        if (first.status === 200) assertSame(first, again);
        else assert.equal(again.status, first.status);
    });
});

test("other tags are other pictures", async () => {
    const known = new Map();
    await holds(100, scenes, async scene => {
        const answer = await daemon.post("/v1/render", scene);
        if (answer.status !== 200) return;
        const before = known.get(tagOf(answer));
        assert.ok(!before || before.equals(answer.body), "one tag, two pictures");
        known.set(tagOf(answer), answer.body);
    });
});

test("what Accept chooses is what output.format chooses", async () => {
    const types = { png: "image/png", jpeg: "image/jpeg", webp: "image/webp", tiff: "image/tiff",
                    exr: "image/x-exr", hdr: "image/vnd.radiance" };
    const plain = scenes.map(({ output, outputs, ...scene }) => scene);
    await holds(30, fc.tuple(plain, fc.constantFrom(...Object.keys(types))), async ([scene, format]) => {
        const named = await daemon.post("/v1/render", { ...scene, output: { format } });
        const chosen = await daemon.post("/v1/render", scene, { Accept: types[format] });
        assert.equal(chosen.status, named.status);
        if (named.status === 200) assert.ok(chosen.body.equals(named.body));
    });
});

test("HEAD has the fields of GET", async () => {
    for (const path of ["/", "/openapi.yaml", "/openapi.json", "/scene.schema.json", "/v1/version",
                        "/v1/materials"]) {
        const whole = await daemon.ask({ method: "GET", path });
        const head = await daemon.ask({ method: "HEAD", path });
        for (const name of ["etag", "content-type", "content-length", "cache-control"])
            assert.deepEqual(head.headers.get(name), whole.headers.get(name), `${path}: ${name}`);
        assert.equal(head.body.length, 0);
    }
});
