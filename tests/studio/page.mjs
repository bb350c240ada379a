// A page of the studio in Debian's Chromium, and what is seen on it.
import assert from "node:assert/strict";
import { existsSync, mkdirSync } from "node:fs";
import { createRequire } from "node:module";

import { Daemon } from "../api/daemon.mjs";

const require = createRequire(process.env.SHADED_PACKAGES + "/");
const { chromium } = require("playwright-core");
export const axeSource = require("axe-core").source;

export const CHROMIUM = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);
const SHOTS = `${process.env.SHADED_BUILD}/studio`;

export const startDaemon = (...flags) =>
    Daemon.start("--max-pixels", "4194304", "--max-samples", "67108864", ...flags);

export async function startBrowser() {
    mkdirSync(SHOTS, { recursive: true });
    return chromium.launch({ executablePath: CHROMIUM, args: ["--no-sandbox", "--disable-gpu"] });
}

// Until a test gives up, on the slowest machine.
const PATIENCE = 300000;

// Numbers the requests of the large picture, so that pictures tell which one they are of; and
// keeps the addresses of its Blobs that are not given back.
function watch() {
    const ask = globalThis.fetch;
    globalThis.counted = { requests: 0, aborted: 0, urls: new Set(), violations: [] };
    globalThis.fetch = async (...values) => {
        const isLarge = String(values[0]).endsWith("/v1/render") && !/"(channel|scope)"/.test(values[1].body);
        const number = isLarge ? ++counted.requests : 0;
        values[1]?.signal?.addEventListener("abort", () => counted.aborted++);
        const answer = await ask(...values);
        const blob = answer.blob.bind(answer);
        answer.blob = async () => Object.assign(await blob(), { number });
        return answer;
    };
    const [make, giveBack] = [URL.createObjectURL, URL.revokeObjectURL];
    URL.createObjectURL = value => {
        const url = make.call(URL, value);
        if (value.number) counted.urls.add(url);
        return url;
    };
    URL.revokeObjectURL = url => {
        counted.urls.delete(url);
        giveBack.call(URL, url);
    };
    document.addEventListener("securitypolicyviolation", event => counted.violations.push(`${event.violatedDirective}: ${event.blockedURI}`));
}

export class Studio {
    static async open(browser, origin, { hash = "", expected = [], ...options } = {}) {
        const studio = new Studio();
        studio.context = await browser.newContext({ viewport: { width: 1440, height: 900 }, colorScheme: "dark", ...options });
        studio.context.setDefaultTimeout(PATIENCE);
        studio.page = await studio.context.newPage();
        studio.faults = [];
        studio.expected = [...expected]; // messages, which may come later than what they are about
        studio.hosts = new Set();
        studio.page.on("console", message => {
            const text = `${message.text()} ${message.location().url}`;
            if (["error", "warning"].includes(message.type()) && !studio.expected.some(one => one.test(text))) studio.faults.push(text);
        });
        studio.page.on("pageerror", error => studio.faults.push(error.stack));
        studio.page.on("request", request => {
            if (/^http/.test(request.url())) studio.hosts.add(new URL(request.url()).origin);
        });
        await studio.page.addInitScript(watch);
        await studio.page.goto(`${origin}/${hash}`);
        if (options.ready !== false) await studio.ready();
        return studio;
    }

    async ready() {
        await this.page.waitForFunction(() => document.documentElement.classList.contains("is-ready"), null, { timeout: PATIENCE });
        await this.settled();
    }

    // Until the picture is that of the document.
    async settled() {
        await this.page.waitForFunction(() => !studio.store.live && !studio.view.busy && (studio.view.plan || document.querySelector(".stage.is-wrong")),
                                        null, { timeout: PATIENCE, polling: 20 });
    }

    scene() { return this.page.evaluate(() => studio.store.scene); }
    set(scene) {
        return this.page.evaluate(one => studio.store.replace(one), scene).then(() => this.settled());
    }
    bytes() {
        return this.page.evaluate(async () => [...new Uint8Array(await studio.view.picture.arrayBuffer())]).then(list => Buffer.from(list));
    }

