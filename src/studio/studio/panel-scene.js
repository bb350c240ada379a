/* The chosen object and its shape, the camera, the picture, and rays. */
import * as controls from "./controls.js";
import { h } from "./dom.js";
import { Form, outline } from "./form.js";
import { titleOf } from "./hints.js";
import { frameOf } from "./space.js";
import { pointerTo } from "./store.js";

const GROUND = { type: "plane", name: "ground", material: { diffuse: 0.18 }, transform: { translate: [0, -1, 0] } };

export class ScenePanel {
    #key = null;
    #form = null;

    constructor(element, { schema, store, shapes, choice }) {
        Object.assign(this, { element, schema, store, choice });
        this.variants = schema.variants("SceneObject");
        this.shapes = shapes.map(one => one.type).filter(type => type !== "mesh");
    }

    #variant(object) {
        const fit = this.variants.filter(one => this.schema.tags(one, "type").includes(object.type));
        return fit.find(one => (one.required ?? []).every(name => name in object)) ?? fit[0];
    }

    #reshape(type) {
        const pointer = pointerTo("objects", this.choice.object), before = this.store.get(pointer);
        const properties = this.#variant({ type })?.properties ?? {}, made = { type };
        for (const name of ["name", "transform", "interpolation", "segments", "material"])
            if (before?.[name] !== undefined && (name in properties)) made[name] = before[name];
        if (type === "plane" && before?.transform === undefined) made.transform = { translate: [0, -1, 0] };
        this.store.set(pointer, made);
    }

    #shape(pointer, object) {
        const name = h("div.chips", { role: "radiogroup", "aria-label": "Shape" });
        for (const type of this.shapes) {
            const input = h("input", { type: "radio", name: "shape", value: type });
            input.addEventListener("change", () => this.#reshape(type));
            name.append(h("label.chip-choice", {}, input, h("span", {}, titleOf(type))));
        }
        this.#form.shows.push(() => {
            const now = this.store.get(pointer)?.type;
            for (const input of name.querySelectorAll("input")) input.checked = input.value === now;
        });
        const variant = object && this.#variant(object);
        const large = ["positions", "indices", "normals"];
        return [name, ...(variant ? this.#form.members(variant, pointer, { skip: ["type", "name", "material", ...large] }) : [])];
    }

    #objects() {
        const { objects } = this.store.scene;
        if (objects.length < 2) return null;
        const pick = controls.choice("Object", objects.map((_, i) => String(i)), {
            labels: Object.fromEntries(objects.map((one, i) => [i, one.name || `${titleOf(one.type ?? "object")} ${i + 1}`])),
            change: value => this.choice.take(Number(value)),
        });
        this.#form.shows.push(() => pick.show(String(this.choice.object)));
        return controls.row({ title: "Object", id: pick.id, help: "The one that these controls and those of the material are for" }, ...pick.element).element;
    }

    #toggle(title, help, is, change) {
        const control = controls.toggle(title, { change });
        this.#form.shows.push(() => control.show(is()));
        return controls.row({ title, help, id: control.id }, ...control.element).element;
    }

    #ground() {
        const isGround = one => one.type === "plane" && one.name === "ground";
        return this.#toggle("Ground", "An endless plane below", () => this.store.scene.objects.some(isGround), on => {
            const rest = this.store.scene.objects.filter(one => !isGround(one));
            if (!on) this.choice.take(Math.min(this.choice.object, Math.max(0, rest.length - 1)));
            this.store.set("/objects", on ? [...rest, GROUND] : rest);
        });
    }

    #camera() {
        const camera = this.store.scene.camera ?? {};
        const variants = this.schema.variants("Camera"), types = variants.map(one => this.schema.tags(one, "type")[0]);
        const pick = controls.segments("Projection", types, {
            labels: Object.fromEntries(types.map(one => [one, titleOf(one)])),
            change: type => {
                const { fov, height, ...rest } = this.store.scene.camera ?? {};
                this.store.set("/camera", { ...rest, type, ...(type === "orthographic" ? { height: height ?? 2.6 } : fov && { fov }) });
            },
        });
        this.#form.shows.push(() => pick.show(this.store.scene.camera?.type ?? types[0]));
        const variant = variants[Math.max(0, types.indexOf(camera.type ?? types[0]))];
        return [controls.row({ title: "Projection" }, ...pick.element).element, ...this.#form.members(variant, "/camera", { skip: ["type"] })];
    }

    #build() {
        const { scene } = this.store, pointer = pointerTo("objects", this.choice.object);
        this.#form = new Form(this.schema, this.store, { basis: () => frameOf(this.store.scene.camera) });
        const all = this.schema.of("Scene").properties;
        const one = (name, title) => this.#form.member(all[name], name, "/" + name, { title });
        const group = (title, open, ...rows) => {
            const known = this.element.querySelector(`[data-group="${title}"]`);
            return h("details.section", { open: known ? known.open : open, "data-group": title }, h("summary", {}, h("h2", {}, title)),
                     h("div.rows", {}, ...rows.flat().filter(Boolean)));
        };
        const spectral = this.#toggle("Spectral", this.schema.of("Spectral").description, () => this.store.scene.spectral,
                                      on => this.store.set("/spectral", on || undefined));
        this.element.replaceChildren(
            group("Object", true, this.#objects(), this.#shape(pointer, scene.objects[this.choice.object]), this.#ground()),
            group("Camera", false, this.#camera()),
            group("Picture", false, this.#form.members(this.schema.of("Image"), "/image", { skip: ["region"] }), one("background")),
            group("Rays", false, this.#form.members(this.schema.of("Trace"), "/trace")),
            group("Light and color", false, one("ambient", "Ambient light"), spectral, one("interpolation")));
    }

    show() {
        const { scene } = this.store;
        const key = JSON.stringify([this.choice.object, scene.objects.map(one => [one.type, one.name]), outline(scene.objects[this.choice.object]), scene.camera?.type,
                                    typeof scene.spectral, outline(scene.trace ?? {})]);
        if (key !== this.#key) this.#build();
        this.#key = key;
        this.#form.show();
    }
}
