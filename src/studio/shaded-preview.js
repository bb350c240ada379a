/* <shaded-preview>: a picture of a material or of a whole scene, rendered by the daemon that this
 * file comes from.
 *
 *     <script type="module" src="https://shaded.example/shaded-preview.js"></script>
 *     <shaded-preview material="brass" shape="torus" size="256"></shaded-preview>
 *
 * Attributes, each with a property of its name in camelCase:
 *   material, shape, size, ground, width, height, samples, background, display, view, color-space,
 *   format, quality, emissive, ambient, diffuse, specular, shininess
 *               as of GET /v1/preview/{material}. Sizes are in CSS pixels: on a screen with two
 *               pixels for each of these, the picture has as many. `ground` is there, or not, or "false"
 *   scene       a scene document, as JSON (the property takes an object, too); posted as it is, to
 *               which `display`, `view` and `color-space` are added, and a size if it has none
 *   draft       while it is there, pictures are made quickly: with fewer samples and pixels if the
 *               last ones took long
 *   server      where the daemon is; by default where this file came from
 *   label       what the picture shows, for people who do not see it
 *   loading     "lazy" (the default) waits until the element is nearly in sight; or "eager"
 * Properties: `token` (sent as Authorization: Bearer), `plan` (what the last `bound` told),
 *   `picture` (the Blob that is shown), `busy`.
 * Events: `bound` {plan, tier, asked, lights: {used, given}, error: {linear, code, deltaE2000},
 *   timing: {stage: ms}, reuse, warnings, milliseconds, draft}, before `load`, with each picture;
 *   `error` {status, problem}; `load`.
 *
 * One request is under way at most, or two while there are drafts that come quickly: one is worked at
 * while the other travels. What changes meanwhile is asked for next, once, in its last state; a
 * draft that is under way is waited for if another draft follows, so that pictures keep coming, and
 * any other request is aborted. A picture is never followed by one that is older: what is overtaken
 * is aborted, too. */

const HERE = new URL(".", import.meta.url);
const LINK = ["material", "shape", "size", "ground", "width", "height", "samples", "background",
              "display", "view", "color-space", "format", "quality", "emissive", "ambient",
              "diffuse", "specular", "shininess"];
const SWITCHES = ["ground", "draft"]; // that are on while they are there
const SHOWN = new Set(["png", "jpeg", "webp"]);
const ACCEPT = "image/png, image/webp, image/jpeg, application/problem+json";

const sheet = new CSSStyleSheet();
sheet.replaceSync(`
:host { display: inline-block; position: relative; overflow: hidden; contain: content; line-height: 0; }
:host([hidden]) { display: none; }
img, canvas { display: block; width: 100%; height: 100%; object-fit: contain; }
p { position: absolute; inset: 0; margin: 0; display: grid; place-items: center; padding: 8px; text-align: center;
    font: 12px/1.4 system-ui, sans-serif; color: #b3261e; background: rgb(255 255 255 / 85%); overflow: auto; }
p[hidden] { display: none; }`);

const camel = name => name.replace(/-(.)/g, (_, c) => c.toUpperCase());

/* "tier=exact; asked=standard; lights=1/3; error<=1e-06 linear, 1 code" in its parts. */
export function readPlan(text) {
    const plan = { plan: text, tier: "", asked: null, lights: null, error: {} };
    for (const part of (text ?? "").split("; ")) {
        const [, name, how, value] = /^(\w+)(<?=)(.*)$/.exec(part) ?? [];
        if (name === "lights") {
            const [used, given] = value.split("/").map(Number);
            plan.lights = { used, given };
        } else if (name === "error") {
            for (const bound of value.split(", ")) {
                const [most, unit] = bound.split(" ");
                plan.error[unit] = Number(most);
            }
        } else if (name) {
            plan[name] = how === "<=" ? Number(value) : value;
        }
    }
    plan.asked ??= plan.tier;
    return plan;
}

/* {stage: ms} and what was taken from earlier pictures. */
export function readTiming(text) {
    const timing = {};
    let reuse = "nothing";
    for (const part of (text ?? "").split(", ")) {
        const [, name, kind, value] = /^(\w+);(dur|desc)=(.*)$/.exec(part) ?? [];
        if (kind === "dur") timing[name] = Number(value);
        if (kind === "desc") reuse = value;
    }
    return { timing, reuse };
}

