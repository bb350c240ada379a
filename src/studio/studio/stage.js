/* The preview as a thing to turn: drag to orbit, wheel or pinch to come closer, keys for both. */
import { orbited, zoomed } from "./space.js";

const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export function makeStage(element, store, settled) {
    const pointers = new Map();
    let timer, width = 1, height = 1;
    const turn = (yaw, pitch, live) => store.set("/camera", orbited(store.scene.camera ?? {}, yaw, pitch), { live });
    const zoom = (factor, live) => store.set("/camera", zoomed(store.scene.camera ?? {}, factor), { live });
    const spread = () => {
        const [a, b] = [...pointers.values()];
        return Math.hypot(a.x - b.x, a.y - b.y);
    };
    element.addEventListener("pointerdown", event => {
        if (event.button > 0) return;
        element.setPointerCapture(event.pointerId);
        /* Asked while it moves, they would lay out the page at every step. */
        ({ clientWidth: width, clientHeight: height } = element);
        pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
        element.classList.add("is-dragged");
    });
    element.addEventListener("pointermove", event => {
        const before = pointers.get(event.pointerId);
        if (!before) return;
        const wide = pointers.size === 2 && spread();
        const now = { x: event.clientX, y: event.clientY };
        pointers.set(event.pointerId, now);
        if (wide) zoom(wide / Math.max(1, spread()), true);
        else turn((before.x - now.x) * Math.PI / width, (before.y - now.y) * Math.PI / height, true);
    });
    for (const name of ["pointerup", "pointercancel"])
        element.addEventListener(name, event => {
            pointers.delete(event.pointerId);
            if (pointers.size) return;
            element.classList.remove("is-dragged");
            store.settle();
            settled?.();
        });
    element.addEventListener("wheel", event => {
        event.preventDefault();
        const lines = event.deltaMode === 1 ? 16 : 1;
        zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY * lines * 0.0015))), true);
        clearTimeout(timer);
        timer = setTimeout(() => store.settle(), 180);
    }, { passive: false });
    element.addEventListener("keydown", event => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const [x, y] = KEYS[event.key] ?? [];
        if (x !== undefined) turn(x * Math.PI / 36, y * Math.PI / 36, false);
        else if (event.key === "+" || event.key === "=") zoom(1 / 1.1, false);
        else if (event.key === "-") zoom(1.1, false);
        else if (event.key === "Home") store.set("/camera", undefined);
        else return;
        event.preventDefault();
    });
}
