// Random values that are valid by a JSON Schema, as far as scene.schema.json uses it.
//
// A schema is cut into alternatives without `$ref`, `allOf`, `anyOf`, `oneOf`, `if` and
// `dependentSchemas`, from which values are built; what alternatives do not say is filtered.
import { Ajv, fc } from "./packages.mjs";

const ANNOTATIONS = ["title", "description", "default", "examples", "$id", "$schema", "$defs"];

function mergeProperties(a = {}, b = {}) {
    const merged = { ...a };
    for (const [name, part] of Object.entries(b)) {
        if (!(name in a) || a[name] === true) merged[name] = part;
        else if (part === false || a[name] === false) merged[name] = false;
        else if (part !== true) merged[name] = { allOf: [a[name], part] };
    }
    return merged;
}

// What is valid by both; null: nothing.
function merge(a, b) {
    const merged = { ...a, ...b };
    if (a.properties || b.properties) merged.properties = mergeProperties(a.properties, b.properties);
    // `additionalProperties` closes the object for what the other one names too.
    for (const [closed, other] of [[a, b], [b, a]])
        if (closed.additionalProperties === false)
            for (const name of Object.keys(other.properties ?? {}))
                if (!(name in closed.properties)) merged.properties[name] = false;
    if (a.required || b.required)
        merged.required = [...new Set([...(a.required ?? []), ...(b.required ?? [])])];
    for (const [key, choose] of [["minimum", Math.max], ["maximum", Math.min],
                                 ["minItems", Math.max], ["maxItems", Math.min]])
        if (key in a && key in b) merged[key] = choose(a[key], b[key]);
    if (a.prefixItems && b.prefixItems) {
        const [long, short] = a.prefixItems.length < b.prefixItems.length
            ? [b.prefixItems, a.prefixItems] : [a.prefixItems, b.prefixItems];
        merged.prefixItems = long.map((part, i) => i < short.length ? { allOf: [part, short[i]] } : part);
    }
    const choices = [a, b].map(part => "const" in part ? [part.const] : part.enum).filter(Boolean);
    delete merged.const;
    if (choices.length) {
        merged.enum = choices[0].filter(value => choices.every(list => list.includes(value)));
        if (!merged.enum.length) return null;
    }
    if (merged.required?.some(name => merged.properties?.[name] === false)) return null;
    return merged;
}

const cross = (list, others) =>
    list.flatMap(a => others.map(b => merge(a, b))).filter(Boolean);

const mostly = (usual, any, weight = 100) =>
    fc.oneof({ arbitrary: usual, weight }, { arbitrary: any, weight: 1 });

export class Values {
    // `names`, `members`: arbitraries to be used most of the time for strings without a pattern and
    // for whole members, by the name of the member.
    // `wild`: numbers of any size now and then, instead of small ones.
    constructor(schema, { names = {}, members = {}, wild = false } = {}) {
        this.root = schema;
        this.names = names;
        this.members = members;
        this.wild = wild;
        this.ajv = new Ajv({ strict: false, inlineRefs: false })
            .addSchema({ $id: "root", $defs: schema.$defs });
        this.known = new Map();
    }

    resolve(ref) {
        return ref.slice(2).split("/").reduce((at, key) => at[key], this.root);
    }

    alternatives(schema) {
        if (schema === true) return [{}];
        if (schema === false) return [];
        const { $ref, allOf = [], anyOf, oneOf, if: condition, then, else: _, dependentSchemas = {},
                unevaluatedProperties, ...plain } = schema;
        for (const name of ANNOTATIONS) delete plain[name];
        let list = cross([{}], [plain]);
        if ($ref) list = cross(list, this.alternatives(this.resolve($ref)));
        for (const choices of [anyOf, oneOf].filter(Boolean))
            list = cross(list, choices.flatMap(part => this.alternatives(part)));
        for (const part of allOf) list = cross(list, this.alternatives(part));
        // That all items are there is no condition: of each it says what it is.
        if (condition?.minItems) list = cross(list, [then]);
        else if (condition) list = cross(list, this.branches(schema));
        for (const [name, part] of Object.entries(dependentSchemas))
            list = cross(list, [{ properties: { [name]: false } },
                                ...cross([{ required: [name] }], this.alternatives(part))]);
        if (unevaluatedProperties === false)
            list = list.map(part => ({ ...part, additionalProperties: false }));
        return list;
    }

