/* Where the picture differs from that of the exact tier, and by how much: both are asked for as
 * floats, and held against each other here as /v1/compare does it in the daemon. */
import { readPlan } from "../shaded-preview.js";
import { Latest, Refusal } from "./api.js";
import * as controls from "./controls.js";
import { CURVES, linearErrors, readTiff, seenErrors } from "./difference.js";
import { figure, h } from "./dom.js";

const UNITS = { deltaE2000: "ΔE 2000", linear: "linear" };
const DECADES = 3, MOST = 2 ** 21; /* pixels: two pictures of floats are 64 MB then */

/* From nothing to the largest: black, violet, red, yellow, white. Brightness only rises, so that it
 * reads without hues, too. */
const RAMP = [[0, 0, 4], [66, 10, 104], [147, 38, 103], [221, 81, 58], [252, 165, 10], [252, 255, 200]];
export function heatOf(share) {
    const place = Math.min(1, Math.max(0, share)) * (RAMP.length - 1), i = Math.min(RAMP.length - 2, Math.floor(place));
    return RAMP[i].map((value, c) => Math.round(value + (RAMP[i + 1][c] - value) * (place - i)));
}
/* Errors go over decades: the scale is logarithmic, and ends three of them below the largest. */
export const shareOf = (value, max) => value > 0 ? Math.max(0.02, 1 + Math.log10(value / max) / DECADES) : 0;

/* The scene as floats, in a color space or as it is displayed. */
export function inFloats({ outputs, ...scene }, { colorSpace }, accuracy) {
    const { exposure, looks, gamma, display, view } = scene.output ?? outputs?.[0] ?? {};
    const shown = colorSpace ? { colorSpace } : { exposure, looks, gamma, display, view };
    return { ...scene, output: { ...shown, format: "tiff", bitDepth: "float" }, ...(accuracy && { accuracy }) };
}

/* Where CIEDE2000 is taken: where the daemon takes it, if the curve is known here, else in light. */
function placeOf(measuredIn) {
    const [name, view] = measuredIn.split(" / "), curve = CURVES[name];
    return curve && view ? { curve, title: measuredIn } : curve ? { curve, title: name, colorSpace: name }
        : { curve: CURVES.lin_rec709, title: `lin_rec709 (the table below: ${measuredIn})`, colorSpace: "lin_rec709" };
}

export class HeatMap {
    #asked = [new Latest(), new Latest()];
    #told = null;
    #made = null;     // errors by metric
    #places = null;   // what they are measured in
    #metric = "deltaE2000";
    #other = null;

