/* What the picture becomes: a display and its view, or a color space; and how it is adjusted. */
import * as controls from "./controls.js";
import { h } from "./dom.js";
import { Form } from "./form.js";
import { titleOf } from "./hints.js";

const OWN = ["display", "view", "colorSpace", "format", "looks", "layers", "scope"];

export class ColorPanel {
    #form = null;
    #key = null;

    constructor(element, { schema, store, colors }) {
        Object.assign(this, { element, schema, store, colors });
    }

    get output() { return this.store.scene.output ?? {}; }

    #take(change, drop = []) {
        const output = { ...this.output, ...change };
        for (const name of Object.keys(output)) if (output[name] === undefined || drop.includes(name)) delete output[name];
        this.store.set("/output", Object.keys(output).length ? output : undefined);
    }

    #row(title, control, pointer, help) {
        return controls.row({ title, id: control.id, pointer, help, reset: () => this.store.set(pointer, undefined) }, ...control.element);
    }

    #shown() {
        const { displays, spaces, defaults } = this.colors;
        const isSpace = this.output.colorSpace !== undefined;
        const how = controls.segments("Shown as", ["view", "space"], {
            labels: { view: "Display", space: "Color space" },
            change: value => value === "view" ? this.#take({}, ["colorSpace", "channel"]) : this.#take({ colorSpace: "YIQ" }, ["display", "view", "channel"]),
        });
        this.#form.shows.push(() => how.show(isSpace ? "space" : "view"));
        const rows = [controls.row({ title: "Shown as" }, ...how.element)];
        if (isSpace) {
            const space = controls.choice("Color space", spaces.map(one => one.name), { change: colorSpace => this.#take({ colorSpace }, ["channel"]) });
            this.#form.shows.push(() => space.show(this.output.colorSpace));
            rows.push(this.#row("Color space", space, "/output/colorSpace"));
        } else {
            const name = this.output.display ?? defaults.display ?? displays[0]?.name;
            const display = controls.choice("Display", displays.map(one => one.name), { change: value => this.#take({ display: value }, ["view"]) });
            const views = displays.find(one => one.name === name)?.views ?? [];
            const view = controls.choice("View", views, { change: value => this.#take({ display: name, view: value }) });
            this.#form.shows.push(() => {
                display.show(name);
                view.show(this.output.view ?? views[0]);
            });
            rows.push(this.#row("Display", display, "/output/display"), this.#row("View", view, "/output/view"));
        }
        return rows.map(one => one.element);
    }

    #channel() {
        const space = this.colors.spaces.find(one => one.name === this.output.colorSpace || one.aliases.includes(this.output.colorSpace));
        const names = ["", ...(space?.channels ?? ["R", "G", "B"])];
        const pick = controls.segments("Channel", names, { labels: { "": "All" }, change: value => this.#take({ channel: value || undefined }) });
        this.#form.shows.push(() => pick.show(this.output.channel ?? ""));
        return controls.row({ title: "Channel", pointer: "/output/channel", help: "One channel, as a grey picture" }, ...pick.element).element;
    }

    #looks() {
        return this.colors.looks.map(({ name, description }) => {
            const control = controls.toggle(name, { change: on => {
                const rest = (this.output.looks ?? []).filter(one => one !== name), looks = on ? [...rest, name] : rest;
                this.#take({ looks: looks.length ? looks : undefined });
            } });
            this.#form.shows.push(() => control.show(this.output.looks?.includes(name)));
            return controls.row({ title: name, help: description, id: control.id, long: true }, ...control.element).element;
        });
    }

    #working() {
        return ["workingSpace", "colorSpace"].map(name => {
            const { spaces, defaults } = this.colors;
            const names = spaces.filter(one => name !== "workingSpace" || one.sceneLinear).map(one => one.name);
            const pick = controls.choice(titleOf(name), names, { change: value => this.store.set("/" + name, value) });
            this.#form.shows.push(() => pick.show(this.store.scene[name] ?? defaults[name]));
            const title = name === "colorSpace" ? "Colors given in" : "Working space";
            return this.#row(title, pick, "/" + name, this.schema.of("Scene").properties[name].description).element;
        });
    }

    #build() {
        this.#form = new Form(this.schema, this.store, {});
        const members = this.schema.of("OutputMembers");
        const group = (title, ...rows) => h("section.section", {}, h("h2", {}, title), h("div.rows", {}, ...rows.flat()));
        const file = ["bitDepth", "quality", "effort", "dither", "matte", "compression"].filter(name => name in members.properties);
        const rest = Object.keys(members.properties).filter(name => !OWN.includes(name) && !file.includes(name) && name !== "channel");
        this.element.replaceChildren(
            group("Display", this.#shown(), this.#channel()),
            group("Adjust", this.#form.members(members, "/output", { only: rest }), this.#looks()),
            group("Spaces", this.#working()),
            group("File", this.#form.members(members, "/output", { only: file })));
    }

    show() {
        const { colorSpace, display } = this.output;
        const key = JSON.stringify([colorSpace, display]);
        if (key !== this.#key) this.#build();
        this.#key = key;
        this.#form.show();
    }
}
