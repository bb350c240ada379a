/* Colors of a document, as a screen shows them here: near enough for a swatch. */
import { tidy } from "./dom.js";

const encode = value => value <= 0.0031308 ? 12.92 * value : 1.055 * Math.pow(value, 1 / 2.4) - 0.055;
const decode = value => value <= 0.04045 ? value / 12.92 : Math.pow((value + 0.055) / 1.055, 2.4);
const code = value => Math.round(255 * encode(Math.min(1, Math.max(0, value)))).toString(16).padStart(2, "0");

export const toHex = rgb => "#" + rgb.map(code).join("");
export const fromHex = hex => [1, 3, 5].map(i => decode(parseInt(hex.slice(i, i + 2), 16) / 255));

const canvas = document.createElement("canvas").getContext("2d");
function fromCss(text) {
    canvas.fillStyle = "#010203";
    canvas.fillStyle = text;
    const first = canvas.fillStyle;
    canvas.fillStyle = "#030201";
    canvas.fillStyle = text;
    if (first !== canvas.fillStyle) return null;
    if (first.startsWith("#")) return fromHex(first);
    const numbers = first.match(/-?[\d.]+(e-?\d+)?/g)?.slice(0, 3).map(Number);
    return first.startsWith("rgb") && numbers ? numbers.map(one => decode(one / 255)) : null;
}

/* Linear [r, g, b], or null where that is not known here. */
export function linearOf(value) {
    if (typeof value === "number") return [value, value, value];
    if (Array.isArray(value) && value.every(Number.isFinite)) return value.slice(0, 3);
    if (typeof value === "string") return fromCss(value);
    if (value && Array.isArray(value.value)) return value.value;
    return null;
}

/* The same color as bright as `most` in its largest component, written as it was where that can be:
 * a grey as one number. */
export function scaled(value, most) {
    const rgb = linearOf(value) ?? [1, 1, 1], peak = Math.max(...rgb.map(Math.abs));
    const made = rgb.map(one => tidy(peak > 0 ? one / peak * most : most));
    if (value && typeof value === "object" && !Array.isArray(value)) return { ...value, value: made };
    if (typeof value === "number" || new Set(made).size === 1) return made[0];
    return Array.isArray(value) ? [...made, ...value.slice(3)] : made;
}

export const brightnessOf = value => {
    const rgb = linearOf(value);
    return rgb ? Math.max(...rgb) : null;
};

/* As it is typed: "0.5", "0.1, 0.2, 0.3", a color of CSS, or JSON. */
export function read(text) {
    const parts = text.trim().replace(/^\[|\]$/g, "").split(/[\s,]+/).map(Number);
    if (/^[-+\d.[]/.test(text.trim()) && parts.every(Number.isFinite)) return parts.length === 1 ? parts[0] : parts;
    return text.trim().startsWith("{") ? JSON.parse(text) : text.trim();
}

/* As short as a field is wide: ".57 .28 .01". */
export const brief = value => Array.isArray(value)
    ? value.map(one => String(tidy(one, 2)).replace(/^(-?)0\./, "$1.").replace(/\.(\d\d)\d+$/, ".$1").replace(/^-?\.00$/, "0")).join(" ")
    : write(value);

export const write = value => typeof value === "string" ? value
    : Array.isArray(value) ? value.map(one => tidy(one, 3)).join(", ")
    : typeof value === "number" ? String(tidy(value)) : JSON.stringify(value);