/* A list of strings with parameters (RFC 9651): [{pointer, detail}]. */
export function readWarnings(text) {
    const quoted = '"((?:[^"\\\\]|\\\\.)*)"';
    const plain = part => decodeURIComponent(part.replace(/\\(.)/g, "$1"));
    return [...(text ?? "").matchAll(new RegExp(`${quoted};pointer=${quoted}`, "g"))]
        .map(([, detail, pointer]) => ({ detail: plain(detail), pointer: plain(pointer) }));
}

export class ShadedPreview extends HTMLElement {
    static observedAttributes = [...LINK, "scene", "draft", "server", "label", "loading"];
    static #seen = new IntersectionObserver(entries => {
        for (const { target, isIntersecting } of entries)
            if (isIntersecting) target.#show();
    }, { rootMargin: "200px" });

    #root = this.attachShadow({ mode: "open" });
    #image = document.createElement("img");
    #canvas = null;
    #message = document.createElement("p");
    #scene = null;
    #token = null;
    #inSight = false;
    #queued = false;   // a change is noted, and looked at in a microtask
    #flights = [];     // {control, draft}, the oldest first: what is under way
    #waits = false;    // something is to be asked for when a flight has ended
    #asked = "";       // what the last request asked for
    #url = null;
    #later = 0;        // the timer until a busy server is asked again
    #cost = 0;         // milliseconds that a full picture takes, as the last one tells
    plan = null;
    picture = null;

    constructor() {
        super();
        this.#root.adoptedStyleSheets = [sheet];
        this.#image.alt = "";
        this.#image.setAttribute("part", "picture");
        this.#message.hidden = true;
        this.#message.setAttribute("part", "error");
        this.#root.append(this.#image, this.#message);
    }

    connectedCallback() {
        if (!this.hasAttribute("role")) this.setAttribute("role", "img");
        this.#describe();
        this.#measure();
        if (this.getAttribute("loading") === "eager") this.#show();
        else ShadedPreview.#seen.observe(this);
    }

    disconnectedCallback() {
        ShadedPreview.#seen.unobserve(this);
        this.#drop(this.#flights);
        this.#inSight = false;
        if (this.#url) URL.revokeObjectURL(this.#url);
        this.#url = null;
        this.#asked = "";
    }

    attributeChangedCallback(name, before, value) {
        if (before === value) return;
        if (name === "scene") {
            try {
                this.#scene = value === null ? null : JSON.parse(value);
            } catch (error) {
                this.#fail(0, { title: "The attribute scene is not JSON", detail: error.message });
                return;
            }
        }
        this.#describe();
        this.#measure();
        this.#change();
    }

    get scene() { return this.#scene; }
    set scene(scene) {
        this.#scene = typeof scene === "string" ? JSON.parse(scene) : scene ?? null;
        this.#change();
    }

    get token() { return this.#token; }
    set token(token) {
        this.#token = token || null;
        this.#asked = "";
        this.#change();
    }

    get busy() { return Boolean(this.#flights.length || this.#waits || this.#queued); }
    get image() { return this.#image; }

    /* Asks again for what is shown. */
    refresh() {
        this.#asked = "";
        this.#change();
    }

    #show() {
        ShadedPreview.#seen.unobserve(this);
        this.#inSight = true;
        this.#change();
    }

    #describe() {
        if (!this.isConnected) return;
        const given = this.getAttribute("label");
        const made = ["Preview of", this.getAttribute("material") ?? "a scene",
                      this.hasAttribute("shape") && `on a ${this.getAttribute("shape")}`];
        if (given || !this.hasAttribute("aria-label") || this.#labelled) {
            this.setAttribute("aria-label", given ?? made.filter(Boolean).join(" "));
            this.#labelled = true;
        }
    }
    #labelled = false;

    #measure() {
        const size = this.getAttribute("size");
        const width = this.getAttribute("width") ?? size, height = this.getAttribute("height") ?? size;
        if (width && !this.#scene?.image) this.style.width = `${Number(width)}px`;
        if (height && !this.#scene?.image) this.style.height = `${Number(height)}px`;
    }

    /* Many changes of one moment are one. */
    #change() {
        if (this.#queued || !this.#inSight) return;
        this.#queued = true;
        queueMicrotask(() => {
            this.#queued = false;
            if (!this.isConnected) return;
            if (!this.draft || this.#flights.some(one => !one.draft)) {
                if (this.#flights.length) this.#asked = "";
                this.#drop(this.#flights);
            }
            this.#waits = true;
            if (this.#hasRoom) this.#ask();
        });
    }

    /* A second draft beside the first hides the way there and back. Where the server's own work is
     * what takes long, it would only take the processors from the first. */
    get #hasRoom() {
        const most = this.draft && this.#cost < 30 ? 2 : 1;
        return this.#flights.length < most;
    }

    /* Nothing of these will be shown. */
    #drop(flights) {
        for (const one of [...flights]) {
            one.control.abort();
            this.#flights.splice(this.#flights.indexOf(one), 1);
        }
    }
    #isOver(flight) { return !this.#flights.includes(flight); }

    get #density() { return Math.min(2, globalThis.devicePixelRatio || 1); }

    #link() {
        const material = this.getAttribute("material") ?? "";
        const query = new URLSearchParams();
        for (const name of LINK.slice(1)) {
            const value = this.getAttribute(name);
            if (value === null) continue;
            const isSide = ["size", "width", "height"].includes(name);
            query.set(camel(name), isSide ? Math.round(Number(value) * this.#density)
                                  : SWITCHES.includes(name) ? value || "true" : value);
        }
        return { method: "GET", path: `v1/preview/${encodeURIComponent(material)}?${query}` };
    }

    /* The scene with what a browser can show, and with this element's attributes. */
    #document() {
        const scene = structuredClone(this.#scene);
        if (scene.outputs) {
            const [{ name, ...first }] = scene.outputs;
            scene.output = first;
            delete scene.outputs;
        }
        const output = scene.output ?? {};
        if (output.format && !SHOWN.has(output.format)) {
            for (const name of ["format", "bitDepth", "layers", "compression"]) delete output[name];
        }
        for (const name of ["display", "view", "colorSpace"]) {
            const value = this.getAttribute(name.replace(/[A-Z]/g, c => "-" + c.toLowerCase()));
            if (value !== null) output[name] = value;
        }
        if (Object.keys(output).length) scene.output = output;
        if (!scene.image && this.hasAttribute("size")) {
            const side = Math.round(Number(this.getAttribute("size")) * this.#density);
            scene.image = { width: side, height: side };
        }
        return this.draft ? this.#lighten(scene) : scene;
    }

    /* A draft: as many samples and pixels as are made within a frame of the screen, or two. */
    #lighten(scene) {
        const image = { width: 512, height: 512, samples: 4, ...scene.image };
        let cost = this.#cost;
        if (cost > 16 && image.samples > 1) {
            cost /= image.samples;
            image.samples = 1;
        }
        for (let i = 0; i < 2 && cost > 33 && Math.min(image.width, image.height) >= 128; i++) {
            image.width = Math.round(image.width / 2);
            image.height = Math.round(image.height / 2);
            delete image.region;
            cost /= 4;
        }
        scene.image = image;
        scene.accuracy = { tier: "draft" };
        return scene;
    }

    #request() {
        const scene = this.#scene && this.#document();
        const ask = scene
            ? { method: "POST", path: "v1/render", body: JSON.stringify(scene), image: scene.image }
            : this.#link();
        ask.headers = { Accept: ACCEPT };
        if (ask.body) ask.headers["Content-Type"] = "application/json";
        if (this.#token) ask.headers.Authorization = `Bearer ${this.#token}`;
        ask.url = new URL(ask.path, this.hasAttribute("server")
            ? new URL(this.getAttribute("server"), document.baseURI) : HERE);
        return ask;
    }

    async #ask() {
        this.#waits = false;
        clearTimeout(this.#later);
        if (!this.#scene && !this.hasAttribute("material")) return;
        const { url, method, headers, body, image } = this.#request();
        const asked = `${url} ${body ?? ""}`;
        if (asked === this.#asked) {
            this.removeAttribute("aria-busy");
            return;
        }
        this.#asked = asked;
        const flight = { control: new AbortController(), draft: this.draft };
        this.#flights.push(flight);
        if (!flight.draft) this.setAttribute("aria-busy", "true");
        const started = performance.now();
        try {
            const answer = await fetch(url, { method, headers, body, signal: flight.control.signal });
            if (answer.ok) await this.#take(flight, answer, started, image);
            else await this.#refused(flight, answer);
        } catch (error) {
            if (!this.#isOver(flight) && error.name !== "AbortError")
                this.#fail(0, { title: "The server does not answer", detail: error.message });
        }
        if (this.#isOver(flight)) return;
        this.#flights.splice(this.#flights.indexOf(flight), 1);
        if (this.#waits) this.#ask();
        else if (!this.#flights.length) this.removeAttribute("aria-busy");
    }

    async #refused(flight, answer) {
        const isProblem = answer.headers.get("Content-Type")?.includes("json");
        const problem = isProblem ? await answer.json() : { title: answer.statusText, detail: "" };
        if (this.#isOver(flight)) return;
        this.#asked = "";
        const later = Number(answer.headers.get("Retry-After"));
        clearTimeout(this.#later);
        if (answer.status === 429 && later > 0) this.#later = setTimeout(() => this.refresh(), Math.min(later, 60) * 1000);
        this.#fail(answer.status, problem);
    }

    async #take(flight, answer, started, image) {
        const blob = await answer.blob();
        if (this.#isOver(flight)) return;
        try {
            await (flight.draft ? this.#paint(flight, blob) : this.#load(flight, blob));
        } catch {
            if (!this.#isOver(flight))
                this.#fail(0, { title: "The browser cannot show this picture", detail: blob.type });
            return;
        }
        if (this.#isOver(flight)) return;
        this.#drop(this.#flights.slice(0, this.#flights.indexOf(flight)));
        this.picture = blob;
        this.#message.hidden = true;
        this.#tell(flight, answer, started, image);
    }

    #put(next) {
        if (next === this.#image) return;
        this.#image.replaceWith(next);
        this.#image = next;
    }

    /* As an image, which browsers can save, and show in the colors of the screen. */
    async #load(flight, blob) {
        const url = URL.createObjectURL(blob), next = new Image();
        next.alt = "";
        next.setAttribute("part", "picture");
        next.src = url;
        try {
            await next.decode();
        } finally {
            const isLate = this.#isOver(flight) || !this.isConnected || !next.naturalWidth;
            if (isLate) URL.revokeObjectURL(url);
            else {
                this.#put(next);
                if (this.#url) URL.revokeObjectURL(this.#url);
                this.#url = url;
            }
        }
    }

    /* A draft goes onto a canvas: images are decoded in step with frames, which would halve the rate. */
    async #paint(flight, blob) {
        const bitmap = await createImageBitmap(blob);
        if (this.#isOver(flight) || !this.isConnected) return bitmap.close();
        this.#canvas ??= Object.assign(document.createElement("canvas"), { part: "picture" });
        for (const side of ["width", "height"]) /* which empties it and lays out the page, if it is set */
            if (this.#canvas[side] !== bitmap[side]) this.#canvas[side] = bitmap[side];
        this.#canvas.getContext("bitmaprenderer").transferFromImageBitmap(bitmap);
        this.#put(this.#canvas);
    }

    #tell(flight, answer, started, image) {
        const { timing, reuse } = readTiming(answer.headers.get("Server-Timing"));
        const worked = Object.entries(timing).reduce((sum, [stage, ms]) => sum + (stage === "queue" ? 0 : ms), 0);
        const wanted = { width: 512, height: 512, samples: 4, ...this.#scene?.image };
        const made = { ...wanted, ...image };
        const share = made.width * made.height * made.samples / (wanted.width * wanted.height * wanted.samples);
        this.#cost = worked / share;
        const detail = { ...readPlan(answer.headers.get("Shaded-Plan")), timing, reuse,
                         warnings: readWarnings(answer.headers.get("Shaded-Warning")),
                         milliseconds: performance.now() - started, draft: flight.draft,
                         clipped: Number(answer.headers.get("Shaded-Clipped") ?? 0),
                         bytes: this.picture.size };
        this.plan = detail;
        this.dispatchEvent(new CustomEvent("bound", { detail }));
        this.dispatchEvent(new CustomEvent("load"));
    }

    #fail(status, problem) {
        this.#message.textContent = problem.detail || problem.title;
        this.#message.hidden = false;
        this.dispatchEvent(new CustomEvent("error", { detail: { status, problem } }));
    }
}

/* Each attribute as a property; numbers and texts alike are told as text. */
for (const name of [...LINK, "server", "label", "loading"].filter(one => !SWITCHES.includes(one))) {
    Object.defineProperty(ShadedPreview.prototype, camel(name), {
        configurable: true,
        get() { return this.getAttribute(name); },
        set(value) {
            if (value === null || value === undefined) this.removeAttribute(name);
            else this.setAttribute(name, value);
        },
    });
}
for (const name of SWITCHES) {
    Object.defineProperty(ShadedPreview.prototype, name, {
        configurable: true,
        get() { return this.hasAttribute(name) && this.getAttribute(name) !== "false"; },
        set(value) { this.toggleAttribute(name, Boolean(value)); },
    });
}

if (!customElements.get("shaded-preview")) customElements.define("shaded-preview", ShadedPreview);
