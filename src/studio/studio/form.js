/* Forms made from the schema: a row for each member, by what kind of value it takes. */
import * as controls from "./controls.js";
import { h, icon, iconButton, tidy } from "./dom.js";
import { leastVaried, rangeOf, titleOf } from "./hints.js";
import { pointerTo } from "./store.js";
import { sphere } from "./sphere.js";

/* `usual(name)`: what a member is where the document does not say, if the schema's default is not it. */
export class Form {
    constructor(schema, store, { usual = () => undefined, basis } = {}) {
        this.schema = schema;
        this.store = store;
        this.usual = usual;
        this.basis = basis;
        this.shows = [];
    }

    /* The rows of an object's members. */
    members(variant, pointer, { skip = [], only = null } = {}) {
        return Object.keys(variant.properties ?? {})
            .filter(name => !skip.includes(name) && (!only || only.includes(name)))
            .map(name => this.member(variant.properties[name], name, pointer + pointerTo(name)))
            .filter(Boolean);
    }

    show() { for (const show of this.shows) show(); }

    #watch(pointer, show, fallback) {
        this.shows.push(() => {
            const value = this.store.get(pointer);
            show(value ?? fallback(), value !== undefined);
        });
    }

    member(part, name, pointer, { title = titleOf(name) } = {}) {
        const schema = this.schema.of(part), kind = this.schema.kind(part);
        if (kind === "constant") return null;
        if (kind === "list") return this.#list(schema, name, pointer, title);
        if (kind === "group") return this.#group(title, this.members(schema, pointer));
        if (kind === "variants") return this.#variants(schema, pointer, title);
        if (kind === "varied") return this.#varied(schema, name, pointer, title);
        return this.#plain(kind, schema, name, pointer, title);
    }

    /* A row with one control. */
    #plain(kind, schema, name, pointer, title) {
        const usual = () => this.usual(name, pointer) ?? schema.default ?? toldDefault(schema);
        const control = this.#control(kind, schema, name, pointer, title);
        const line = controls.row({ title, help: schema.description, pointer, id: control.id, wide: kind === "direction",
                                    reset: () => this.store.set(pointer, undefined) }, ...control.element);
        this.#watch(pointer, (value, isSet) => {
            control.show(value);
            line.mark(isSet);
        }, usual);
        return line.element;
    }

    #control(kind, schema, name, pointer, title) {
        const change = (value, { live = false } = {}) => this.store.set(pointer, value, { live });
        const tell = { change, settle: () => this.store.settle() };
        const size = this.schema.vectorSize(schema);
        if (kind === "color") return controls.color(title, { ...tell, to: name === "ambient" && pointer === "/ambient" ? 0.5 : 1 });
        if (kind === "number") return controls.number(name, title, rangeOf(name, this.schema.varied(schema)?.number ?? schema), tell);
        if (kind === "boolean") return controls.toggle(title, tell);
        if (kind === "choice") return controls.choice(title, schema.enum, tell);
        if (kind === "direction") return sphere(title, { ...tell, basis: this.basis, kind: name === "up" ? "up" : "travels" });
        if (size) return controls.vector(title, size, { ...tell, isWhole: schema.items?.type === "integer", names: NAMES[name] });
        if (kind === "string") return controls.text(title, tell);
        const choices = (schema.anyOf ?? []).map(one => this.schema.of(one)), options = choices.find(one => one.enum)?.enum;
        const isText = choices.length && choices.every(one => one.type === "string");
        return (isText ? controls.text : controls.json)(title, { ...tell, options });
    }

    #group(title, rows) {
        return h("fieldset.group", {}, h("legend", {}, title), ...rows);
    }

    /* A number, and what may tell it at each point of a surface instead: a pattern or a picture. */
    #varied(schema, name, pointer, title) {
        const { number, others } = this.schema.varied(schema);
        const fresh = one => ({ ...this.#fresh(one), values: pairOf(this.store.get(pointer) ?? this.usual(name, pointer) ?? schema.default,
                                                                    leastVaried(name, number)) });
        const choices = { ...schema, oneOf: others };
        if (isObject(this.store.get(pointer))) return this.#variants(choices, pointer, title, { fresh });
        return h("div.variant", {}, this.#plain("number", schema, name, pointer, title),
                 this.#variants(choices, pointer, "Varies by", { fresh, none: "nothing" }));
    }

    /* One of several objects, told apart by `type`, `pattern` or the member that they need. `none`: what it is
     * called where there is none. */
    #variants(schema, pointer, title, { fresh = one => this.#fresh(one), none = "default" } = {}) {
        const variants = this.schema.variants(schema);
        const nameOf = one => one.properties.type?.const ?? one.properties.pattern?.const ?? this.schema.tags(one, "type")[0] ?? one.required?.[0] ?? Object.keys(one.properties)[0];
        const tagOf = value => value.type ?? value.pattern;
        const fits = (one, value) => tagOf(value) !== undefined ? nameOf(one) === tagOf(value)
            : Object.keys(value).every(key => key in one.properties);
        const held = this.store.get(pointer), value = isObject(held) ? held : undefined;
        const plain = variants.find(one => !one.required?.length);
        const now = value ? variants.find(one => fits(one, value)) : plain;
        const names = variants.map(nameOf);
        const pick = controls.choice(title, plain ? names : ["", ...names], {
            labels: { "": none, ...Object.fromEntries(names.map((one, i) => [one, variants[i] === plain ? "Steps" : titleOf(one)])) },
            change: one => this.store.set(pointer, one === "" || variants[names.indexOf(one)] === plain ? undefined : fresh(variants[names.indexOf(one)])),
        });
        const line = controls.row({ title, help: schema.description, pointer, id: pick.id }, ...pick.element);
        this.shows.push(() => pick.show(now ? nameOf(now) : ""));
        const rows = now ? this.members(now, pointer, { skip: ["type"] }) : [];
        return h("div.variant", {}, line.element, rows.length ? h("div.inset", {}, ...rows) : null);
    }

    /* An object with what it needs and no more. A pattern is the API's example, for on many shapes one of its
     * defaults shows a single check. */
    #fresh(variant) {
        if (variant.properties.pattern && variant.examples) return structuredClone(variant.examples[0]);
        const made = {};
        for (const name of variant.required ?? []) {
            if (name === "matrix") return { matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] };
            const schema = this.schema.of(variant.properties[name]);
            made[name] = schema.const ?? schema.default ?? { f0: 0.04, n: 1.5, roughness: 0.2 }[name] ?? schema.examples?.[0] ?? schema.minimum ?? (schema.type === "string" ? "" : 0.5);
        }
        return made;
    }

    #list(schema, name, pointer, title) {
        const item = this.schema.of(schema.items), list = this.store.get(pointer) ?? [];
        const one = titleOf(name).replace(/s$/, "");
        const cards = list.map((_, i) => h("div.inset.card", {},
            h("div.card-head", {}, h("span", {}, `${one} ${i + 1}`),
              iconButton("close", `Remove ${one.toLowerCase()} ${i + 1}`, () => this.#drop(pointer, i))),
            ...this.members(item, pointer + pointerTo(i))));
        const add = h("button.quiet", { type: "button", onclick: () => this.store.set(pointer, [...(this.store.get(pointer) ?? []), this.#fresh(item)]) },
                      icon("plus"), `Add ${one.toLowerCase()}`);
        return h("div.list", { "data-pointer": pointer }, ...cards, add);
    }

    #drop(pointer, i) {
        const rest = this.store.get(pointer).filter((_, k) => k !== i);
        this.store.set(pointer, rest.length ? rest : undefined);
    }
}

const isObject = value => typeof value === "object" && value !== null;

/* Two numbers of a pattern for the one that there was, or those that another pattern had. */
function pairOf(value, least) {
    if (value?.values) return value.values;
    const first = Math.max(value, least);
    return [first, tidy(first > least ? Math.max(first / 4, least) : 4 * least)];
}

/* Members without a schema of their own tell their default in words: "Default: 0." */
const toldDefault = ({ description, type }) => {
    const told = /Default: (-?[\d.]*\d|true|false)\./.exec(description ?? "")?.[1];
    return told && ["number", "integer", "boolean"].includes(type) ? JSON.parse(told) : undefined;
};

const NAMES = { attenuation: ["constant", "linear", "quadratic"], size: ["width", "height", "depth"], values: ["first", "second"] };

/* What decides which rows there are: the document without its plain values. */
export function outline(value) {
    if (Array.isArray(value)) return typeof value[0] === "object" ? value.map(outline) : "a";
    if (value && typeof value === "object")
        return Object.entries(value).filter(([, one]) => one && typeof one === "object")
            .map(([name, one]) => [name, outline(one)]).concat([["", value.type ?? value.model ?? value.pattern ?? Object.keys(value).length > 0]]);
    return "v";
}
