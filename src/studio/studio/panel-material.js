/* The material of the chosen object: the library, the model, and all that the model has. */
import { linearOf } from "./colors.js";
import * as controls from "./controls.js";
import { h } from "./dom.js";
import { Form, outline } from "./form.js";
import { pointerTo, replaced } from "./store.js";

const firstSentence = text => (text ?? "").replace(/\s+/g, " ").split(/(?<=[a-z)])\. /)[0].replaceAll("`", "").replace(/\.?$/, ".");

export class MaterialPanel {
    #key = null;
    #form = null;

    constructor(element, { schema, store, library, choice, basis, preview }) {
        Object.assign(this, { element, schema, store, library, choice, basis, preview });
        this.variants = schema.variants("Material");
        this.gallery = this.#makeGallery();
        this.body = h("div.rows");
        element.append(this.gallery, this.body);
    }

    /* Where the material is: the object's own, or the one that it names. */
    get pointer() {
        const own = pointerTo("objects", this.choice.object, "material"), value = this.store.get(own);
        const isNamed = typeof value === "string" && this.store.scene.materials?.[value] !== undefined;
        return isNamed ? pointerTo("materials", value) : own;
    }

    /* As an object, also where the document has the name of a library material. */
    get material() {
        const value = this.store.get(this.pointer);
        return typeof value === "string" ? { preset: value } : value ?? {};
    }

    #entry(name) { return this.library.find(one => one.name === name); }
    get model() { return this.material.model ?? this.#entry(this.material.preset)?.model ?? "phong"; }

    #makeGallery() {
        const pick = name => this.store.set(this.pointer, { preset: name });
        const thumbs = this.library.map((one, i) => h("button.thumb", {
            type: "button", role: "radio", "aria-checked": "false", tabindex: i ? "-1" : "0", title: one.name.replaceAll("-", " "),
            "aria-label": one.name.replaceAll("-", " "), "data-name": one.name, onclick: () => pick(one.name),
        }, this.preview({ material: one.name, size: "48", samples: "9", "aria-hidden": "true" })));
        const grid = h("div.gallery", { role: "radiogroup", "aria-label": "Library" }, ...thumbs);
        grid.addEventListener("keydown", event => {
            const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -1, ArrowDown: 1, Home: -1e6, End: 1e6 }[event.key];
            const seen = thumbs.filter(one => !one.hidden), i = seen.indexOf(document.activeElement);
            if (!step || i < 0) return;
            event.preventDefault();
            const next = seen[Math.min(seen.length - 1, Math.max(0, i + step))];
            next.focus();
            pick(next.dataset.name);
        });
        const filter = h("input.search", { type: "search", placeholder: `${this.library.length} materials`, "aria-label": "Find a material" });
        filter.addEventListener("input", () => {
            const words = filter.value.toLowerCase().split(/\s+/);
            for (const one of thumbs) one.hidden = !words.every(word => one.dataset.name.includes(word));
        });
        this.thumbs = thumbs;
        return h("div.library", {}, h("div.library-head", {}, h("h2", {}, "Library"), filter), grid);
    }

    #takeModel(model) {
        const variant = this.variants.find(one => this.schema.tags(one, "model").includes(model));
        const before = this.material, entry = this.#entry(before.preset);
        const made = { model };
        for (const [name, value] of Object.entries(before))
            if (name in variant.properties && !["model", "preset", "lobes", "fresnel"].includes(name)) made[name] = value;
        /* What the library says stays in sight where the model has it. */
        for (const name of ["diffuse", "specular", "shininess"])
            if (entry && name in variant.properties && made[name] === undefined && entry.model === "phong") made[name] = entry[name];
        for (const name of variant.required ?? [])
            if (made[name] === undefined) made[name] = { type: this.schema.tags(this.schema.variants(variant.properties[name])[0], "type")[0] };
        this.store.set(this.pointer, made);
    }

    #build() {
        const model = this.model;
        const variant = this.variants.find(one => this.schema.tags(one, "model").includes(model)) ?? this.variants[0];
        this.#form = new Form(this.schema, this.#view(), {
            basis: this.basis,
            usual: name => name === "ambient" ? this.#usual("ambient") ?? this.material.diffuse ?? this.#usual("diffuse") : this.#usual(name),
        });
        const models = this.variants.flatMap(one => this.schema.tags(one, "model"));
        const pick = controls.choice("Model", [...new Set(models)], { change: value => this.#takeModel(value) });
        const line = controls.row({ title: "Model", pointer: `${this.pointer}/model`, id: pick.id,
                                    help: this.schema.of("Model").description }, ...pick.element);
        this.#form.shows.push(() => pick.show(this.model));
        const rows = this.#form.members(variant, this.pointer, { skip: ["model", "preset"] });
        this.body.replaceChildren(line.element, h("p.note", {}, firstSentence(variant.description)), ...rows);
    }

    /* The store, which makes an object of a material's name before it sets a member of it. */
    #view() {
        const panel = this;
        return {
            get: pointer => panel.store.get(pointer),
            settle: () => panel.store.settle(),
            set(pointer, value, options) {
                const own = panel.pointer;
                if (typeof panel.store.get(own) !== "string") panel.store.set(pointer, value, options);
                else panel.store.set(own, replaced(panel.material, pointer.slice(own.length), value), { ...options, kind: pointer });
            },
        };
    }

    #usual(name) {
        const entry = this.#entry(this.material.preset);
        if (!entry || !(name in entry) || name === "model") return undefined;
        const value = entry[name];
        return Array.isArray(value) && linearOf(value).every(one => one === value[0]) ? value[0] : value;
    }

    show() {
        const key = JSON.stringify([this.pointer, this.model, this.material.preset, outline(this.material)]);
        if (key !== this.#key) this.#build();
        this.#key = key;
        this.#form.show();
        const preset = this.material.preset;
        let first = true;
        for (const one of this.thumbs) {
            const isChosen = one.dataset.name === preset;
            one.setAttribute("aria-checked", String(isChosen));
            one.tabIndex = isChosen ? 0 : -1;
            first &&= !isChosen;
        }
        if (first && this.thumbs.length) this.thumbs[0].tabIndex = 0;
    }
}
