/* Controls of single values. Each is {element, show(value, isSet)}, and tells of changes by
 * change(value, {live}) and settle(): `live` while it is being dragged. */
import { brief, brightnessOf, linearOf, read, scaled, toHex, write } from "./colors.js";
import { h, iconButton, newId, tidy } from "./dom.js";

/* A labelled row, with a button that takes the member out of the document again. */
export function row({ title, help, pointer, id, reset, wide, long }, ...controls) {
    const label = h("label.row-label", { for: id, title: help ?? null }, title);
    const back = reset ? iconButton("reset", `${title}: back to the default`, reset, { class: "reset" }) : null;
    const problem = h("p.row-problem", { hidden: true });
    const element = h(wide ? "div.row.wide" : long ? "div.row.long" : "div.row", { "data-pointer": pointer ?? null }, label,
                      h("div.row-control", {}, ...controls), back, problem);
    return { element, problem, mark: isSet => element.classList.toggle("is-set", Boolean(isSet)) };
}

const shareOf = (value, { from, to, curve }) => Math.pow(Math.min(1, Math.max(0, (value - from) / (to - from))), 1 / curve);

function valueAt(share, { from, to, curve, isWhole, step, low, high }) {
    let value = from + (to - from) * Math.pow(share, curve);
    if (step) value = Math.round(value / step) * step;
    value = isWhole ? Math.round(value) : tidy(value, Math.abs(value) < 0.1 ? 2 : 3);
    return Math.min(high ?? Infinity, Math.max(low ?? -Infinity, value));
}

/* Puts the filled part of a slider where its thumb is. */
function paint(slider) {
    slider.style.setProperty("--share", String((slider.value - slider.min) / (slider.max - slider.min)));
}

export function slider(label, { change, settle }) {
    const element = h("input.slider", { type: "range", min: "0", max: "1", step: "0.001", "aria-label": label });
    let told = null;
    element.addEventListener("input", () => {
        told = Number(element.value);
        paint(element);
        change(told);
    });
    element.addEventListener("change", () => settle());
    return { element, show(share) {
        if (told !== null && Math.abs(told - share) < 0.02 && element.matches(":active")) return;
        element.value = share;
        paint(element);
    } };
}

export function number(name, title, range, { change, settle }) {
    const id = newId("number");
    const way = slider(title, { settle, change: share => change(valueAt(share, range), { live: true }) });
    const field = h("input.number", { id, type: "number", step: range.isWhole ? "1" : "any", placeholder: "auto" });
    field.addEventListener("change", () => {
        if (field.value !== "" && Number.isFinite(Number(field.value))) change(Number(field.value), {});
    });
    const unit = range.unit ? h("span.unit", { "aria-hidden": "true" }, range.unit) : null;
    return { id, element: [way.element, h("span.figure", {}, field, unit)], show(value) {
        const isKnown = typeof value === "number";
        if (document.activeElement !== field) field.value = isKnown ? tidy(value, 6) : "";
        way.show(isKnown ? shareOf(value, range) : 0);
        way.element.setAttribute("aria-valuetext", isKnown ? `${tidy(value)} ${range.unit}`.trim() : "not set");
    } };
}

/* Numbers side by side. */
export function vector(title, size, { change, isWhole, names = ["x", "y", "z", "w"], step = "any" }) {
    const fields = Array.from({ length: size }, (_, i) =>
        h("input.number", { type: "number", step: isWhole ? "1" : step, "aria-label": `${title} ${names[i]}` }));
    for (const field of fields)
        field.addEventListener("change", () => {
            const values = fields.map(one => Number(one.value));
            if (fields.every(one => one.value !== "") && values.every(Number.isFinite)) change(values, {});
        });
    fields[0].id = newId("vector");
    return { id: fields[0].id, element: [h("span.vector", {}, ...fields)], show(value) {
        const list = typeof value === "number" ? Array(size).fill(value) : value ?? [];
        fields.forEach((field, i) => {
            if (document.activeElement !== field) field.value = list[i] === undefined ? "" : tidy(list[i], 5);
        });
    } };
}