    // What is seen: size, mean color, corner, middle, and the share of bright pixels and their middle.
    async look() {
        await this.settled();
        return this.page.evaluate(async () => {
            const picture = await createImageBitmap(studio.view.picture), { width, height } = picture;
            const canvas = new OffscreenCanvas(width, height), context = canvas.getContext("2d");
            context.drawImage(picture, 0, 0);
            const { data } = context.getImageData(0, 0, width, height);
            const at = (x, y) => [...data.slice(4 * (y * width + x), 4 * (y * width + x) + 4)];
            const corner = at(1, 1), mean = [0, 0, 0], bright = [0, 0, 0], edges = [];
            let object = 0, hash = 2166136261;
            for (let i = 0; i < width * height; i++) {
                const rgb = data.subarray(4 * i, 4 * i + 3);
                for (let c = 0; c < 3; c++) { mean[c] += rgb[c] / (width * height); hash = Math.imul(hash ^ rgb[c], 16777619); }
                if (Math.abs(rgb[0] - corner[0]) + Math.abs(rgb[1] - corner[1]) + Math.abs(rgb[2] - corner[2]) > 6) object++;
                const light = (rgb[0] + rgb[1] + rgb[2]) / 3;
                if (light > 170) { bright[0]++; bright[1] += i % width / width; bright[2] += Math.floor(i / width) / height; }
            }
            return { width, height, mean, corner, middle: at(width >> 1, height >> 1), object: object / (width * height), hash,
                     bright: bright[0] / (width * height), brightX: bright[1] / bright[0], brightY: bright[2] / bright[0] };
        });
    }

    // Red of all pixels, as codes.
    async reds() {
        await this.settled();
        return this.page.evaluate(async () => {
            const picture = await createImageBitmap(studio.view.picture), { width, height } = picture;
            const context = new OffscreenCanvas(width, height).getContext("2d");
            context.drawImage(picture, 0, 0);
            return [...context.getImageData(0, 0, width, height).data.filter((_, i) => i % 4 === 0)];
        });
    }

    tab(name) { return this.page.click(`#tab-${name}`); }
    row(pointer) { return this.page.locator(`.row[data-pointer="${pointer}"]`).first(); }

    // What is written into a row's last field: its number, its color.
    async type(pointer, value) {
        const field = this.row(pointer).locator("input.number, input.text").last();
        await field.fill(String(value));
        await field.press("Enter");
        await this.settled();
    }
    async choose(pointer, value) {
        await this.row(pointer).locator("select").selectOption(value);
        await this.settled();
    }
    async switch(pointer) {
        await this.row(pointer).locator(".toggle").click();
        await this.settled();
    }

    async drag(element, dx, dy, steps = 8) {
        const box = await element.boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
        await this.page.mouse.move(x, y);
        await this.page.mouse.down();
        for (let i = 1; i <= steps; i++) await this.page.mouse.move(x + dx * i / steps, y + dy * i / steps);
        await this.page.mouse.up();
        await this.settled();
    }

    // What the page holds: nodes, listeners, bytes of JavaScript.
    async counters() {
        const session = await this.context.newCDPSession(this.page);
        for (let i = 0; i < 3; i++) await session.send("HeapProfiler.collectGarbage");
        const { nodes, jsEventListeners } = await session.send("Memory.getDOMCounters");
        const { usedSize } = await session.send("Runtime.getHeapUsage");
        await session.detach();
        return { nodes, listeners: jsEventListeners, heap: usedSize };
    }

    shot(name) { return this.page.screenshot({ path: `${SHOTS}/${name}.png` }); }

    async close() {
        const violations = await this.page.evaluate(() => counted.violations);
        await this.context.close();
        assert.deepEqual(violations, [], "Content-Security-Policy");
        assert.deepEqual(this.faults, [], "the console");
        assert.ok([...this.hosts].every(origin => origin.startsWith("http://127.0.0.1:")), [...this.hosts].join());
    }
}

// A file of OpenEXR as the daemon writes it, not compressed and of floats: {width, height, values}, three
// a pixel, as they come: blue, green, red.
export function readExr(file) {
    let at = 8;
    const word = () => { const end = file.indexOf(0, at), text = file.toString("latin1", at, end); at = end + 1; return text; };
    const told = {};
    for (let name = word(); name; name = word()) {
        word();
        const size = file.readUInt32LE(at);
        told[name] = file.subarray(at + 4, at + 4 + size);
        at += 4 + size;
    }
    assert.equal(told.channels.length, 3 * 18 + 1);
    assert.equal(told.compression[0], 0);
    const width = told.dataWindow.readInt32LE(8) + 1, height = told.dataWindow.readInt32LE(12) + 1, values = new Float32Array(3 * width * height);
    for (let y = 0; y < height; y++) {
        const row = Number(file.readBigUInt64LE(at + 8 * y)) + 8;
        for (let c = 0; c < 3; c++) for (let x = 0; x < width; x++) values[3 * (y * width + x) + c] = file.readFloatLE(row + 4 * (c * width + x));
    }
    return { width, height, values };
}
