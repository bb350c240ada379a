// The studio in a browser: what its controls do to the picture, and what is told of mistakes.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import http from "node:http";
import { once } from "node:events";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, describe, test } from "node:test";
import { isDeepStrictEqual } from "node:util";
import { inflateRawSync } from "node:zlib";

import { axeSource, CHROMIUM, readExr, startBrowser, startDaemon, Studio } from "./page.mjs";

const SCENE = {
    image: { width: 128, height: 128, samples: 4 },
    lights: [{ type: "directional", direction: [0.5, -0.5, -1] }],
    objects: [{ type: "sphere", material: { diffuse: [0.5, 0.1, 0.1], specular: 0.6, shininess: 20 } }],
};
const with_ = (path, value) => {
    const scene = structuredClone(SCENE), keys = path.split("/").slice(1), last = keys.pop();
    keys.reduce((at, key) => at[key] ??= {}, scene)[last] = value;
    return scene;
};
// STUDIO_SECONDS=30 is the long form.
const SECONDS = Number(process.env.STUDIO_SECONDS ?? 5);
const sum = list => list.reduce((a, b) => a + b, 0);

describe("the studio", { skip: CHROMIUM ? false : "chromium is not installed" }, () => {
    let browser, daemon, origin, studio;

    before(async () => {
        daemon = await startDaemon();
        origin = `http://127.0.0.1:${daemon.port}`;
        browser = await startBrowser();
        studio = await Studio.open(browser, origin);
    });
    after(async () => {
        try {
            await studio?.close();
        } finally {
            await browser?.close();
            await daemon?.stop();
        }
    });

    const material = "/objects/0/material";
    // The picture before and after something is done to a scene.
    async function change(scene, act) {
        await studio.set(scene);
        const before = await studio.look();
        await act();
        return [before, await studio.look(), await studio.scene()];
    }

    test("opens with a picture, and says how long that took", async () => {
        const fresh = await browser.newContext(), page = await fresh.newPage();
        await page.goto(origin);
        await page.waitForFunction(() => performance.getEntriesByName("first picture").length);
        const took = await page.evaluate(() => Math.round(performance.getEntriesByName("first picture")[0]?.startTime ?? 0));
        console.log(`first picture after ${took} ms`);
        assert.ok(took > 0);
        await fresh.close();
    });

    test("what a color, a number and a slider of the material do", async () => {
        await studio.tab("material");
        let [old, now, scene] = await change(SCENE, () => studio.type(`${material}/diffuse`, "0.05, 0.1, 0.8"));
        assert.ok(old.middle[0] > old.middle[2] && now.middle[2] > now.middle[0], `${old.middle} ${now.middle}`);
        assert.deepEqual(scene.objects[0].material.diffuse, [0.05, 0.1, 0.8]);
        [old, now] = await change(SCENE, () => studio.type(`${material}/shininess`, "200"));
        assert.ok(now.bright < old.bright / 3, "a higher exponent is a smaller highlight");
        [old, now, scene] = await change(SCENE, () => studio.row(`${material}/specular`).locator(".slider").fill("0"));
        assert.ok(now.bright < old.bright / 3 && scene.objects[0].material.specular === 0);
        [old, now] = await change(SCENE, () => studio.type(`${material}/emissive`, "#004000"));
        assert.ok(now.mean[1] > old.mean[1] + 5 && Math.abs(now.mean[0] - old.mean[0]) < 2);
        [old, now, scene] = await change(with_("/ambient", 0.4), () => studio.type(`${material}/ambient`, "0, 0.9, 0"));
        assert.ok(now.mean[1] > old.mean[1] + 10 && scene.objects[0].material.ambient[1] === 0.9);
        [old, now] = await change(with_("/trace", { depth: 2 }), () => studio.type(`${material}/opacity`, "0.3"));
        assert.ok(now.mean[0] < old.mean[0], "what is less opaque shows the black behind");
        await studio.row(`${material}/opacity`).hover();
        await studio.row(`${material}/opacity`).locator(".reset").click();
        assert.equal((await studio.look()).hash, old.hash, "back to the default");
    });

    test("every member of every model has a control, and every model its picture", async () => {
        await studio.tab("material");
        const api = JSON.parse((await daemon.ask({ method: "GET", path: "/openapi.json" })).body);
        const schemas = api.components.schemas, hashes = new Set();
        for (const model of schemas.Model.enum) {
            await studio.set(SCENE);
            await studio.choose(`${material}/model`, model);
            const { $ref } = schemas.Material.anyOf.find(({ $ref }) => {
                const own = schemas[$ref.split("/").pop()].properties.model;
                return (own.const ?? schemas[own.$ref?.split("/").pop()]?.enum ?? "").includes(model) || own.const === model;
            });
            for (const name of Object.keys(schemas[$ref.split("/").pop()].properties))
                if (name !== "model" && name !== "preset")
                    assert.ok(await studio.page.locator(`#panel-material [data-pointer="${material}/${name}"]`).count(), `${model}: ${name}`);
            const { hash } = await studio.look();
            assert.equal(await studio.page.locator(".stage.is-wrong").count(), 0, model);
            hashes.add(hash);
        }
        assert.ok(hashes.size >= 5, "models differ");
        await studio.set(with_(material, { model: "oren-nayar", diffuse: 0.6 }));
        const dull = await studio.look();
        await studio.type(`${material}/sigma`, "80");
        assert.ok((await studio.look()).mean[0] < dull.mean[0]);
        await studio.set(with_(material, { model: "cook-torrance", diffuse: 0.1 }));
        const narrow = await studio.look();
        await studio.page.click(`[data-pointer="${material}/lobes"] .quiet`);
        await studio.type(`${material}/lobes/0/roughness`, "0.6");
        assert.notEqual((await studio.look()).hash, narrow.hash);
        await studio.choose(`${material}/fresnel`, "f0");
        assert.deepEqual(Object.keys((await studio.scene()).objects[0].material.fresnel), ["f0"]);
    });

    test("what traced rays show follows their controls", async () => {
        const small = { image: { width: 96, height: 96, samples: 1 }, camera: { position: [0, 0, 4] }, trace: { depth: 4 }, lights: [] };
        const lamp = (x, z, side) => ({ type: "box", material: { emissive: 1.2 }, transform: { scale: side, translate: [x, 0, z] } });
        const ball = more => ({ type: "sphere", material: { diffuse: 0, specular: 0, ...more } });
        // A ball of glass before a lamp that is hidden but for the ball, to the left of the middle.
        const glass = { ...small, objects: [ball({ transmission: 0.7, ior: 1.5 }), lamp(-0.4, -3, 0.3)] };
        await studio.tab("material");
        let [old, now] = await change(glass, () => studio.type(`${material}/ior`, "1"));
        assert.ok(old.brightX > 0.52 && now.brightX < 0.48, `a ball of glass turns the picture around: ${old.brightX} ${now.brightX}`);
        [old, now] = await change(glass, () => studio.type(`${material}/transmission`, "0.9"));
        assert.ok(sum(now.mean) > 1.1 * sum(old.mean), `${old.mean} ${now.mean}`);
        await studio.tab("scene");
        await studio.set(glass);
        await studio.page.click('[data-group="Rays"] > summary');
        [old, now] = await change(glass, () => studio.type("/trace/depth", "1"));
        assert.ok(sum(old.mean) > 1 && sum(now.mean) < 0.1 * sum(old.mean), "a path that ends in the glass brings nothing");
        // A mirror before a lamp behind the camera.
        const mirror = { ...small, objects: [ball({ reflection: 0.3 }), lamp(0, 8, 4)] };
        await studio.tab("material");
        [old, now] = await change(mirror, () => studio.type(`${material}/reflection`, "0.8"));
        assert.ok(now.middle[0] > old.middle[0] + 40 && old.middle[0] > 40, `${old.middle} ${now.middle}`);
        await studio.tab("scene");
        [old, now] = await change(mirror, () => studio.type("/trace/minContribution", "0.5"));
        assert.ok(old.middle[0] > 40 && now.middle[0] === 0, "0.3 is below 0.5");
        // The half-shadow of a square lamp.
        const square = { type: "rect", position: [0, 3, 0], direction: [0, -1, 0], size: [2, 2], intensity: 6 };
        const shade = { ...small, camera: { position: [0, 4, 6] }, trace: { shadows: true, shadowSamples: 1024 }, lights: [square],
                        objects: [{ type: "sphere", material: { diffuse: 0.6 }, transform: { scale: 0.5 } },
                                  { type: "plane", material: { diffuse: 0.6 }, transform: { translate: [0, -1, 0] } }] };
        await studio.set(shade);
        const truth = await studio.reds(), off = [];
        for (const samples of [1, 16, 256]) {
            await studio.type("/trace/shadowSamples", samples);
            off.push(sum((await studio.reds()).map((red, i) => Math.abs(red - truth[i]))));
        }
        await studio.page.click('[data-group="Rays"] > summary'); // folded, as other tests find it
        assert.ok(off[0] > 2 * off[1] && off[1] > 2 * off[2] && off[2] > 0, `more points of the lamp, less error: ${off}`);
    });

    // Controls that change nothing in a picture of eight bits as PNG, and why.
    const IDLE = [/^\/output\/(quality|effort|matte)$/ /* of other formats, and of opaque pictures */, /segments$/ /* the surface is smooth */,
                  /minDistance$/ /* nothing is nearer */, /transform\/rotate$/ /* of a ball */, /lights\/\d\/up$/ /* of a square */];
    test("every slider and every vector of every tab changes the picture", async () => {
        const one = await Studio.open(browser, origin); // of its own: everything in it is unfolded
        const small = { image: { width: 48, height: 48, samples: 1 }, ambient: 0.1, background: 0.2, camera: { position: [0, 0.5, 4] }, trace: { shadows: true, depth: 2, shadowSamples: 2 } };
        const { trace, ...bare } = small;
        const key = { type: "spot", position: [-1, 1.5, 3], direction: [1, -1.5, -3], angle: 20, exponent: 2, attenuation: [1, 0.05, 0.01] };
        const sphere = { type: "sphere", material: { diffuse: [0.5, 0.2, 0.1], specular: 0.5, shininess: 20, opacity: 0.7, reflection: 0.2, transmission: 0.2, ior: 1.5 } };
        const globe = { type: "sphere", radius: 1, position: [2, 2, 1], intensity: 3 };
        const around = [{ type: "box", transform: { translate: [-0.5, 0, -3] } }, { type: "plane", transform: { translate: [0, -1, 0] } }];
        const scenes = {
            "material lights scene color": { ...small, lights: [key, globe], objects: [sphere, ...around] },
            material: { ...small, lights: [key], objects: [{ type: "torus", material: { model: "cook-torrance", diffuse: 0.2, fresnel: { n: 1.3, k: 2 }, lobes: [{ roughness: 0.4, weight: 0.7 }, { roughness: 0.1, weight: 0.2 }] } }] },
            "material ": { ...small, lights: [key], objects: [{ type: "box", material: { model: "oren-nayar", diffuse: 0.5, sigma: 30 } }] },
            lights: { ...bare, lights: ["rect", "disc", "sphere"].map(type => ({ type, position: [-2, 2, 3], ...(type === "sphere" ? {} : { direction: [2, -2, -3] }), intensity: 3 })), objects: [sphere] },
            scene: { ...small, camera: { ...small.camera, type: "orthographic", height: 2 }, lights: [key, globe], objects: [{ ...sphere, type: "torus" }, ...around] },
        };
        const moved = new Set();
        for (const [tabs, scene] of Object.entries(scenes)) {
            const idle = scene.objects[0].material.transmission ? IDLE : [...IDLE, /\/ior$/ /* nothing is seen through */];
            await one.set(scene);
            const { hash, width, height } = await one.look();
            for (const tab of tabs.trim().split(" ")) {
                await one.tab(tab);
                await one.page.evaluate(name => document.querySelectorAll(`#panel-${name} details`).forEach(part => { part.open = true; }), tab);
                const pointers = await one.page.locator(`#panel-${tab} .row:is(:has(.slider), :has(.vector))[data-pointer]`).evaluateAll(list => list.map(row => row.dataset.pointer));
                for (const pointer of pointers.filter(pointer => !idle.some(one => one.test(pointer)))) {
                    const slider = one.row(pointer).locator(".slider"), field = one.row(pointer).locator(".vector .number").first();
                    if (!await slider.count()) {
                        await field.fill(String(Number(await field.inputValue()) + 0.4));
                        await field.press("Enter");
                    } else if (await slider.isEnabled()) {
                        await slider.fill(Number(await slider.inputValue()) > 0.5 ? "0.2" : "0.8");
                        await slider.dispatchEvent("change");
                    } else continue;
                    const now = await one.look();
                    assert.ok(now.hash !== hash || now.width !== width || now.height !== height, `${pointer} of ${tab} changes nothing`);
                    moved.add(pointer);
                    await one.set(scene);
                }
            }
        }
        assert.ok(moved.size >= 45, `${moved.size}: ${[...moved].join(" ")}`);
        await one.close();
        console.log(`${moved.size} sliders and vectors`);
    });

    test("a lobe is added and taken away", async () => {
        const [old, now] = await change(SCENE, async () => {
            await studio.tab("material");
            await studio.page.click(`[data-pointer="${material}/lobes"] .quiet`);
            await studio.type(`${material}/lobes/0/specular`, "0.9");
        });
        assert.ok(now.bright > old.bright);
        await studio.page.click(`[data-pointer="${material}/lobes"] .icon-button[aria-label="Remove lobe 1"]`);
        assert.equal((await studio.look()).hash, old.hash);
    });

    test("numbers of a highlight become patterns and pictures, and one number again", async () => {
        await studio.tab("material");
        const pick = (pointer, value) => studio.page.locator(`[data-pointer="${pointer}"] select`).selectOption(value).then(() => studio.settled());
        const at = `${material}/shininess`;
        studio.expected.push(/status of 422.*brdf/s, /status of 409/); // no lobe to plot, and no such picture
        const [old, now, scene] = await change(SCENE, () => pick(at, "checker"));
        assert.deepEqual(scene.objects[0].material.shininess, { pattern: "checker", values: [20, 5], uv: { scale: 8 } });
        assert.notEqual(now.hash, old.hash);
        assert.equal(await studio.page.locator(".stage.is-wrong").count(), 0);
        await studio.type(`${at}/values`, 90);
        await pick(at, "grid");
        assert.deepEqual((await studio.scene()).objects[0].material.shininess, { pattern: "grid", values: [20, 90], width: 0.15, uv: { scale: 8 } });
        const lines = await studio.look();
        await studio.row(`${at}/width`).locator(".slider").fill("0.5");
        await studio.settled();
        assert.ok(Math.abs((await studio.scene()).objects[0].material.shininess.width - 0.5) < 0.01);
        assert.notEqual((await studio.look()).hash, lines.hash);
        await pick(at, "texture");
        assert.equal(await studio.row(`${at}/texture`).locator("xpath=self::*[contains(@class, 'is-wrong')]").count(), 1, "a picture that is not here is told where it is named");
        await pick(at, "");
        assert.equal((await studio.scene()).objects[0].material.shininess, undefined);
        assert.equal(await studio.row(at).locator(".number").inputValue(), "32");
        const facets = { model: "cook-torrance", lobes: [{ roughness: 0.4 }] };
        await studio.set(with_(material, facets));
        await pick(`${material}/lobes/0/roughness`, "noise");
        assert.deepEqual((await studio.scene()).objects[0].material.lobes, [{ roughness: { pattern: "noise", values: [0.4, 0.1], uv: { scale: 12 } } }]);
        assert.equal(await studio.page.locator(".stage.is-wrong").count(), 0);
        await studio.set(SCENE);
    });

    test("the library gives its materials", async () => {
        await studio.tab("material");
        await studio.set(SCENE);
        await studio.page.click('.thumb[data-name="jade"]');
        let now = await studio.look();
        assert.deepEqual((await studio.scene()).objects[0].material, { preset: "jade" });
        assert.ok(now.middle[1] > now.middle[0] && now.middle[1] > now.middle[2], String(now.middle));
        await studio.page.keyboard.press("ArrowRight");
        assert.notEqual((await studio.scene()).objects[0].material.preset, "jade");
        await studio.type(`${material}/diffuse`, "#ff0000");
        assert.ok((await studio.scene()).objects[0].material.preset);
        await studio.page.fill(".search", "rubber");
        const names = await studio.page.locator(".thumb:visible").evaluateAll(list => list.map(one => one.dataset.name));
        assert.ok(names.length > 2 && names.every(name => name.includes("rubber")));
        await studio.page.fill(".search", "");
        await studio.page.waitForFunction(() => document.querySelector('.thumb[data-name="brass"] shaded-preview').plan);
    });

    test("lights are added, moved, changed and taken away", async () => {
        await studio.tab("lights");
        let [old, now, scene] = await change(SCENE, () => studio.type("/lights/0/intensity", "0.2"));
        assert.ok(sum(now.mean) < sum(old.mean) * 0.7);
        [old, now] = await change(SCENE, () => studio.type("/lights/0/color", "#0000ff"));
        assert.ok(now.mean[2] > now.mean[0]);
        [old, now, scene] = await change(SCENE, async () => studio.drag(studio.page.locator(".ball").first(), 26, 0));
        assert.ok(now.brightX > old.brightX + 0.1, `${old.brightX} ${now.brightX}`);
        assert.ok(scene.lights[0].direction[0] < 0, "light from the right travels to the left");
        [old, now] = await change(SCENE, async () => {
            await studio.page.locator(".ball").first().focus();
            for (let i = 0; i < 8; i++) await studio.page.keyboard.press("ArrowDown");
        });
        assert.ok(now.brightY > old.brightY + 0.05);
        const types = ["ambient", "point", "spot", "rect", "disc", "sphere", "environment"];
        for (const type of types) {
            [old, now, scene] = await change(with_("/lights", []), async () => studio.page.selectOption('select[aria-label="Add a light"]', type));
            assert.equal(scene.lights[0].type, type);
            assert.ok(sum(now.mean) > sum(old.mean), `${type} shines`);
        }
        [old, now, scene] = await change(SCENE, () => studio.page.selectOption('select[aria-label="Type of Light 1"]', "spot"));
        assert.deepEqual([scene.lights[0].type, scene.lights[0].position?.length], ["spot", 3]);
        for (const [type, map] of [["environment", "studio"], ["spot", undefined]]) {
            [old, now, scene] = await change(SCENE, () => studio.page.selectOption('select[aria-label="Type of Light 1"]', type));
            assert.deepEqual([scene.lights[0].map, scene.lights[0].position?.length], [map, map ? undefined : 3]);
        }
        await studio.page.click(".light summary");
        await studio.type("/lights/0/angle", "8");
        assert.ok(sum((await studio.look()).mean) < sum(now.mean), "a smaller cone");
        await studio.type("/lights/0/penumbra", "1");
        await studio.page.click('[aria-label="Remove Light 1"]');
        assert.deepEqual((await studio.scene()).lights, []);
        assert.equal(sum((await studio.look()).mean), 0);
    });

    test("shapes, the camera, the picture and rays", async () => {
        await studio.tab("scene");
        const hashes = new Set();
        for (const shape of ["Plane", "Disc", "Box", "Cylinder", "Cone", "Torus", "Sphere"]) {
            await studio.set(with_("/camera", { position: [0, 1.5, 4] }));
            await studio.page.click(`.chip-choice:has-text("${shape}")`);
            hashes.add((await studio.look()).hash);
            assert.equal((await studio.scene()).objects[0].type, shape.toLowerCase());
        }
        assert.equal(hashes.size, 7);
        let [old, now, scene] = await change(SCENE, () => studio.type("/objects/0/radius", "0.5"));
        assert.ok(Math.abs(now.object / old.object - 0.25) < 0.05, "half the radius, a quarter of the area");
        [old, now] = await change(SCENE, async () => {
            await studio.page.click('[data-group="Camera"] > summary');
            await studio.type("/camera/fov", "80");
        });
        assert.ok(now.object < old.object / 3);
        [old, now, scene] = await change(SCENE, async () => {
            await studio.page.click('[data-group="Picture"] > summary');
            await studio.type("/image/width", "200");
        });
        assert.deepEqual([now.width, now.height, scene.image.width], [200, 128, 200]);
        [old, now] = await change(SCENE, () => studio.type("/background", "#123456"));
        assert.deepEqual(now.corner.slice(0, 3), [0x12, 0x34, 0x56]);
        [old, now, scene] = await change({ ...SCENE, lights: [{ type: "directional", direction: [0.3, -1, -0.3] }], camera: { position: [0, 1.5, 4] } }, async () => {
            await studio.page.click('.row:has(> .row-label:text-is("Ground")) .toggle');
            await studio.settled();
        });
        assert.ok(now.object > old.object && scene.objects[1].type === "plane");
        await studio.page.click('[data-group="Rays"] > summary');
        await studio.switch("/trace/shadows");
        const shaded = await studio.look();
        assert.ok(sum(shaded.mean) < sum(now.mean), "the ball throws a shadow");
        await studio.page.click('[data-group="Light and color"] > summary');
        [old, now] = await change(SCENE, () => studio.type("/ambient", "0.5"));
        assert.ok(sum(now.mean) > sum(old.mean));
    });

    test("the camera turns by drag and keys, and comes closer by the wheel", async () => {
        const stage = studio.page.locator("#stage");
        const lit = { ...SCENE, objects: [{ type: "box", material: { diffuse: 0.6 } }] };
        let [old, now, scene] = await change(lit, () => studio.drag(stage, 120, 0));
        assert.ok(scene.camera.position[0] < -0.5, `dragged to the right, the camera goes to the left: ${scene.camera.position}`);
        assert.notEqual(now.hash, old.hash);
        [old, now, scene] = await change(lit, () => studio.drag(stage, 0, 120));
        assert.ok(scene.camera.position[1] > 0.5, "dragged down, it rises");
        [old, now] = await change(SCENE, async () => {
            await stage.hover();
            await studio.page.mouse.wheel(0, -400);
            await studio.page.waitForFunction(() => studio.store.scene.camera);
        });
        assert.ok(now.object > old.object * 1.3);
        [old, now] = await change(SCENE, async () => { await stage.focus(); await studio.page.keyboard.press("-"); });
        assert.ok(now.object < old.object);
        await studio.page.keyboard.press("Home");
        assert.equal((await studio.scene()).camera, undefined);
        [old, now, scene] = await change(lit, async () => { await stage.focus(); await studio.page.keyboard.press("ArrowLeft"); });
        assert.ok(scene.camera.position[0] !== 0 && now.hash !== old.hash);
    });

    test("displays, views, spaces, channels and adjustments", async () => {
        await studio.tab("color");
        let [old, now, scene] = await change(SCENE, () => studio.choose("/output/view", "Raw"));
        assert.ok(sum(now.mean) < sum(old.mean), "linear values are darker than their codes");
        [old, now, scene] = await change(SCENE, () => studio.choose("/output/display", "Rec.1886"));
        assert.equal(scene.output.display, "Rec.1886");
        assert.notEqual(now.hash, old.hash);
        assert.equal(await studio.row("/output/exposure").locator(".number").inputValue(), "0", "the default that is told in words");
        [old, now] = await change(SCENE, () => studio.type("/output/exposure", "1"));
        assert.ok(sum(now.mean) > sum(old.mean) * 1.2);
        [old, now] = await change(SCENE, () => studio.type("/output/gamma", "2"));
        assert.ok(sum(now.mean) > sum(old.mean));
        [old, now, scene] = await change(SCENE, async () => {
            await studio.page.click('.segments[aria-label="Shown as"] label:has-text("Color space")');
            await studio.page.click('.segments[aria-label="Channel"] label:has-text("Y")');
        });
        assert.deepEqual(scene.output, { colorSpace: "YIQ", channel: "Y" });
        assert.deepEqual(new Set(now.middle.slice(0, 3)).size, 1, "a grey picture");
        [old, now, scene] = await change({ ...SCENE, output: { colorSpace: "YIQ" } }, () => studio.choose("/output/colorSpace", "HSV"));
        assert.equal(scene.output.colorSpace, "HSV");
        assert.notEqual(now.hash, old.hash);
        [old, now, scene] = await change(SCENE, () => studio.choose("/workingSpace", "ACEScg"));
        assert.equal(scene.workingSpace, "ACEScg");
    });

    test("tiers and budgets, their bounds, times and measured errors", async () => {
        await studio.set(SCENE);
        const figures = () => studio.page.locator(".stat dd").allTextContents();
        const standard = await figures();
        await studio.page.click('.segments[aria-label="Accuracy"] label:has-text("Exact")');
        await studio.settled();
        assert.deepEqual((await studio.scene()).accuracy, { tier: "exact" });
        const exact = await figures();
        assert.equal(exact[1], "≤ 0");
        assert.notEqual(exact[0], standard[0]);
        await studio.page.click('.segments[aria-label="Accuracy"] label:has-text("Budget")');
        await studio.settled();
        assert.equal((await studio.scene()).accuracy.maxError, 0.5);
        await studio.choose("/accuracy/metric", "code");
        assert.equal((await studio.scene()).accuracy.metric, "code");
        await studio.set(with_("/lights/1", { type: "point", position: [0, 0, -5] }));
        await studio.page.click("#accuracy summary");
        await studio.page.waitForFunction(() => /Light 1 is left out/.test(document.querySelector("#accuracy .words").textContent));
        await studio.page.click("#accuracy summary");
        await studio.page.click('button:has-text("Measure against exact")');
        await studio.page.waitForSelector(".measures td");
        assert.match(await studio.page.textContent(".measures"), /PSNR/);
        assert.match(await studio.page.textContent(".legend"), /total/);
    });

    // The map on the page, its figures, and how bright it is where.
    const map = () => studio.page.evaluate(() => {
        const map = document.querySelector(".heat"), { width, height, max, p99, at } = studio.heat.told;
        const { data } = map.getContext("2d").getImageData(0, 0, width, height);
        const all = Array.from({ length: width * height }, (_, i) => data[4 * i] + data[4 * i + 1] + data[4 * i + 2]);
        return { width, height, max, p99, at, ringed: all[at[1] * width + at[0]], brightest: Math.max(...all), darkest: Math.min(...all),
                 corner: all[0], words: document.querySelector(".heat-words").textContent };
    });
    async function measure(scene) {
        await studio.set(scene);
        assert.equal(await studio.page.locator(".heat-box").isVisible(), false, "no map of another scene is left");
        await studio.page.click('button:has-text("Measure against exact")');
        await studio.page.waitForSelector(".measures td");
    }
    const inLinear = () => studio.page.click('.segments[aria-label="Error in"] label:has-text("linear")');

    test("the error map tells what the daemon's comparison tells", async () => {
        await measure(SCENE);
        const { measuredIn, tiers } = JSON.parse((await daemon.post("/v1/compare", SCENE)).body);
        const { error } = tiers.find(({ tier }) => tier === "standard");
        assert.deepEqual(measuredIn, { linear: "lin_rec709", code: "sRGB / Standard", deltaE2000: "sRGB / Standard" });
        const seen = await map();
        assert.deepEqual([seen.width, seen.height], [128, 128]);
        // Floats of displayed values end at 6e-8, which is up to 2e-5 of CIEDE2000.
        assert.ok(seen.max > 0 && Math.abs(seen.max - error.deltaE2000.max) < 2e-5, `${seen.max} ${error.deltaE2000.max}`);
        assert.match(seen.words, new RegExp(`at pixel ${seen.at.join(", ")} .*sRGB / Standard`));
        await inLinear();
        const linear = await map();
        // The same floats, subtracted; JSON has nine digits.
        for (const name of ["max", "p99"]) assert.ok(Math.abs(linear[name] - error.linear[name]) <= 1e-8 * error.linear[name], `${name}: ${linear[name]} ${error.linear[name]}`);
        await measure({ ...SCENE, accuracy: { tier: "exact" } });
        assert.match(await studio.page.textContent(".heat-words"), /^No pixel differs/);
        assert.equal((await map()).brightest, (await map()).darkest);
    });

    test("the error map is of the picture as its budget leaves it", async () => {
        // Faint lights at many distances, of which each tile leaves out what its budget allows.
        const lights = Array.from({ length: 64 }, (_, i) => {
            const z = (i + 0.5) / 64, angle = 2.4 * i, side = Math.sqrt(1 - z * z), far = 3 + 40 * (i * 47 % 64) / 64;
            return { type: "point", position: [side * Math.cos(angle), side * Math.sin(angle), z].map(one => far * one), intensity: 0.2, attenuation: [0, 0, 1] };
        });
        const scene = { ...SCENE, lights: [...SCENE.lights, ...lights], accuracy: { maxError: 2 } };
        await measure(scene);
        await studio.page.click('.segments[aria-label="Error in"] label:has-text("ΔE 2000")');
        const seen = await map();
        assert.ok(seen.max > 5e-4 && seen.max <= 2, `${seen.max}: far above the rounding of floats, and within the budget`);
        await inLinear();
        const linear = await map(), pictures = [];
        for (const accuracy of [scene.accuracy, { tier: "exact" }]) {
            const output = { format: "exr", bitDepth: "float", compression: "none", colorSpace: "lin_rec709" };
            pictures.push(readExr((await daemon.post("/v1/render", { ...scene, accuracy, output }, { Accept: "*/*" })).body));
        }
        const errors = pictures[0].values.map((value, i) => Math.abs(value - pictures[1].values[i])), most = errors.indexOf(Math.max(...errors)) / 3 | 0;
        assert.ok(Math.abs(linear.max - Math.max(...errors)) <= 1e-7 * linear.max, `${linear.max}`);
        assert.deepEqual(linear.at, [most % 128, most / 128 | 0]);
        assert.equal(Math.fround(linear.p99), [...errors].sort((a, b) => a - b)[Math.ceil(0.99 * errors.length) - 1]);
        assert.ok(linear.ringed === linear.brightest && linear.darkest === linear.corner && linear.corner < 10, JSON.stringify(linear));
        assert.match(linear.words, /A budget/);
        await studio.page.hover(".heat");
        assert.match(await studio.page.textContent(".heat-words"), /^Pixel \d+, \d+: [\d.e-]+ linear$/);
        await studio.shot("heat");
    });

    test("what is no mistake of the document is not told as one", async () => {
        await studio.set(SCENE);
        studio.expected.push(/status of 504/);
        await studio.page.route("**/v1/render", route => route.fulfill({ status: 504, contentType: "application/problem+json",
            body: JSON.stringify({ title: "Overdue", status: 504, detail: "not done after 30 seconds" }) }));
        await studio.page.evaluate(() => studio.store.set("/ambient", 0.3));
        await studio.page.waitForSelector(".stage.is-wrong");
        assert.equal(await studio.page.textContent("#plan"), "not done after 30 seconds");
        assert.equal(await studio.page.locator(".code-line.is-wrong, .row.is-wrong, .code-error").count(), 0);
        await studio.page.unroute("**/v1/render");
        await studio.set(SCENE);
        assert.equal(await studio.page.locator(".stage.is-wrong").count(), 0);
    });

    test("CIEDE2000 of the map is that of its authors", async () => {
        // Pairs of table 1 of Sharma, Wu, Dalal 2005: L, a, b twice, and their difference.
        const pairs = [[50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425], [50, -1.3802, -84.2814, 50, 0, -82.7485, 1], [50, 2.49, -0.001, 50, -2.49, 0.0009, 7.1792],
                       [50, 2.5, 0, 73, 25, -18, 27.1492], [50, 2.5, 0, 50, 3.2592, 0.335, 1], [22.7233, 20.0904, -46.694, 23.0331, 14.973, -42.5619, 2.0373],
                       [2.0776, 0.0795, -1.135, 0.9033, -0.0636, -0.5514, 0.9082], [90.8027, -2.0831, 1.441, 91.1528, -1.6435, 0.0447, 1.4441]];
        const { deltaE2000 } = await import("../../src/studio/studio/difference.js");
        for (const [a, b, c, d, e, f, told] of pairs) assert.ok(Math.abs(deltaE2000([a, b, c], [d, e, f]) - told) < 5e-5, `${told}`);
    });

    test("every module is asked for before another tells of it", () => {
        const folder = new URL("../../src/studio/", import.meta.url), found = new Set();
        const follow = name => {
            if (found.has(name)) return;
            found.add(name);
            for (const [, path] of readFileSync(new URL(name, folder), "utf8").matchAll(/^(?:import|export)\b[^;]*?"(\..*?)";$/gm))
                follow(new URL(path, `http://x/${name}`).pathname.slice(1));
        };
        follow("studio/main.js");
        const page = readFileSync(new URL("index.html", folder), "utf8");
        assert.deepEqual([...page.matchAll(/modulepreload" href="([^"]+)"/g)].map(one => one[1]).sort(), [...found].sort());
    });

    test("scopes and the lobe are of the scene", async () => {
        await studio.set(with_("/objects/0/material", { diffuse: [0.9, 0.02, 0.02] }));
        await studio.page.waitForFunction(() => {
            const cells = [...document.querySelectorAll(".channels tbody tr")].map(row => Number(row.cells[3].textContent));
            return cells.length === 3 && cells[0] > 0.8 && cells[1] < 0.3;
        });
        await studio.page.click('#scopes .segments[aria-label="Channels"] label:has-text("HSV")');
        assert.deepEqual((await studio.page.locator(".channels tbody th").allTextContents()), ["H", "S", "V"]);
        await studio.page.click('#scopes .segments[aria-label="Channels"] label:has-text("RGB")');
        await studio.page.locator("#lobe").scrollIntoViewIfNeeded();
        await studio.page.waitForFunction(() => document.querySelector(".lobe").naturalWidth > 0 && document.querySelectorAll("#lobe .words li").length);
        await studio.page.waitForFunction(() => [...document.querySelectorAll(".planes shaded-preview")].every(one => one.plan));
        assert.deepEqual(await studio.page.locator(".planes figcaption").allTextContents(), ["Y", "I", "Q", "H", "S", "V"]);
    });

    test("undo and redo go through the same pictures", async () => {
        await studio.set(SCENE);
        const first = await studio.look();
        await studio.tab("material");
        await studio.type(`${material}/diffuse`, "#00ff00");
        const second = await studio.look();
        await studio.drag(studio.page.locator("#stage"), 60, 30);
        const third = await studio.look();
        await studio.page.locator("#stage").focus();
        await studio.page.keyboard.press("Control+z");
        assert.equal((await studio.look()).hash, second.hash, "a drag is one step");
        await studio.page.click("#undo");
        assert.equal((await studio.look()).hash, first.hash);
        await studio.page.keyboard.press("Control+Shift+z");
        await studio.page.click("#redo");
        assert.equal((await studio.look()).hash, third.hash);
    });

    test("the scene can be typed, and mistakes are told at their place", async () => {
        // Chromium says of a 422 that a resource failed to load: that is what is asked for.
        studio.expected.push(/status of 422/);
        await studio.set(SCENE);
        const text = await studio.page.inputValue("#scene-json"), good = await studio.look();
        await studio.page.fill("#scene-json", text.replace('"shininess": 20', '"shininess": 200'));
        await studio.settled();
        assert.ok((await studio.look()).bright < good.bright / 3);

        await studio.page.fill("#scene-json", text.replace('"shininess": 20', '"shininess": 20,,'));
        const lines = text.split("\n"), line = lines.findIndex(one => one.includes('"shininess"')) + 1;
        const told = () => studio.page.locator(".code-line.is-wrong").evaluateAll(list => list.map(one => [Number(one.dataset.line), one.querySelector(".code-why").textContent]));
        assert.deepEqual(await told(), [[line, "expected a name in double quotes"]]);
        assert.match(await studio.page.textContent(".code-errors"), new RegExp(`Line ${line}`));

        await studio.page.fill("#scene-json", text.replace('"shininess": 20', '"shininess": -20, "shinyness": 3'));
        await studio.page.waitForSelector(".stage.is-wrong");
        await studio.page.waitForFunction(() => document.querySelectorAll(".code-error").length === 2);
        assert.deepEqual((await told()).map(one => one[0]), [line]);
        const pointers = await studio.page.locator(".code-error code").allTextContents();
        assert.deepEqual(pointers.sort(), [`${material}/shininess`, `${material}/shinyness`]);
        await studio.tab("material");
        assert.match(await studio.row(`${material}/shininess`).locator(".row-problem").textContent(), /20/);
        await studio.shot("mistake");

        await studio.page.fill("#scene-json", text);
        await studio.page.waitForFunction(() => !document.querySelector(".stage.is-wrong, .code-line.is-wrong, .row.is-wrong"));
        assert.equal((await studio.look()).hash, good.hash);
    });

    test(`${SECONDS} seconds of dragging show no picture after a newer one, and leave nothing behind`, async () => {
        await studio.set({ ...SCENE, image: { width: 384, height: 384, samples: 4 }, objects: [{ type: "torus", material: { preset: "brass" } }] });
        await studio.page.evaluate(() => {
            globalThis.shown = [];
            studio.view.addEventListener("load", () => shown.push([studio.view.picture.number, performance.now(), counted.requests]));
        });
        // What the panels hold after a first drag is not of the pictures.
        await studio.drag(studio.page.locator("#stage"), 40, 20);
        const before = await studio.counters();
        const box = await studio.page.locator("#stage").boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
        const asked = await studio.page.evaluate(() => counted.requests);
        await studio.page.mouse.move(x, y);
        await studio.page.mouse.down();
        const end = Date.now() + 1000 * SECONDS;
        for (let i = 0; Date.now() < end; i++) await studio.page.mouse.move(x + 150 * Math.sin(i / 40), y + 60 * Math.sin(i / 23));
        await studio.page.mouse.up();
        await studio.settled();
        const shown = await studio.page.evaluate(() => shown);
        const numbers = shown.map(one => one[0]);
        assert.deepEqual(numbers, [...numbers].sort((a, b) => a - b), "in the order of their requests");
        assert.ok(shown.every(([number, , latest]) => latest - number <= 1), "each is of the last request of its time, or of the one before");
        const [requests, aborted] = await studio.page.evaluate(() => [counted.requests, counted.aborted]);
        assert.ok(requests - asked <= shown.length + aborted, `${requests - asked} requests for ${shown.length} pictures, ${aborted} aborted`);
        const rates = [];
        for (let i = 0; i < SECONDS; i++) rates.push(shown.filter(([, time]) => time >= shown[0][1] + 1000 * i && time < shown[0][1] + 1000 * (i + 1)).length);
        console.log(`pictures a second while dragging: ${rates.join(" ")}`);
        assert.ok(shown.length > 2, String(shown.length));
        const truth = await daemon.post("/v1/render", await studio.scene());
        assert.ok(truth.body.equals(await studio.bytes()), "the last picture is that of the document");
        // But for that of the picture that is shown, once those that were overtaken are decoded.
        await studio.page.waitForFunction(() => counted.urls.size <= 1);
        // The engine's own counts, once what is not used is collected: some of it stays a while.
        const isMore = left => left.nodes > before.nodes + 200 || left.listeners > before.listeners + 20 || left.heap > before.heap + 8e6;
        let left = await studio.counters();
        for (let i = 0; i < 20 && isMore(left); i++) {
            await studio.page.waitForTimeout(500);
            left = await studio.counters();
        }
        assert.ok(!isMore(left), JSON.stringify([before, left]));
    });

    test("what is copied as curl, and what runs as Python, make the same bytes", async () => {
        await studio.set(with_("/objects/0/name", "it's \"one\""));
        const folder = mkdtempSync(join(tmpdir(), "shaded-"));
        await studio.page.click("#copy");
        const code = () => studio.page.textContent("#code .snippet");
        const here = await studio.bytes();
        const command = await code();
        execFileSync("/bin/sh", ["-c", command.replace("curl ", "curl -s ")], { cwd: folder });
        assert.ok(readFileSync(join(folder, "picture.png")).equals(here), "curl");
        await studio.page.click('#code label:has-text("Python")');
        execFileSync("python3", ["-c", await code()], { cwd: folder });
        assert.ok(readFileSync(join(folder, "picture.png")).equals(here), "Python");
        await studio.page.click('#code label:has-text("fetch")');
        const made = encodeURIComponent(`${await code()}\nexport default picture;`);
        const { default: picture } = await import(`data:text/javascript,${made}`);
        assert.ok(Buffer.from(await picture.arrayBuffer()).equals(here), "fetch");
        for (const one of ["<img>", "<shaded-preview>"]) {
            await studio.page.click(`#code label:has-text("${one}")`);
            await studio.page.waitForFunction(() => /^<(img|script)/.test(document.querySelector("#code .snippet").textContent));
            const link = /<img src="([^"]+)"/.exec(await code());
            assert.equal(Boolean(link), one === "<img>");
            if (link) assert.ok(Buffer.from(await (await fetch(link[1])).arrayBuffer()).equals(here), "img");
        }
        await studio.page.keyboard.press("Escape");
        rmSync(folder, { recursive: true });
    });

    test("downloads come in the formats of this daemon", async () => {
        await studio.set(SCENE);
        const begins = { png: [0x89, 0x50], jpeg: [0xff, 0xd8], webp: [0x52, 0x49], exr: [0x76, 0x2f] };
        const { formats } = JSON.parse((await daemon.ask({ method: "GET", path: "/v1/version" })).body);
        for (const format of Object.keys(begins).filter(one => formats.includes(one))) {
            await studio.page.click("#download summary");
            const coming = studio.page.waitForEvent("download");
            await studio.page.click(`.menu-item:nth-child(${formats.indexOf(format) + 1})`);
            const file = readFileSync(await (await coming).path());
            assert.deepEqual([...file.subarray(0, 2)], begins[format], format);
        }
    });

    test("the address holds the scene", async () => {
        await studio.set(with_("/objects/0/type", "cone"));
        const { hash } = await studio.look();
        const scene = await studio.scene();
        const held = text => text && JSON.parse(inflateRawSync(Buffer.from(text.slice("#s=".length), "base64url")));
        let address = ""; // it follows the scene a little later
        for (let tries = 0; tries < 15000 && !isDeepStrictEqual(held(address), scene); tries++) {
            await studio.page.waitForTimeout(20);
            address = await studio.page.evaluate(() => location.hash);
        }
        const again = await Studio.open(browser, origin, { hash: address });
        assert.deepEqual(await again.scene(), scene);
        assert.equal((await again.look()).hash, hash);
        await again.close();
        const broken = await Studio.open(browser, origin, { hash: "#s=nonsense" });
        assert.match(await broken.page.textContent("#toast"), /cannot be read/);
        await broken.close();
    });

    test("accessible in light and dark, wide and narrow", async () => {
        for (const [name, options] of Object.entries({
            dark: { colorScheme: "dark" }, light: { colorScheme: "light" },
            narrow: { colorScheme: "light", viewport: { width: 390, height: 844 } },
        })) {
            const one = await Studio.open(browser, origin, { ...options, bypassCSP: true });
            await one.page.evaluate(axeSource);
            for (const tab of ["material", "lights", "scene", "color"]) {
                await one.tab(tab);
                await one.page.evaluate(() => document.querySelectorAll(".panel details").forEach(one => { one.open = true; }));
                const { violations } = await one.page.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
                const bad = violations.filter(({ impact }) => ["serious", "critical"].includes(impact))
                    .map(({ id, nodes }) => `${id}: ${nodes.map(node => node.target.join(" ")).slice(0, 4).join(" | ")}`);
                assert.deepEqual(bad, [], `${name} ${tab}`);
            }
            const wide = await one.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
            assert.ok(wide <= 0, `${name}: ${wide} pixels too wide`);
            await one.tab("material");
            await one.shot(name);
            await one.close();
        }
    });

    test("where there are tokens, the page asks for one", async () => {
        const folder = mkdtempSync(join(tmpdir(), "shaded-"));
        const token = "0123456789abcdef0123456789abcdef";
        writeFileSync(join(folder, "tokens"), `tester sha256:${createHash("sha256").update(token).digest("hex")}\n`);
        const guarded = await startDaemon("--tokens", join(folder, "tokens"));
        const one = await Studio.open(browser, `http://127.0.0.1:${guarded.port}`, { ready: false, expected: [/401/] });
        await one.page.fill("#token-field", token);
        await one.page.keyboard.press("Enter");
        await one.ready();
        assert.ok((await one.look()).object > 0.2);
        await one.close();
        await guarded.stop();
        rmSync(folder, { recursive: true });
    });
});