    constructor({ store, shown }) {
        Object.assign(this, { store, shown });
        this.pick = controls.segments("Error in", Object.keys(UNITS), { labels: UNITS, change: metric => { this.#metric = metric; this.draw(); } });
        this.canvas = h("canvas.heat", { role: "img", "aria-label": "Error map" });
        this.mark = h("span.heat-mark", { "aria-hidden": "true" });
        this.canvas.addEventListener("pointermove", event => this.#point(event));
        this.canvas.addEventListener("pointerleave", () => this.#tell());
        this.scale = h("canvas.heat-scale", { width: 256, height: 1, "aria-hidden": "true" });
        this.ticks = h("div.heat-ticks");
        this.words = h("p.note.heat-words", { role: "status" });
        this.element = h("div.heat-box", { hidden: true }, h("div.panel-head", {}, h("h3", {}, "Error at each pixel"), ...this.pick.element),
                         h("div.heat-frame", {}, this.canvas, this.mark), this.scale, this.ticks, this.words);
        const context = this.scale.getContext("2d"), ramp = context.createImageData(256, 1);
        for (let i = 0; i < 256; i++) ramp.data.set([...heatOf(i / 255), 255], 4 * i);
        context.putImageData(ramp, 0, 0);
    }

    get told() { return this.#told; }

    /* Measures the scene as it stands; `measuredIn`: as /v1/compare tells. */
    async measure(measuredIn) {
        const { scene } = this.store, { width = 512, height = 512 } = scene.image ?? {}, seen = placeOf(measuredIn.deltaE2000);
        if (width * height > MOST) return this.#say(`A map is made of up to ${MOST} pixels; this picture has ${width * height}.`);
        const ask = async (latest, accuracy) => {
            const pictures = [];
            for (const place of [{ colorSpace: measuredIn.linear }, seen]) {
                const blob = await latest.post("v1/render", inFloats(scene, place, accuracy), { accept: "*/*" });
                if (!blob) return null;
                pictures.push(Object.assign(await readTiff(await blob.arrayBuffer()), { plan: blob.plan }));
            }
            return pictures;
        };
        try {
            const [now, exact] = await Promise.all([ask(this.#asked[0]), ask(this.#asked[1], { tier: "exact" })]);
            if (!now || !exact || scene !== this.store.scene) return undefined;
            this.#made = { linear: linearErrors(now[0], exact[0]), deltaE2000: seenErrors(now[1], exact[1], seen.curve) };
            this.#places = { linear: measuredIn.linear, deltaE2000: seen.title };
            this.#other = this.#isOther(now[1].plan);
            return this.draw();
        } catch (error) {
            if (!(error instanceof Refusal)) throw error;
            return this.#say(error.message);
        }
    }

    /* A budget is met for the output that is asked for: floats may need another plan than codes. */
    #isOther(text) {
        const shown = this.shown(), now = readPlan(text);
        return shown && (shown.tier !== now.tier || shown.lights?.used !== now.lights?.used) ? text : null;
    }

    clear() {
        this.#made = this.#told = null;
        this.element.hidden = true;
    }

    #say(text) {
        this.#told = null;
        this.element.hidden = false;
        this.canvas.parentElement.hidden = this.scale.hidden = this.ticks.hidden = true;
        this.words.textContent = text;
    }

    draw() {
        this.pick.show(this.#metric);
        if (!this.#made) return;
        const { width, height, values, max, at } = this.#told = this.#made[this.#metric], context = this.canvas.getContext("2d", { willReadFrequently: true });
        Object.assign(this.canvas, { width, height });
        const image = context.createImageData(width, height);
        for (let i = 0; i < values.length; i++) image.data.set([...heatOf(shareOf(values[i], max)), 255], 4 * i);
        context.putImageData(image, 0, 0);
        this.element.hidden = this.canvas.parentElement.hidden = false;
        this.scale.hidden = this.ticks.hidden = this.mark.hidden = max === 0;
        this.mark.style.left = `${(at[0] + 0.5) / width * 100}%`;
        this.mark.style.top = `${(at[1] + 0.5) / height * 100}%`;
        this.ticks.replaceChildren(...Array.from({ length: DECADES + 1 }, (_, i) => h("span", {}, figure(max * 10 ** (i - DECADES), 1))));
        this.#tell();
    }

    #tell() {
        if (!this.#told) return;
        const { max, p99, at } = this.#told, unit = UNITS[this.#metric];
        const text = max === 0 ? `No pixel differs from the exact picture, in ${unit}.`
            : `Largest ${figure(max)} ${unit} at pixel ${at.join(", ")} (ringed); 99 % of ${this.#metric === "linear" ? "components" : "pixels"} within ${figure(p99)}. `
              + `Measured in ${this.#places[this.#metric]}.`
              + (this.store.scene.accuracy?.maxError === undefined ? "" : " A budget may leave out lights: the table is of the tiers without it.");
        this.words.textContent = this.#other ? `${text} Floats were drawn by another plan than the picture: ${this.#other}.` : text;
        this.canvas.setAttribute("aria-label", `Error map. ${text}`);
    }

    #point(event) {
        if (!this.#told) return;
        const box = this.canvas.getBoundingClientRect(), { width, height, values } = this.#told;
        const x = Math.min(width - 1, Math.max(0, Math.floor((event.clientX - box.left) / box.width * width)));
        const y = Math.min(height - 1, Math.max(0, Math.floor((event.clientY - box.top) / box.height * height)));
        this.words.textContent = `Pixel ${x}, ${y}: ${figure(values[y * width + x])} ${UNITS[this.#metric]}`;
    }
}
