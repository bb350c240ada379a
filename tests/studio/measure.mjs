// How long the studio takes to its first picture, and how many pictures a second it shows while
// something is dragged. Nothing is asserted: run it where nothing else works.
//
// `./dev bench --studio` writes the figures into docs/studio.md. STUDIO_WATERFALL=1 tells what was asked
// for when.
import { readFileSync, writeFileSync } from "node:fs";
import { cpus, loadavg } from "node:os";

import { startBrowser, startDaemon } from "./page.mjs";

const OPENED = 15, SECONDS = 5;
const sorted = list => [...list].sort((a, b) => a - b);
const median = list => sorted(list)[list.length >> 1];
const tidy = value => Number(value.toPrecision(3));
const spread = list => ({ median: tidy(median(list)), least: tidy(Math.min(...list)), most: tidy(Math.max(...list)) });

// The path of each picture: asked, headers, bytes, told as shown.
function watch() {
    const ask = globalThis.fetch;
    globalThis.path = [];
    globalThis.fetch = async (...values) => {
        const isLarge = String(values[0]).endsWith("/v1/render") && !/"(channel|scope)"/.test(values[1].body);
        if (!isLarge) return ask(...values);
        const one = { asked: performance.now() };
        const answer = await ask(...values);
        one.headers = performance.now();
        one.server = (answer.headers.get("Server-Timing") ?? "").match(/dur=[\d.]+/g)?.reduce((sum, text) => sum + Number(text.slice(4)), 0) ?? 0;
        const blob = answer.blob.bind(answer);
        answer.blob = async () => {
            const made = await blob();
            one.bytes = performance.now();
            one.size = made.size;
            path.push(one);
            return made;
        };
        return answer;
    };
}

async function open(browser, origin, width) {
    const context = await browser.newContext({ viewport: { width, height: 900 }, colorScheme: "dark" });
    const page = await context.newPage();
    await page.addInitScript(watch);
    await page.goto(origin);
    await page.waitForFunction(() => performance.getEntriesByName("first picture").length && document.documentElement.classList.contains("is-ready"));
    return { context, page };
}

async function opening(browser, origin) {
    const times = [], ready = [], paths = [];
    for (let i = 0; i < OPENED; i++) {
        const { context, page } = await open(browser, origin, 1440);
        const told = await page.evaluate(() => ({
            first: performance.getEntriesByName("first picture")[0].startTime,
            ready: performance.getEntriesByName("ready")[0]?.startTime ?? 0,
            begun: globalThis.path[0],
            resources: performance.getEntriesByType("resource").map(one => [new URL(one.name).pathname + new URL(one.name).search.slice(0, 20), one.startTime, one.responseEnd].map(x => typeof x === "number" ? Math.round(x) : x)),
            page: performance.getEntriesByType("navigation").map(one => [one.responseEnd, one.domInteractive, one.domContentLoadedEventEnd, one.loadEventEnd].map(Math.round))[0],
        }));
        times.push(told.first);
        ready.push(told.ready);
        paths.push(told);
        await context.close();
    }
    const last = paths[paths.length - 1];
    if (process.env.STUDIO_WATERFALL) {
        console.log("page", last.page, last.begun);
        for (const one of last.resources) console.log("   ", ...one);
    }
    return { firstPicture: spread(times), cold: tidy(times[0]), controls: spread(ready) };
}

async function dragging(browser, origin, object) {
    const { context, page } = await open(browser, origin, 1440);
    await page.evaluate(async object => {
        const scene = { ...studio.store.scene, objects: [object] };
        scene.image = { ...scene.image, width: 384, height: 384 };
        studio.store.replace(scene);
        globalThis.shown = [];
        studio.view.addEventListener("load", () => shown.push([performance.now(), studio.view.plan.draft]));
    }, object);
    await page.waitForTimeout(1500);
    const box = await page.locator("#stage").boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
    await page.mouse.move(x, y);
    await page.mouse.down();
    const begin = Date.now();
    await page.evaluate(() => { shown.length = 0; path.length = 0; });
    // As a mouse tells them: 125 a second, whether or not the page has looked at the last one.
    const under = new Set();
    for (let now = 0; now < 1000 * SECONDS + 600; now = Date.now() - begin) {
        if (under.size < 12) {
            const move = page.mouse.move(x + 150 * Math.sin(now / 700), y + 60 * Math.sin(now / 400)).finally(() => under.delete(move));
            under.add(move);
        }
        await new Promise(done => setTimeout(done, 8));
    }
    await Promise.all(under);
    const told = await page.evaluate(() => ({ shown, path: globalThis.path }));
    await page.mouse.up();
    const plan = await page.evaluate(() => [studio.view.plan.plan]);
    await context.close();
    const first = told.shown[0][0] + 300;
    const rates = Array.from({ length: SECONDS }, (_, i) =>
        told.shown.filter(([time]) => time >= first + 1000 * i && time < first + 1000 * (i + 1)).length);
    const of = pick => tidy(median(told.path.map(pick)));
    return { pictures: { median: median(rates), least: Math.min(...rates), all: rates },
             milliseconds: { server: of(one => one.server), headers: of(one => one.headers - one.asked), bytes: of(one => one.bytes - one.headers) },
             bytes: of(one => one.size), plan };
}

const daemon = await startDaemon(), origin = `http://127.0.0.1:${daemon.port}`;
const browser = await startBrowser();
const load = loadavg()[0];
const told = {
    processor: cpus()[0].model, processors: cpus().length, browser: `Chromium ${browser.version()}`, load: tidy(load),
    opening: await opening(browser, origin),
    sphere: await dragging(browser, origin, { type: "sphere", material: { preset: "brass" } }),
    torus: await dragging(browser, origin, { type: "torus", material: { preset: "brass" } }),
};
await browser.close();
await daemon.stop();
console.log(JSON.stringify(told, null, 1));

const range = ({ median, least, most }) => `${median} (${least} to ${most})`;
const { opening: { firstPicture, cold, controls }, sphere, torus } = told;
const rate = ({ pictures, milliseconds, bytes }) =>
    `${pictures.median} (${pictures.all.join(", ")}); server ${milliseconds.server} ms, answer after ${milliseconds.headers} ms, ${Math.round(bytes / 1000)} kB`;
const table = `| ${told.processor}, ${told.processors} processors, load ${told.load} before, ${told.browser} | |
| --- | --- |
| from opening the page to the first picture, ms: median of ${OPENED} (range) | ${range(firstPicture)} |
| the first one of a new browser and daemon, ms | ${cold} |
| until all controls are there, ms | ${range(controls)} |
| pictures a second while the camera is dragged, 384x384, a sphere: median of ${SECONDS} s (each) | ${rate(sphere)} |
| the same of a torus | ${rate(torus)} |`;
const page = new URL("../../docs/studio.md", import.meta.url), text = readFileSync(page, "utf8");
const [begin, , end] = text.split("<!-- measured -->");
if (end === undefined) throw new Error("docs/studio.md has no place for figures");
writeFileSync(page, [begin, `\n${table}\n`, end].join("<!-- measured -->"));
