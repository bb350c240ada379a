/* Small helpers for elements. */

/* h("p", {class: "note", onclick: f}, "text", child): members that are properties of the element
 * are set as such, others as attributes; `class` and `dataset` are what they say; null is left out. */
export function h(tag, members = {}, ...children) {
    const [, name, classes] = /^([a-z0-9-]+)(.*)$/.exec(tag);
    const element = document.createElement(name);
    if (classes) element.className = classes.slice(1).replaceAll(".", " ");
    for (const [key, value] of Object.entries(members)) {
        if (value === null || value === undefined) continue;
        if (key === "class") element.className = `${element.className} ${value}`.trim();
        else if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
        else if (key in element && key !== "list" && key !== "role" && typeof value !== "string") element[key] = value;
        else if (key === "value") element.value = value;
        else if (value !== false) element.setAttribute(key, value === true ? "" : value);
    }
    element.append(...children.flat().filter(child => child !== null && child !== undefined && child !== false));
    return element;
}

const SVG = "http://www.w3.org/2000/svg";
export function svg(name, members = {}, ...children) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(members)) element.setAttribute(key, value);
    element.append(...children);
    return element;
}

const ICONS = {
    undo: "M6 4 2.5 7.5 6 11M3 7.5h6.5a3.5 3.5 0 0 1 0 7H7",
    redo: "M10 4l3.5 3.5L10 11M13 7.5H6.5a3.5 3.5 0 0 0 0 7H9",
    close: "M4 4l8 8M12 4l-8 8",
    plus: "M8 3v10M3 8h10",
    reset: "M3 8a5 5 0 1 0 1.6-3.7M3 2.5V5.5H6",
    theme: "M8 2a6 6 0 1 0 0 12zM8 2a6 6 0 0 1 0 12",
    link: "M7 9a3 3 0 0 0 4.2 0l2-2A3 3 0 0 0 9 2.800l-.7.7M9 7a3 3 0 0 0-4.200 0l-2 2A3 3 0 0 0 7 13.200l.7-.7",
    down: "M4 6l4 4 4-4",
    save: "M8 2v8M4.500 7 8 10.500 11.500 7M3 13.500h10",
    copy: "M5.500 5.500h8v8h-8zM10.500 5.500v-3h-8v8h3",
};
export function icon(name) {
    return svg("svg", { viewBox: "0 0 16 16", class: "icon", "aria-hidden": "true" },
               svg("path", { d: ICONS[name] }));
}

export function iconButton(name, label, onclick, members = {}) {
    return h("button.icon-button", { type: "button", title: label, "aria-label": label, onclick, ...members }, icon(name));
}

let last = 0;
export const newId = prefix => `${prefix}-${++last}`;

/* 0.0001234 as "1.2e-4", 3.14159 as "3.14". */
export function figure(value, digits = 2) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size < 0.001 || size >= 1e5) return value.toExponential(digits - 1).replace("e+", "e");
    return String(Number(value.toPrecision(size >= 100 ? 3 : digits + 1)));
}

/* Rounded as a person would write it. */
export const tidy = (value, digits = 4) => Number(Number(value).toPrecision(digits));

export function debounce(milliseconds, action) {
    let timer;
    return (...values) => {
        clearTimeout(timer);
        timer = setTimeout(() => action(...values), milliseconds);
    };
}

/* The first at once, the last in the end, and between them one in so many milliseconds. */
export function throttle(milliseconds, action) {
    let timer = 0, next = null;
    const act = values => {
        next = null;
        timer = setTimeout(() => {
            timer = 0;
            if (next) act(next);
        }, milliseconds);
        action(...values);
    };
    const take = (...values) => {
        if (timer) next = values;
        else act(values);
    };
    take.stop = () => {
        clearTimeout(timer);
        timer = 0;
        next = null;
    };
    return take;
}
