/* What comes before all controls: the scene, and the request for its picture. */
import "../shaded-preview.js";
import { access } from "./api.js";
import { Store, unpack } from "./store.js";

/* What is seen first: a key light, a cool fill, and a rim that cuts it from the ground. */
export const FIRST = {
    camera: { position: [0, 0.75, 4.6], target: [0, 0, 0], fov: 32 },
    image: { width: 512, height: 512, samples: 9 },
    ambient: 0.06,
    background: [0.035, 0.036, 0.04],
    lights: [
        { type: "directional", name: "Key", direction: [0.95, -0.95, -0.8], color: [1, 0.96, 0.9], intensity: 1.2 },
        { type: "directional", name: "Fill", direction: [-1, -0.1, -0.55], color: [0.55, 0.7, 1], intensity: 0.35 },
        { type: "directional", name: "Rim", direction: [-0.35, -0.55, 1], color: [1, 0.9, 0.8], intensity: 1.1 },
    ],
    objects: [{ type: "sphere", material: { preset: "brass" } }],
};

export const store = new Store(FIRST);
export const view = document.getElementById("view");

/* The scene in a link to this page; null: there is none. */
export async function sceneOf(hash) {
    if (!hash.startsWith("#s=")) return null;
    const scene = await unpack(hash.slice(3));
    if (!Array.isArray(scene?.objects)) throw new Error("no objects");
    return scene;
}

/* Whether a link led here that cannot be read. */
export let isBroken = false;
try {
    const scene = await sceneOf(location.hash);
    if (scene) store.replace(scene);
} catch {
    isBroken = true;
}

/* Once there is a picture, or a reason why not. Controls wait for it: making them would keep the
 * picture from being shown. */
export const answered = new Promise(resolve => {
    view.addEventListener("load", () => {
        performance.mark("first picture");
        resolve();
    }, { once: true });
    view.addEventListener("error", () => resolve(), { once: true });
});

view.token = access.token;
access.watch(token => { view.token = token; });
view.scene = store.scene;