    branches({ if: condition, then, else: otherwise = true }) {
        return [...cross(this.alternatives(condition), this.alternatives(then)),
                ...this.alternatives(otherwise)];
    }

    // An arbitrary of values that are valid by `schema`, a part of the root; null: there are none.
    of(schema, name = "") {
        const text = JSON.stringify(schema), key = `${name} ${text}`;
        if (!this.known.has(key)) {
            const { $id, $schema, $defs, ...part } = JSON.parse(text.replaceAll('"#/', '"root#/'));
            const validate = this.ajv.compile(part);
            const parts = this.alternatives(schema).map(part => this.build(part, name)).filter(Boolean);
            this.known.set(key, parts.length
                ? fc.oneof(...parts).filter(value => validate(value)) : null);
        }
        return this.known.get(key);
    }

    member(schema, name) {
        if (schema === true) return fc.jsonValue();
        const usual = this.members[name], any = this.of(schema, name);
        return usual && any ? mostly(usual, any) : any;
    }

    build(part, name) {
        if (part.enum) return fc.constantFrom(...part.enum);
        const type = part.type ?? (part.properties ? "object" : undefined);
        switch (type) {
        case "object": return this.object(part);
        case "array": return this.array(part, name);
        case "number": return this.number(part);
        case "integer": return this.integer(part);
        case "string":
            if (part.pattern) return fc.stringMatching(new RegExp(part.pattern));
            return this.names[name] ? mostly(this.names[name], fc.string()) : fc.string();
        case "boolean": return fc.boolean();
        case "null": return fc.constant(null);
        default: throw new Error(`nothing is built from ${JSON.stringify(part)}`);
        }
    }

    object(part) {
        const model = {};
        for (const [name, member] of Object.entries(part.properties ?? {})) {
            const arbitrary = member === false ? null : this.member(member, name);
            if (arbitrary) model[name] = arbitrary;
        }
        if (part.required?.some(name => !(name in model))) return null;
        const record = fc.record(model, { requiredKeys: part.required ?? [], noNullPrototype: true });
        if (!part.additionalProperties) return record;
        const names = mostly(
            fc.constantFrom("a", "b", "brass"),
            this.build({ type: "string", ...part.propertyNames }), 8);
        return fc.dictionary(names, this.of(part.additionalProperties),
                             { maxKeys: 3, noNullPrototype: true });
    }

    array(part, name) {
        const first = (part.prefixItems ?? []).map(item => this.of(item, name));
        const least = part.minItems ?? 0;
        if (first.length && least >= first.length && (part.maxItems === first.length || part.items === false))
            return fc.tuple(...first);
        if (part.maxItems < least) return null; // of two alternatives that exclude each other
        const maxLength = Math.min(part.maxItems ?? Infinity, least + 4);
        const items = this.of(part.items, name);
        return part.uniqueItems ? fc.uniqueArray(items, { minLength: least, maxLength })
                                : fc.array(items, { minLength: least, maxLength });
    }

    number({ minimum, maximum, exclusiveMinimum, exclusiveMaximum }) {
        const min = Math.max(minimum ?? -Number.MAX_VALUE, exclusiveMinimum ?? -Number.MAX_VALUE);
        const max = Math.min(maximum ?? Number.MAX_VALUE, exclusiveMaximum ?? Number.MAX_VALUE);
        const low = Math.max(min, -4), high = Math.min(max, low + 8);
        const small = fc.integer({ min: 0, max: 32 }).map(step => low + (high - low) * step / 32)
            .filter(value => value !== exclusiveMinimum && value !== exclusiveMaximum);
        if (!this.wild) return small;
        const any = fc.double({ min, max, noNaN: true, minExcluded: min === exclusiveMinimum,
                                maxExcluded: max === exclusiveMaximum });
        return mostly(small, any, 12);
    }

    integer({ minimum = -8, maximum = Infinity }) {
        const small = fc.integer({ min: minimum, max: Math.min(maximum, minimum + 8) });
        if (!this.wild) return small;
        const any = fc.integer({ min: minimum, max: Math.min(maximum, 2 ** 31 - 1) });
        return mostly(small, any, 12);
    }
}
