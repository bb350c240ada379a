/* JSON read with the place of every value, so that what the server says of one can be shown there. */
import { pointerTo } from "./store.js";

export class JsonError extends Error {
    constructor(message, offset) {
        super(message);
        this.offset = offset;
    }
}

const NUMBER = /-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?/y;
const STRING = /"(?:[^"\\\u0000-\u001f]|\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4}))*"/y;
const WORDS = { true: true, false: false, null: null };

/* {value, places}: places by JSON Pointer, [start, end] of the member's name, or of the value. */
export function readJson(text) {
    const places = new Map();
    let i = 0;
    const skip = () => { while (" \t\n\r".includes(text[i] ?? "x")) i++; };
    const fail = what => { throw new JsonError(i >= text.length ? `${what}, but the text ends` : what, Math.min(i, text.length)); };
    const match = pattern => {
        pattern.lastIndex = i;
        const found = pattern.exec(text)?.[0];
        if (found !== undefined) i += found.length;
        return found;
    };
    const name = () => {
        const found = text[i] === '"' ? match(STRING) : fail("expected a name in double quotes");
        return found === undefined ? fail("this text is not closed, or has a character that JSON does not take") : JSON.parse(found);
    };
    const object = pointer => {
        const made = {};
        for (i++, skip(); text[i] !== "}";) {
            const start = i, key = name(), place = pointer + pointerTo(key);
            places.set(place, [start, i]);
            skip();
            if (text[i++] !== ":") { i--; fail(`expected ":" after "${key}"`); }
            made[key] = value(place, true);
            if (text[i] === ",") { i++; skip(); if (text[i] === "}") fail("expected another member after the comma"); }
            else if (text[i] !== "}") fail('expected "," or "}"');
        }
        i++;
        return made;
    };
    const array = pointer => {
        const made = [];
        for (i++, skip(); text[i] !== "]";) {
            made.push(value(`${pointer}/${made.length}`));
            if (text[i] === ",") { i++; skip(); if (text[i] === "]") fail("expected another value after the comma"); }
            else if (text[i] !== "]") fail('expected "," or "]"');
        }
        i++;
        return made;
    };
    const value = (pointer, isMember = false) => {
        skip();
        const start = i;
        let made;
        if (text[i] === "{") made = object(pointer);
        else if (text[i] === "[") made = array(pointer);
        else if (text[i] === '"') made = name();
        else {
            const word = match(/[a-z]+/y) ?? match(NUMBER);
            if (word === undefined) fail("expected a value");
            if (/^[a-z]/.test(word) && !(word in WORDS)) { i = start; fail(`"${word}" is not JSON`); }
            made = word in WORDS ? WORDS[word] : Number(word);
        }
        if (!isMember) places.set(pointer, [start, i]);
        skip();
        return made;
    };
    const made = value("");
    if (i < text.length) fail("there is more after the end of the document");
    return { value: made, places };
}

/* Indented, with short lists and objects in one line. */
export function writeJson(value, indent = "", room = 72) {
    const flat = JSON.stringify(value);
    if (value === null || typeof value !== "object") return flat;
    const spaced = flat.length < 400 && JSON.stringify(value, null, 1).replace(/\n\s*/g, " ");
    const isPlain = one => one === null || typeof one !== "object";
    const isShort = Array.isArray(value) ? value.every(isPlain) : Object.values(value).every(one => isPlain(one) || Array.isArray(one) && one.every(isPlain));
    if (spaced && isShort && spaced.length + indent.length < room) return spaced.replaceAll("[ ", "[").replaceAll(" ]", "]").replace(/^\{ (.*) \}$/, "{$1}");
    if (Array.isArray(value) && value.every(isPlain)) return `[${value.join(", ")}]`;
    const inner = indent + "  ";
    const parts = Array.isArray(value) ? value.map(one => inner + writeJson(one, inner, room))
        : Object.entries(value).map(([key, one]) => `${inner}${JSON.stringify(key)}: ${writeJson(one, inner, room - key.length - 4)}`);
    const [open, close] = Array.isArray(value) ? "[]" : "{}";
    return parts.length ? `${open}\n${parts.join(",\n")}\n${indent}${close}` : open + close;
}
