/* The schema of scenes, as the daemon gives it, and what controls ask of it. */

export class Schema {
    #defs;
    constructor(document) {
        this.document = document;
        this.#defs = document.components.schemas;
    }

    has(path) { return Object.keys(this.document.paths).some(one => one.startsWith(path)); }

    /* The schema of a component, or the same schema, with what it refers to and what `allOf` says in
     * itself. `names`: the components that it went through. */
    of(part) {
        if (typeof part === "string") return this.of({ $ref: `#/components/schemas/${part}` });
        const { $ref, allOf, ...own } = part;
        const from = [...($ref ? [this.#defs[$ref.split("/").pop()]] : []), ...(allOf ?? [])].map(one => this.of(one));
        const merged = Object.assign({}, ...from, own);
        merged.names = [...($ref ? [$ref.split("/").pop()] : []), ...from.flatMap(one => one.names)];
        const properties = from.map(one => one.properties).concat(own.properties).filter(Boolean);
        if (properties.length) merged.properties = Object.assign({}, ...properties);
        return merged;
    }

    /* The objects that a schema stands for, [one] if it has no choice. Choices of choices are laid
     * out in a row. */
    variants(part) {
        const schema = this.of(part);
        const choices = schema.oneOf ?? schema.anyOf;
        return choices ? choices.flatMap(one => this.variants(one)) : [schema];
    }

    /* The values that tell a variant by one of its members: `type`, or `model`. */
    tags(variant, member) {
        const schema = this.of(variant.properties?.[member] ?? {});
        return schema.const !== undefined ? [schema.const] : schema.enum ?? [];
    }

    #hasColors(schema) {
        return schema.names.includes("CssColor") || (schema.oneOf ?? schema.anyOf ?? []).some(one => this.#hasColors(this.of(one)));
    }

    /* {number, others} of a number in whose place objects may stand, as patterns and pictures of numbers;
     * null of all else. */
    varied(schema) {
        const choices = (schema.oneOf ?? []).map(one => this.of(one)), number = choices.find(isNumber);
        const others = choices.filter(one => one !== number);
        const areObjects = others.every(one => this.variants(one).every(variant => variant.properties));
        return number && others.length && areObjects ? { number, others } : null;
    }

    kind(part) {
        const schema = this.of(part);
        const choices = (schema.oneOf ?? schema.anyOf ?? []).map(one => this.of(one));
        if (this.#hasColors(schema)) return "color";
        if (schema.enum && schema.enum.every(one => typeof one === "string")) return "choice";
        if (schema.const !== undefined) return "constant";
        if (isNumber(schema)) return "number";
        if (this.varied(schema)) return "varied";
        if (schema.type === "boolean" || schema.type === "string") return schema.type;
        if (schema.names.includes("Direction")) return "direction";
        if (this.vectorSize(schema)) return "vector";
        if (schema.type === "array" && this.of(schema.items ?? {}).properties) return "list";
        if (schema.properties) return schema.required?.length ? "variants" : "group"; // chosen before it is there
        if (choices.length && choices.every(one => this.variants(one).every(variant => variant.properties))) return "variants";
        return "json";
    }

    /* 2 to 4 for arrays of as many numbers, also where another form may stand in their place. */
    vectorSize(schema) {
        const one = schema.type === "array" ? schema
            : (schema.oneOf ?? []).map(part => this.of(part)).find(part => part.type === "array");
        const numbers = one && ["number", "integer"].includes(this.of(one.items ?? {}).type);
        return numbers && one.minItems === one.maxItems && one.maxItems <= 4 ? one.minItems : 0;
    }
}

const isNumber = schema => schema.type === "number" || schema.type === "integer";
