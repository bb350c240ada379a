/* The lights: a card for each, with a ball that says where it stands. */
import { linearOf, toHex } from "./colors.js";
import * as controls from "./controls.js";
import { h, icon, iconButton, tidy } from "./dom.js";
import { Form, outline } from "./form.js";
import { titleOf } from "./hints.js";
import { add, CAMERA, frameOf, length, sub, times, unit } from "./space.js";
import { ball } from "./sphere.js";
import { pointerTo } from "./store.js";

const MINE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const round = list => list.map(x => Number(x.toFixed(3)) || 0);

export class LightsPanel {
    #key = null;
    #form = null;
    #shows = [];

    constructor(element, { schema, store }) {
        Object.assign(this, { element, schema, store });
        this.variants = schema.variants("Light");
        this.types = this.variants.flatMap(one => schema.tags(one, "type"));
        this.list = h("div.cards");
        const add = controls.choice("Add a light", ["", ...this.types], {
            labels: { "": "Add a light …", ...Object.fromEntries(this.types.map(one => [one, titleOf(one)])) },
            change: type => { if (type) this.#add(type); },
        });
        add.element[0].setAttribute("aria-label", "Add a light");
        this.adder = add;
        element.append(this.list, h("div.add", {}, icon("plus"), ...add.element));
    }

    #variant(light) {
        return this.variants.find(one => light.type ? this.schema.tags(one, "type").includes(light.type) : !one.properties.type);
    }
    #usual(light, name) {
        const part = this.#variant(light)?.properties[name];
        return part && this.schema.of(part).default;
    }

    #add(type) {
        const light = { type };
        const properties = this.#variant(light).properties;
        if (properties.position && properties.type && type !== "directional") {
            light.position = [-2, 2, 3];
            if (properties.direction) light.direction = [2, -2, -3];
            if (["rect", "disc", "sphere"].includes(type)) light.intensity = 12;
        } else if (properties.direction) light.direction = [1, -1, -1];
        if (type === "ambient") light.intensity = 0.1;
        if (properties.map) light.map = "studio";
        this.store.set("/lights", [...(this.store.scene.lights ?? []), light]);
        this.adder.show("");
    }

    #basis(pointer) {
        return () => this.store.get(pointer)?.frame === "camera" ? MINE : frameOf(this.store.scene.camera);
    }
    #middle(pointer) {
        return this.store.get(pointer)?.frame === "camera" ? [0, 0, 0] : this.store.scene.camera?.target ?? CAMERA.target;
    }

    /* From where it shines on the middle of the scene; null: from nowhere. */
    #from(pointer) {
        const light = this.store.get(pointer);
        const position = light.position ?? (light.direction ? undefined : this.#usual(light, "position"));
        if (position?.length === 4 && position[3] === 0) return position.slice(0, 3);
        if (light.type === "directional") return times(light.direction ?? this.#usual(light, "direction"), -1);
        return position ? sub(position.slice(0, 3).map(x => x / (position[3] ?? 1)), this.#middle(pointer)) : null;
    }

    #move(pointer, direction, far, options) {
        const light = this.store.get(pointer), arm = times(unit(direction), far);
        if (light.type === "directional" && !light.position) {
            this.store.set(pointer, { ...light, direction: round(times(unit(direction), -1)) }, { ...options, kind: pointer + "/move" });
        } else if (light.position?.length === 4 && light.position[3] === 0) {
            this.store.set(pointer, { ...light, position: [...round(unit(direction)), 0] }, { ...options, kind: pointer + "/move" });
        } else {
            const moved = { ...light, position: round(add(this.#middle(pointer), arm)) };
            if (light.position?.length === 4) moved.position.push(1);
            if ("direction" in (this.#variant(light)?.properties ?? {})) moved.direction = round(times(unit(direction), -1));
            this.store.set(pointer, moved, { ...options, kind: pointer + "/move" });
        }
    }

    #card(i) {
        const pointer = pointerTo("lights", i), light = this.store.get(pointer), variant = this.#variant(light);
        const title = light.name || `Light ${i + 1}`;
        const chip = h("span.chip");
        const pick = controls.choice(`Type of ${title}`, this.types, { labels: Object.fromEntries(this.types.map(one => [one, titleOf(one)])), change: type => this.#retype(pointer, type) });
        pick.element[0].setAttribute("aria-label", `Type of ${title}`);
        const head = h("div.card-head", {}, chip, h("span.card-title", {}, title), ...pick.element,
                       iconButton("close", `Remove ${title}`, () => this.store.set("/lights", this.store.scene.lights.filter((_, k) => k !== i))));
        const place = this.#place(pointer, title, light);
        const rows = variant ? this.#form.members(variant, pointer, { skip: ["type", "name", ...(place ? light.type === "directional" ? ["position", "direction"] : ["position"] : [])] }) : [];
        const first = new Set(["color", "intensity"].map(name => pointer + "/" + name));
        const isFirst = one => first.has(one.dataset.pointer);
        const rest = rows.filter(one => !isFirst(one));
        this.#shows.push(() => {
            const now = this.store.get(pointer), rgb = linearOf(now.color ?? 1);
            chip.style.background = rgb ? toHex(rgb) : "";
            pick.show(now.type ?? "");
        });
        return h("section.card.light", { "aria-label": title }, head, h("div.place", {}, place?.ball, h("div.rows", {}, ...rows.filter(isFirst), ...(place?.rows ?? []))),
                 rest.length ? h("details.more", {}, h("summary", {}, "More"), h("div.rows", {}, ...rest)) : null);
    }

    #retype(pointer, type) {
        const light = this.store.get(pointer), properties = this.#variant({ type }).properties, from = this.#from(pointer);
        const made = { type };
        for (const [name, value] of Object.entries(light)) if (name in properties && name !== "type") made[name] = value;
        if (type === "directional") delete made.position;
        if (properties.map) made.map ??= "studio";
        this.store.set(pointer, made);
        if (from && type !== "ambient" && !properties.map) this.#move(pointer, from, Math.max(1, length(from)), { keep: false });
    }

    #place(pointer, title, light) {
        if (!this.#from(pointer)) return null;
        const handle = ball(`Place of ${title}`, {
            basis: this.#basis(pointer), settle: () => this.store.settle(),
            change: (direction, how) => this.#move(pointer, direction, length(this.#from(pointer)), how),
        });
        const isFar = light.type === "directional" || light.position?.[3] === 0;
        const member = isFar && light.type === "directional" && !light.position ? "direction" : "position";
        const size = light.position?.length ?? 3;
        const numbers = controls.vector(titleOf(member), size, { change: value => this.store.set(`${pointer}/${member}`, value) });
        const rows = [controls.row({ title: titleOf(member), id: numbers.id, pointer: `${pointer}/${member}` }, ...numbers.element).element];
        const distance = isFar ? null : controls.number("distance", "Distance", { from: 0.5, to: 12, curve: 1, unit: "" }, {
            settle: () => this.store.settle(), change: (far, how) => { if (far > 0) this.#move(pointer, this.#from(pointer), far, how); },
        });
        if (distance) rows.push(controls.row({ title: "Distance", id: distance.id }, ...distance.element).element);
        this.#shows.push(() => {
            const now = this.store.get(pointer), from = this.#from(pointer);
            handle.show(from);
            handle.element.style.setProperty("--light", toHex(linearOf(now.color ?? 1) ?? [1, 1, 1]));
            numbers.show(now[member] ?? this.#usual(now, member));
            distance?.show(tidy(length(from)));
        });
        return { ball: handle.element, rows };
    }

    show() {
        const { lights } = this.store.scene;
        const key = JSON.stringify([lights === undefined, (lights ?? []).map(one => [one.type, one.name, one.position?.length, one.direction && 1, outline(one)])]);
        if (key !== this.#key) {
            const open = [...this.list.children].map(card => card.querySelector("details")?.open);
            this.#shows = [];
            this.#form = new Form(this.schema, this.store, { basis: () => frameOf(this.store.scene.camera) });
            const cards = (lights ?? []).map((_, i) => this.#card(i));
            cards.forEach((card, i) => { if (open[i] && card.querySelector("details")) card.querySelector("details").open = true; });
            const note = lights === undefined ? "None is given: one light shines along the view." : "No light: all is dark but for what shines by itself.";
            this.list.replaceChildren(...(cards.length ? cards : [h("p.note", {}, note)]));
        }
        this.#key = key;
        for (const show of this.#shows) show();
        this.#form.show();
        this.adder.show("");
    }
}
