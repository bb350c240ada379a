/* The document as text. It is the same document as the controls': what is typed is taken as soon as
 * it is JSON, and mistakes are told beneath their line. */
import { h } from "./dom.js";
import { JsonError, readJson, writeJson } from "./json.js";

const TOKENS = /("(?:[^"\\]|\\.)*")(\s*:)?|(-?\d[\d.eE+-]*)|\b(true|false|null)\b/g;

export class Editor {
    #places = new Map();
    #errors = [];       // {start, end, detail, pointer}
    #typed = false;

    constructor(element, store) {
        this.store = store;
        this.area = h("textarea.code-text", { id: "scene-json", spellcheck: false, autocomplete: "off", autocapitalize: "off", wrap: "off",
                                              "aria-label": "The scene as JSON", "aria-describedby": "scene-errors" });
        this.paint = h("pre.code-paint", { "aria-hidden": "true" });
        this.list = h("ul.code-errors", { id: "scene-errors", "aria-live": "polite" });
        element.append(h("div.code", {}, this.paint, this.area), this.list);
        this.area.addEventListener("input", () => this.#take());
        this.area.addEventListener("scroll", () => this.#follow());
        this.area.addEventListener("focus", () => { this.#typed = true; });
        this.area.addEventListener("blur", () => {
            this.#typed = false;
            if (!this.#errors.length) this.show();
        });
    }

    #follow() {
        this.paint.scrollTop = this.area.scrollTop;
        this.paint.scrollLeft = this.area.scrollLeft;
    }

    #take() {
        try {
            const { value, places } = readJson(this.area.value);
            if (value === null || typeof value !== "object" || Array.isArray(value)) throw new JsonError("expected an object: a scene", 0);
            if (!Array.isArray(value.objects)) throw new JsonError('expected "objects": an array', 0);
            this.#places = places;
            this.#errors = [];
            this.store.replace(value, { kind: "text", from: "editor" });
        } catch (error) {
            if (!(error instanceof JsonError)) throw error;
            this.#errors = [{ start: error.offset, end: error.offset + 1, detail: error.message, pointer: null }];
        }
        this.#draw();
    }

    /* What is wrong, as the server tells it; or nothing. */
    mark(errors) {
        if (this.#errors.some(one => one.pointer === null)) return;
        this.#errors = errors.map(({ pointer, detail }) => {
            let place = pointer ?? "";
            while (place && !this.#places.has(place)) place = place.slice(0, place.lastIndexOf("/"));
            const [start, end] = this.#places.get(place) ?? [0, 1];
            return { start, end, detail, pointer: pointer ?? "" };
        });
        this.#draw();
    }

    get errors() { return this.#errors; }

    show(from) {
        if (from === "editor" || (this.#typed && from !== "undo" && this.#errors.length)) return;
        const text = writeJson(this.store.scene);
        if (text === this.area.value) return;
        const { selectionStart, scrollTop } = this.area;
        this.area.value = text;
        this.area.setSelectionRange(selectionStart, selectionStart);
        this.area.scrollTop = scrollTop;
        this.#places = readJson(text).places;
        this.#errors = [];
        this.#draw();
    }

    #draw() {
        const text = this.area.value, lines = text.split("\n");
        let offset = 0;
        this.paint.replaceChildren(...lines.map((line, i) => {
            const here = this.#errors.filter(({ start }) => start >= offset && start <= offset + line.length);
            const element = h("span.code-line", { class: here.length ? "is-wrong" : "" }, ...this.#colored(line));
            element.dataset.line = i + 1;
            if (here.length) element.append(h("span.code-why", {}, here.map(one => one.detail).join("; ")));
            offset += line.length + 1;
            return element;
        }));
        this.list.replaceChildren(...this.#errors.map(error => {
            const line = text.slice(0, error.start).split("\n").length;
            return h("li", {}, h("button.code-error", { type: "button", onclick: () => this.#go(error) },
                                 h("b", {}, `Line ${line}`), error.pointer ? h("code", {}, error.pointer) : null, h("span", {}, error.detail)));
        }));
        this.area.setAttribute("aria-invalid", String(this.#errors.length > 0));
        this.#follow();
    }

    *#colored(line) {
        let end = 0;
        for (const match of line.matchAll(TOKENS)) {
            const [all, text, colon, number, word] = match;
            if (match.index > end) yield line.slice(end, match.index);
            const kind = text ? colon !== undefined ? "t-key" : "t-text" : number ? "t-number" : word ? "t-word" : "";
            yield h("span", { class: kind }, text ?? all);
            if (colon) yield colon;
            end = match.index + all.length;
        }
        yield line.slice(end);
    }

    #go({ start, end }) {
        this.area.focus();
        this.area.setSelectionRange(start, end);
        const line = this.area.value.slice(0, start).split("\n").length;
        this.area.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(this.area).lineHeight));
    }
}
