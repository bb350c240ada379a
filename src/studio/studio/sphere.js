/* A ball that tells a direction, seen by the scene's camera: its middle is the side of the viewer,
 * its rim the far side. Dragged, or turned by the arrow keys. */
import { vector } from "./controls.js";
import { h } from "./dom.js";
import { fromFrame, times, toFrame, unit } from "./space.js";

const STEP = Math.PI / 36;

const toDisc = ([x, y, z]) => {
    const angle = Math.acos(Math.max(-1, Math.min(1, z))), side = Math.hypot(x, y);
    return side < 1e-9 ? [angle > 1 ? 1 : 0, 0] : [x / side * angle / Math.PI, y / side * angle / Math.PI];
};
const fromDisc = ([u, v]) => {
    const far = Math.min(1, Math.hypot(u, v)), angle = far * Math.PI, side = Math.hypot(u, v) || 1;
    return [Math.sin(angle) * u / side, Math.sin(angle) * v / side, Math.cos(angle)];
};

/* `told`: where the light comes from, in the world. */
export function ball(title, { basis, change, settle }) {
    let place = [0, 0];
    const dot = h("span.ball-dot");
    const element = h("div.ball", { tabindex: "0", role: "slider", "aria-label": `${title}: arrow keys turn it`,
                                    "aria-valuemin": "0", "aria-valuemax": "180", "aria-valuenow": "0" }, dot);
    const paint = () => {
        const [u, v] = place, far = Math.hypot(u, v);
        element.style.setProperty("--x", `${50 + 46 * u}%`);
        element.style.setProperty("--y", `${50 - 46 * v}%`);
        element.classList.toggle("is-behind", far > 0.5);
        element.setAttribute("aria-valuenow", String(Math.round(far * 180)));
        element.setAttribute("aria-valuetext", `${Math.round(far * 180)}° from the viewer, ${Math.abs(u) < 0.01 ? "middle" : u < 0 ? "left" : "right"}, ${v < 0 ? "below" : "above"}`);
    };
    const tell = live => {
        paint();
        change(fromFrame(basis(), fromDisc(place)), { live });
    };
    const follow = event => {
        const box = element.getBoundingClientRect();
        const u = (event.clientX - box.left) / box.width * 2 - 1, v = 1 - (event.clientY - box.top) / box.height * 2;
        const far = Math.max(1, Math.hypot(u, v) / 0.92);
        place = [u / 0.92 / far, v / 0.92 / far];
        tell(true);
    };
    element.addEventListener("pointerdown", event => {
        element.setPointerCapture(event.pointerId);
        element.focus();
        follow(event);
        event.preventDefault();
    });
    element.addEventListener("pointermove", event => {
        if (element.hasPointerCapture(event.pointerId)) follow(event);
    });
    for (const name of ["pointerup", "pointercancel"]) element.addEventListener(name, () => settle());
    element.addEventListener("keydown", event => {
        const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (!step) return;
        event.preventDefault();
        const next = place.map((x, i) => x + step[i] * STEP / Math.PI), far = Math.max(1, Math.hypot(...next));
        place = times(next, 1 / far);
        tell(false);
    });
    return { element, show(direction) {
        if (element.matches(":active")) return;
        place = toDisc(toFrame(basis(), unit(direction)));
        paint();
    } };
}

/* The same as a control of a member: `travels` is against where light comes from, and is told so. */
export function sphere(title, { basis, change, settle, kind }) {
    const sign = kind === "travels" ? -1 : 1;
    const round = list => list.map(x => Number(x.toFixed(3)) || 0);
    const handle = ball(title, { basis, settle, change: (to, how) => change(round(times(to, sign)), how) });
    const numbers = vector(title, 3, { change });
    return { id: numbers.id, element: [handle.element, ...numbers.element], show(value) {
        numbers.show(value);
        if (Array.isArray(value) && value.length === 3) handle.show(times(value, sign));
    } };
}
