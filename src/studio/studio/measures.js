/* What is in the picture, and what the material does with light. */
import { Latest } from "./api.js";
import * as controls from "./controls.js";
import { debounce, figure, h, svg } from "./dom.js";
import { titleOf } from "./hints.js";

const WIDTH = 256, HEIGHT = 84;

/* The outline of an area. */
function area(values, most) {
    const x = i => (i / (values.length - 1) * WIDTH).toFixed(1), y = value => (HEIGHT - Math.min(1, value / most) * (HEIGHT - 2)).toFixed(1);
    const line = values.map((value, i) => `${i ? "L" : "M"}${x(i)} ${y(value)}`).join("");
    return `${line}L${WIDTH} ${HEIGHT}L0 ${HEIGHT}Z`;
}

export class ScopePanel {
    #latest = new Latest();
    #bound = "histogram";

    constructor(element, { schema, store, preview }) {
        Object.assign(this, { schema, store });
        const scope = schema.of("OutputMembers").properties.scope;
        this.kinds = scope ? schema.of(scope).enum : null;
        const spaces = { rgb: "RGB", hsv: "HSV", yiq: "YIQ", lab: "Lab" };
        this.space = "rgb";
        this.pick = controls.segments("Channels", Object.keys(spaces), { labels: spaces, change: value => { this.space = value; this.#draw(); } });
        this.plot = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img", class: "histogram", "aria-label": "Histogram" });
        this.table = h("table.channels");
        this.counts = h("p.note");
        const head = h("div.panel-head", {}, h("h2", {}, "Scopes"), ...this.pick.element);
        element.append(head, this.plot, this.table, this.counts);
        if (this.kinds) element.append(this.#scopes(preview));
        element.append(this.#planes(preview));
        this.soon = debounce(200, seen => this.#ask(seen));
    }

    /* Pictures of scopes, where the daemon draws them. */
    #scopes(preview) {
        this.scope = preview({ class: "scope", label: "Vectorscope" });
        this.kind = this.kinds[0];
        const pick = controls.choice("Scope", this.kinds, { labels: Object.fromEntries(this.kinds.map(one => [one, titleOf(one)])), change: value => { this.kind = value; this.#drawScope(); } });
        pick.element[0].setAttribute("aria-label", "Scope");
        pick.show(this.kind);
        return h("div.scope-box", {}, ...pick.element, this.scope);
    }

    #drawScope() {
        if (!this.scope) return;
        const scene = structuredClone(this.store.scene);
        delete scene.outputs;
        scene.image = { ...scene.image, width: 256, height: 256 };
        delete scene.image.region;
        scene.output = { ...scene.output, scope: this.kind };
        for (const name of ["format", "bitDepth", "layers", "channel", "compression", "dither"]) delete scene.output[name];
        this.scope.setAttribute("label", titleOf(this.kind));
        this.scope.scene = scene;
    }

    /* The channels of spaces as grey pictures, side by side. */
    #planes(preview) {
        const spaces = [[null, "R", "G", "B"], ["YIQ", "Y", "I", "Q"], ["HSV", "H", "S", "V"]];
        const sets = { "YIQ, HSV": spaces.slice(1), RGB: spaces.slice(0, 1) };
        this.planes = sets["YIQ, HSV"];
        const pick = controls.segments("Planes", Object.keys(sets), { change: value => { this.planes = sets[value]; this.#drawPlanes(); } });
        pick.show("YIQ, HSV");
        this.planePictures = [0, 1, 2, 3, 4, 5].map(() => ({ picture: preview({}), name: h("figcaption") }));
        return h("div.plane-box", {}, h("div.panel-head", {}, h("h3", {}, "Planes"), ...pick.element),
                 h("div.planes", {}, ...this.planePictures.map(({ picture, name }) => h("figure", {}, picture, name))));
    }

    #drawPlanes() {
        const planes = this.planes.flatMap(([space, ...channels]) => channels.map(channel => [space, channel]));
        for (const [i, { picture }] of this.planePictures.entries()) picture.parentElement.hidden = i >= planes.length;
        planes.forEach(([space, channel], i) => {
            const scene = structuredClone(this.store.scene), { width = 512, height = 512 } = scene.image ?? {};
            delete scene.outputs;
            const scale = 112 / Math.max(width, height);
            scene.image = { ...scene.image, width: Math.max(1, Math.round(width * scale)), height: Math.max(1, Math.round(height * scale)) };
            delete scene.image.region;
            const { exposure, gamma, looks, display, view } = scene.output ?? {};
            scene.output = JSON.parse(JSON.stringify({ exposure, channel, ...(space ? { colorSpace: space } : { gamma, looks, display, view }) }));
            const { picture, name } = this.planePictures[i];
            picture.setAttribute("label", `Plane ${channel} of ${space ?? "RGB"}`);
            name.textContent = channel;
            picture.scene = scene;
        });
    }

    take(bound) {
        if (!bound.draft) this.soon(this.store.scene);
    }

    /* `seen`: the scene that there is a picture of. What has come since may have mistakes. */
    async #ask(seen) {
        const { scene } = this.store;
        if (scene !== seen) return;
        this.#drawScope();
        this.#drawPlanes();
        try {
            const told = await this.#latest.post("v1/analyze", scene);
            if (!told || scene !== this.store.scene) return;
            [this.told] = told.outputs;
            this.#draw();
        } catch (error) {
            this.counts.textContent = error.message;
        }
    }

    #draw() {
        this.pick.show(this.space);
        if (!this.told) return;
        const channels = this.told[this.space];
        this.plot.replaceChildren();
        this.table.replaceChildren();
        if (!channels) {
            this.counts.textContent = this.told.reasons[this.space];
            return;
        }
        /* The background would dwarf the rest: the highest bin but three sets the scale. */
        const all = channels.flatMap(one => one.histogram.counts).sort((a, b) => b - a), most = Math.max(1, all[Math.min(6, all.length - 1)]);
        channels.forEach((one, i) => this.plot.append(svg("path", { d: area(one.histogram.counts, most), class: `channel channel-${this.space}-${i}` })));
        this.plot.setAttribute("aria-label", `Histogram of ${channels.map(one => one.name).join(", ")}`);
        this.table.append(h("thead", {}, h("tr", {}, h("td"), ...["min", "mean", "max"].map(name => h("th", { scope: "col" }, name)))),
                          h("tbody", {}, ...channels.map((one, i) => h("tr", {}, h("th", { scope: "row" }, h("i", { class: `key channel-${this.space}-${i}` }), one.name),
                                                                       ...[one.min, one.mean, one.max].map(value => h("td", {}, figure(value)))))));
        const { clipped, outOfGamut, nonFinite } = this.told;
        const parts = [clipped ? `${clipped} samples clipped` : clipped === 0 ? "Nothing clipped" : null, outOfGamut ? `${outOfGamut} pixels out of gamut` : null,
                       nonFinite ? `${nonFinite} not finite` : null].filter(Boolean);
        this.counts.textContent = parts.join(" · ");
    }
}

export class LobePanel {
    #picture = new Latest();
    #figures = new Latest();
    #url = null;
    #asked = "";

    constructor(element, { store, material }) {
        Object.assign(this, { store, material });
        this.image = h("img.lobe", { alt: "The lobe: where light from 45 degrees goes, and the share of light that is sent on, by its angle" });
        this.verdict = h("ul.words");
        element.append(h("h2", {}, "Reflectance"), this.image, this.verdict);
        this.soon = debounce(250, seen => this.#ask(seen));
    }

    take(bound) {
        if (!bound.draft) this.soon(this.store.scene);
    }

    async #ask(seen) {
        if (this.store.scene !== seen) return;
        const { materials, workingSpace, colorSpace, spectral } = this.store.scene;
        const material = this.material();
        const scene = JSON.parse(JSON.stringify({ workingSpace, colorSpace, spectral, materials, objects: [{ type: "sphere", material }] }));
        const asked = JSON.stringify(scene);
        if (asked === this.#asked) return;
        this.#asked = asked;
        try {
            const [picture, told] = await Promise.all([this.#picture.post("v1/brdf", scene, { accept: "image/svg+xml" }), this.#figures.post("v1/brdf", scene)]);
            if (!picture || !told) return;
            if (this.#url) URL.revokeObjectURL(this.#url);
            this.#url = URL.createObjectURL(picture);
            this.image.src = this.#url;
            this.verdict.replaceChildren(...[told.materials[0].verdict].flat().map(word => h("li", {}, word)));
        } catch (error) {
            this.#asked = "";
            this.verdict.replaceChildren(h("li", {}, error.message));
        }
    }
}