export function choice(title, values, { change, labels = {} }) {
    const id = newId("choice");
    const element = h("select.select", { id }, ...values.map(value => h("option", { value }, labels[value] ?? value)));
    element.addEventListener("change", () => change(element.value === "" && !values.includes("") ? undefined : element.value, {}));
    return { id, element: [element], show(value) {
        if (value === undefined && !values.includes("") && !element.querySelector("option[value='']"))
            element.prepend(h("option", { value: "" }, "by default"));
        if (value !== undefined && ![...element.options].some(option => option.value === String(value)))
            element.append(h("option", { value: String(value) }, String(value)));
        element.value = value ?? "";
    } };
}

/* A few values, all in sight. */
export function segments(title, values, { change, labels = {} }) {
    const name = newId("segments");
    const inputs = values.map(value => h("input", { type: "radio", name, value }));
    for (const input of inputs) input.addEventListener("change", () => change(input.value, {}));
    const element = h("div.segments", { role: "radiogroup", "aria-label": title },
                      ...inputs.map(input => h("label", {}, input, h("span", {}, labels[input.value] ?? input.value))));
    return { element: [element], show(value) {
        for (const input of inputs) input.checked = input.value === value;
    } };
}

export function toggle(title, { change }) {
    const id = newId("toggle");
    const element = h("input.toggle", { id, type: "checkbox", role: "switch" });
    element.addEventListener("change", () => change(element.checked, {}));
    return { id, element: [element], show(value) { element.checked = Boolean(value); } };
}

export function text(title, { change, parse = value => value, format = value => value, options }) {
    const id = newId("text"), list = options ? newId("list") : null;
    const element = h("input.text", { id, type: "text", spellcheck: false, autocomplete: "off", placeholder: "by default" });
    if (list) element.setAttribute("list", list);
    element.addEventListener("change", () => {
        try {
            change(element.value.trim() === "" ? undefined : parse(element.value), {});
            element.removeAttribute("aria-invalid");
        } catch {
            element.setAttribute("aria-invalid", "true");
        }
    });
    const choices = list ? h("datalist", { id: list }, ...options.map(value => h("option", { value }))) : null;
    return { id, element: [element, choices].filter(Boolean), show(value) {
        if (document.activeElement !== element) element.value = value === undefined ? "" : format(value);
    } };
}

export const json = (title, { change, options }) => text(title, {
    change, options, format: value => typeof value === "string" ? value : JSON.stringify(value),
    parse: value => /^[-\d[{"tfn]/.test(value.trim()) && !options?.includes(value.trim()) ? JSON.parse(value) : value.trim(),
});

/* A color: how bright, which, and as it is written. */
export function color(title, { change, settle, to = 1 }) {
    const id = newId("color");
    let shown = 0;
    const way = slider(`${title}: brightness`, { settle, change: share => change(scaled(shown, tidy(share * to, 3)), { live: true }) });
    const well = h("input.well", { type: "color", "aria-label": `${title}: pick a color` });
    well.addEventListener("input", () => change(well.value, { live: true }));
    well.addEventListener("change", () => settle());
    const field = h("input.text", { id, type: "text", spellcheck: false, autocomplete: "off", placeholder: "none" });
    field.addEventListener("focus", () => {
        if (field.value === field.title) return;
        field.value = field.title;
        field.select();
    });
    field.addEventListener("blur", () => { if (field.value === field.title) field.value = brief(shown); });
    field.addEventListener("change", () => {
        try {
            change(read(field.value), {});
            field.removeAttribute("aria-invalid");
        } catch {
            field.setAttribute("aria-invalid", "true");
        }
    });
    return { id, element: [way.element, h("span.figure.color", {}, well, field)], show(value) {
        shown = value ?? 0;
        const isKnown = value !== undefined && value !== null;
        field.title = isKnown ? write(value) : "";
        if (document.activeElement !== field) field.value = isKnown ? brief(value) : "";
        const rgb = linearOf(value);
        well.classList.toggle("is-unknown", !rgb);
        if (rgb && document.activeElement !== well) well.value = toHex(rgb);
        const bright = brightnessOf(value);
        way.element.disabled = bright === null;
        way.show(bright === null ? 0 : Math.min(1, bright / to));
        way.element.setAttribute("aria-valuetext", bright === null ? "not known" : String(tidy(bright, 3)));
    } };
}
