/* The scene document, which all of the page shows and changes: one constant tree at a time, with
 * those before it to go back to. */

const keysOf = pointer => pointer.split("/").slice(1).map(key => key.replaceAll("~1", "/").replaceAll("~0", "~"));
export const pointerTo = (...keys) => keys.map(key => "/" + String(key).replaceAll("~", "~0").replaceAll("/", "~1")).join("");

export function at(tree, pointer) {
    return keysOf(pointer).reduce((value, key) => value?.[key], tree);
}

/* The tree with another value at a pointer; undefined takes it away. Objects on the way that are
 * missing are made, and parents that become empty stay. */
export function replaced(tree, pointer, value) {
    const [key, ...rest] = keysOf(pointer);
    if (key === undefined) return value;
    const copy = Array.isArray(tree) ? [...tree] : { ...tree };
    const below = rest.length ? replaced(copy[key] ?? {}, pointerTo(...rest), value) : value;
    if (below !== undefined) copy[key] = below;
    else if (Array.isArray(copy)) copy.splice(Number(key), 1);
    else delete copy[key];
    return copy;
}

const MOST = 200;

export class Store extends EventTarget {
    #scene;
    #before = [];
    #after = [];
    #kind = null;   // what is being changed, as long as it is
    live = false;   // something is being dragged

    constructor(scene) {
        super();
        this.#scene = scene;
    }

    get scene() { return this.#scene; }
    get(pointer) { return at(this.#scene, pointer); }
    get canUndo() { return this.#before.length > 0; }
    get canRedo() { return this.#after.length > 0; }

    set(pointer, value, options) {
        this.replace(replaced(this.#scene, pointer, value), { kind: pointer, ...options });
    }

    /* `live`: more of the same will come, until settle(); it is one step of undo. `from` names who
     * changes, so that it need not show again what it shows. */
    replace(scene, { kind = null, live = false, from = null, keep = true } = {}) {
        if (JSON.stringify(scene) === JSON.stringify(this.#scene)) {
            if (!live) this.settle(from);
            return;
        }
        const goesOn = this.live && kind !== null && kind === this.#kind;
        if (keep && !goesOn) {
            this.#before.push(this.#scene);
            if (this.#before.length > MOST) this.#before.shift();
            this.#after = [];
        }
        this.#kind = kind;
        this.live = live;
        this.#scene = scene;
        this.#tell(from);
    }

    /* What was dragged has been let go. */
    settle(from = null) {
        if (!this.live) return;
        this.live = false;
        this.#kind = null;
        this.#tell(from);
    }

    undo() { this.#step(this.#before, this.#after); }
    redo() { this.#step(this.#after, this.#before); }

    #step(source, target) {
        if (!source.length) return;
        target.push(this.#scene);
        this.#scene = source.pop();
        this.live = false;
        this.#kind = null;
        this.#tell("undo");
    }

    #tell(from) {
        this.dispatchEvent(new CustomEvent("change", { detail: { from, live: this.live } }));
    }
}

/* ---- A document as text in a link: deflate, then base64 for URLs, as GET /v1/scene takes it ---- */

async function through(bytes, stream) {
    const answer = new Response(new Blob([bytes]).stream().pipeThrough(stream));
    return new Uint8Array(await answer.arrayBuffer());
}

export async function pack(scene) {
    const bytes = await through(new TextEncoder().encode(JSON.stringify(scene)), new CompressionStream("deflate-raw"));
    let binary = "";
    for (let i = 0; i < bytes.length; i += 0x8000) binary += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
    return btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

export async function unpack(text) {
    const binary = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(binary, c => c.charCodeAt(0));
    return JSON.parse(new TextDecoder().decode(await through(bytes, new DecompressionStream("deflate-raw"))));
}