describe("the element", { skip: CHROMIUM ? false : "chromium is not installed" }, () => {
    let browser, daemon, server, page, faults = [];
    const HTML = port => `<!doctype html><title>t</title><script type="module" src="http://127.0.0.1:${port}/shaded-preview.js"></script>
        <shaded-preview id="near" material="brass" shape="torus" size="64"></shaded-preview>
        <shaded-preview id="wrong" material="bras" size="64" label="A mistake"></shaded-preview>
        <div style="height: 4000px"></div><shaded-preview id="far" material="jade" size="64"></shaded-preview>`;

    before(async () => {
        server = http.createServer((request, answer) => {
            answer.setHeader("Content-Type", "text/html");
            answer.end(HTML(daemon.port));
        });
        server.listen(0, "127.0.0.1");
        await once(server, "listening");
        daemon = await startDaemon("--cors-origins", `http://127.0.0.1:${server.address().port}`);
        browser = await startBrowser();
        page = await browser.newPage();
        page.on("pageerror", error => faults.push(error.stack));
        await page.addInitScript(() => {
            globalThis.told = [];
            for (const name of ["bound", "error"])
                addEventListener(name, event => { if (event.target.localName === "shaded-preview") told.push([event.target.id, name, event.detail]); }, true);
        });
        await page.goto(`http://127.0.0.1:${server.address().port}/`);
    });
    after(async () => {
        await browser?.close();
        server?.close();
        await daemon?.stop();
        assert.deepEqual(faults, []);
    });
    const told = (id, name) => page.waitForFunction(([id, name]) => told.find(one => one[0] === id && one[1] === name)?.[2], [id, name]).then(one => one.jsonValue());

    test("shows a material on a page of another origin, and tells its bound", async () => {
        const bound = await told("near", "bound");
        assert.equal(bound.tier, "standard");
        assert.ok(bound.error.deltaE2000 > 0 && bound.error.deltaE2000 < 1 && bound.timing.encode >= 0);
        assert.match(bound.plan, /^tier=standard; lights=/);
        const near = await page.evaluate(() => {
            const one = document.getElementById("near");
            return [one.getAttribute("role"), one.getAttribute("aria-label"), one.offsetWidth, one.image.naturalWidth];
        });
        assert.deepEqual(near, ["img", "Preview of brass on a torus", 64, 64]);
        const truth = await daemon.ask({ method: "GET", path: "/v1/preview/brass?shape=torus&size=64" });
        const bytes = await page.evaluate(async () => [...new Uint8Array(await document.getElementById("near").picture.arrayBuffer())]);
        assert.ok(truth.body.equals(Buffer.from(bytes)));
    });

    test("has an attribute and a property for each parameter of the link that says what is seen", async () => {
        const api = JSON.parse((await daemon.ask({ method: "GET", path: "/openapi.json" })).body);
        const names = api.paths["/v1/preview/{material}"].get.parameters.map(one => one.$ref ? api.components.parameters[one.$ref.split("/").at(-1)] : one)
            .filter(one => one.in !== "header" && !["expires", "signature"].includes(one.name)).map(one => one.name);
        assert.ok(names.includes("ground") && names.includes("shininess"));
        const missing = await page.evaluate(names => {
            const type = customElements.get("shaded-preview"), kebab = name => name.replace(/[A-Z]/g, c => "-" + c.toLowerCase());
            return names.filter(name => !type.observedAttributes.includes(kebab(name)) || !(name in type.prototype));
        }, names);
        assert.deepEqual(missing, []);
    });

    test("stands on a floor, and takes other coefficients", async () => {
        const shown = change => page.evaluate(async change => {
            const one = document.getElementById("near");
            Object.assign(one, change);
            await new Promise(done => one.addEventListener("load", done, { once: true }));
            return [one.ground, [...new Uint8Array(await one.picture.arrayBuffer())]];
        }, change);
        for (const [change, query, ground] of [[{ ground: true }, "&ground=true", true], [{ ground: false }, "", false],
            [{ diffuse: "tomato", specular: "0", shininess: 5 }, "&diffuse=tomato&specular=0&shininess=5", false]]) {
            const truth = await daemon.ask({ method: "GET", path: `/v1/preview/brass?shape=torus&size=64${query}` });
            const [is, bytes] = await shown(change);
            assert.equal(is, ground);
            assert.ok(truth.body.equals(Buffer.from(bytes)), query);
        }
    });

    test("tells mistakes", async () => {
        const { status, problem } = await told("wrong", "error");
        assert.deepEqual([status, problem.type], [404, "urn:shaded:problem:not-found"]);
    });

    test("asks for nothing until it is nearly in sight", async () => {
        assert.equal(await page.evaluate(() => document.getElementById("far").plan), null);
        await page.evaluate(() => scrollTo(0, 4000));
        await told("far", "bound");
    });

    test("follows its attributes and properties, the last of them", async () => {
        await page.evaluate(async () => {
            const one = document.getElementById("far");
            one.setAttribute("shape", "box");
            one.material = "ruby";
            one.scene = { image: { width: 20, height: 10 }, objects: [{ type: "sphere", material: { preset: "gold" } }] };
            for (let i = 1; i <= 40; i++) {
                one.scene = { image: { width: 20, height: 10 + i }, objects: [] };
                await new Promise(done => setTimeout(done, 3));
            }
            while (one.busy) await new Promise(done => setTimeout(done, 5));
        });
        assert.deepEqual(await page.evaluate(() => [document.getElementById("far").image.naturalWidth, document.getElementById("far").image.naturalHeight]), [20, 50]);
    });
});
