/* The page: the document, its picture, and what shows and changes them. */
import { access, get } from "./api.js";
import { debounce, figure, h, icon, iconButton, throttle } from "./dom.js";
import { Editor } from "./editor.js";
import { answered, FIRST, isBroken, sceneOf, store, view } from "./first.js";
import { LobePanel, ScopePanel } from "./measures.js";
import { ColorPanel } from "./panel-color.js";
import { LightsPanel } from "./panel-lights.js";
import { MaterialPanel } from "./panel-material.js";
import { ScenePanel } from "./panel-scene.js";
import { AccuracyPanel } from "./readouts.js";
import { Schema } from "./schema.js";
import { copyText, makeCodeDialog, makeDownloads } from "./snippets.js";
import { frameOf } from "./space.js";
import { makeStage } from "./stage.js";
import { pack } from "./store.js";

const byId = id => document.getElementById(id);
const stage = byId("stage");

function say(text, isBad = false) {
    const toast = byId("toast");
    toast.textContent = text;
    toast.className = `toast is-shown${isBad ? " is-bad" : ""}`;
    clearTimeout(say.timer);
    say.timer = setTimeout(() => toast.classList.remove("is-shown"), isBad ? 8000 : 2500);
}

/* A preview with this tab's token, too. */
function preview(attributes) {
    const element = h("shaded-preview", attributes);
    element.token = access.token;
    access.watch(token => { element.token = token; });
    return element;
}

/* ---- The picture ---- */

function showPlan(bound) {
    const worked = Object.entries(bound.timing).reduce((sum, [stage, ms]) => sum + (stage === "queue" ? 0 : ms), 0);
    const { image: { width = 512, height = 512 } = {} } = store.scene;
    const parts = [`${width} × ${height}`, bound.asked === bound.tier || bound.asked === "draft" ? bound.tier : `${bound.tier} (asked: ${bound.asked})`,
                   bound.lights && `${bound.lights.used} of ${bound.lights.given} lights`,
                   bound.error.deltaE2000 !== undefined && `ΔE ≤ ${figure(bound.error.deltaE2000)}`,
                   bound.reuse === "picture" ? "kept" : `${worked.toFixed(worked < 10 ? 1 : 0)} ms`, `${(bound.bytes / 1024).toFixed(0)} KB`].filter(Boolean);
    byId("plan").replaceChildren(...parts.map(part => h("span", {}, part)));
    stage.classList.remove("is-wrong");
    byId("plan").classList.toggle("has-warnings", bound.warnings.length > 0);
    byId("plan").append(...bound.warnings.map(({ pointer, detail }) => h("span.warning", { title: pointer }, detail)));
}

function markRows(errors) {
    for (const row of document.querySelectorAll(".row.is-wrong")) {
        row.classList.remove("is-wrong");
        row.querySelector(".row-problem").hidden = true;
    }
    for (const { pointer, detail } of errors) {
        /* The innermost row that has it. */
        const row = [...document.querySelectorAll(".row[data-pointer]")]
            .filter(one => pointer === one.dataset.pointer || pointer?.startsWith(one.dataset.pointer + "/"))
            .reduce((best, one) => one.dataset.pointer.length > (best?.dataset.pointer.length ?? -1) ? one : best, null);
        if (!row) continue;
        row.classList.add("is-wrong");
        const problem = row.querySelector(".row-problem");
        problem.textContent = detail;
        problem.hidden = false;
    }
}

/* ---- Around it ---- */

function makeTabs() {
    const names = ["material", "lights", "scene", "color"], tabs = byId("tabs");
    const take = name => {
        for (const one of names) {
            byId(`panel-${one}`).hidden = one !== name;
            const tab = byId(`tab-${one}`);
            tab.setAttribute("aria-selected", String(one === name));
            tab.tabIndex = one === name ? 0 : -1;
        }
    };
    for (const name of names)
        tabs.append(h("button.tab", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, onclick: () => take(name) },
                      name[0].toUpperCase() + name.slice(1)));
    tabs.addEventListener("keydown", event => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (!step) return;
        const i = names.findIndex(name => byId(`tab-${name}`) === document.activeElement);
        const next = names[(i + step + names.length) % names.length];
        take(next);
        byId(`tab-${next}`).focus();
    });
    take("material");
}

function makeHistory() {
    const undo = iconButton("undo", "Undo (Ctrl+Z)", () => store.undo(), { id: "undo" });
    const redo = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => store.redo(), { id: "redo" });
    const fresh = iconButton("reset", "Begin anew", () => store.replace(FIRST), { id: "fresh" });
    byId("history").append(undo, redo, fresh);
    document.addEventListener("keydown", event => {
        const isText = event.target.matches?.("textarea, input[type=text], input[type=number], input[type=search]");
        if (!(event.ctrlKey || event.metaKey) || isText) return;
        const key = event.key.toLowerCase();
        if (key === "z" && !event.shiftKey) store.undo();
        else if (key === "y" || key === "z") store.redo();
        else return;
        event.preventDefault();
    });
    return () => {
        undo.disabled = !store.canUndo;
        redo.disabled = !store.canRedo;
    };
}

function makeTheme() {
    const root = document.documentElement;
    const is = () => root.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    const kept = localStorage.getItem("shaded-theme");
    if (kept) root.dataset.theme = kept;
    return iconButton("theme", "Light or dark", () => {
        root.dataset.theme = is() === "dark" ? "light" : "dark";
        localStorage.setItem("shaded-theme", root.dataset.theme);
    }, { id: "theme" });
}

function makeActions(schema, formats) {
    const code = makeCodeDialog(byId("code"), store, schema, say);
    const link = h("button.quiet", { type: "button", id: "share", "aria-label": "Link", title: "Copy a link to this scene", onclick: async () => {
        await keepAddress();
        await copyText(location.href);
        say("The link to this scene is copied");
    } }, icon("link"), h("span", {}, "Link"));
    const copy = h("button.quiet", { type: "button", id: "copy", "aria-label": "Code", title: "curl, fetch, Python, <img>", onclick: () => code.open() }, icon("copy"), h("span", {}, "Code"));
    const menu = h("div.menu-list");
    const save = h("details.menu", { id: "download" }, h("summary.primary", { "aria-label": "Download" }, icon("save"), h("span", {}, "Download")), menu);
    document.addEventListener("click", event => { if (!save.contains(event.target)) save.open = false; });
    save.addEventListener("keydown", event => {
        if (event.key !== "Escape") return;
        save.open = false;
        save.querySelector("summary").focus();
    });
    makeDownloads(menu, store, formats, say);
    byId("actions").append(link, copy, save, makeTheme());
}

/* ---- The address: all of the scene is in its fragment, which browsers do not send ---- */

let address = "";
async function keepAddress() {
    const text = await pack(store.scene);
    address = `#s=${text}`;
    history.replaceState(null, "", address);
}
const keepAddressSoon = debounce(400, keepAddress);

const sayBroken = () => say("The scene in this address cannot be read", true);

async function readAddress() {
    if (location.hash === address) return;
    try {
        const scene = await sceneOf(location.hash);
        if (scene) store.replace(scene);
    } catch {
        sayBroken();
    }
}

/* ---- A token, where there are some ---- */

function askToken() {
    const dialog = byId("token");
    if (dialog.open) return;
    const field = h("input.text", { type: "password", id: "token-field", autocomplete: "off" });
    dialog.replaceChildren(h("form", { method: "dialog", onsubmit: () => {
        access.token = field.value.trim();
        view.refresh();
        if (!started) start();
    } }, h("h2", {}, "This server asks for a token"), h("p.note", {}, "It is kept in this tab until it is closed, and sent to this server only."),
       h("label", { for: "token-field" }, "Token"), field, h("div.dialog-foot", {}, h("button.primary", { type: "submit" }, "Go on"))));
    dialog.showModal();
}

/* ---- All together ---- */

const choice = { object: 0, take(i) { this.object = i; show(null); } };
let panels = [], editor, started = false, showHistory = () => {};

function show(from) {
    choice.object = Math.max(0, Math.min(choice.object, store.scene.objects.length - 1));
    for (const panel of panels) panel.show(from);
    editor?.show(from);
    showHistory();
}

/* While something is dragged the picture comes first: the controls that are in sight follow some
 * times a second, and the text, where every line is laid out anew, less often. */
const showControls = throttle(60, from => {
    for (const panel of panels) if (panel.element?.checkVisibility?.() ?? true) panel.show(from);
});
const showText = throttle(250, from => editor?.show(from));
const showFigures = throttle(150, bound => {
    showPlan(bound);
    for (const panel of panels) panel.take?.(bound);
});
store.addEventListener("change", ({ detail }) => {
    view.draft = detail.live;
    view.scene = store.scene;
    if (detail.live) {
        showControls(detail.from);
        showText(detail.from);
    } else {
        showControls.stop();
        showText.stop();
        show(detail.from);
    }
    keepAddressSoon();
});
view.addEventListener("bound", ({ detail }) => {
    if (detail.draft) return showFigures(detail);
    showFigures.stop();
    editor?.mark([]);
    markRows([]);
    showPlan(detail);
    for (const panel of panels) panel.take?.(detail);
});
view.addEventListener("error", ({ detail: { status, problem } }) => {
    const errors = problem.errors ?? [{ pointer: "", detail: problem.detail || problem.title }];
    stage.classList.add("is-wrong");
    byId("plan").replaceChildren(h("span.warning", {}, errors.length > 1 ? `${errors.length} mistakes: ${errors[0].detail}` : errors[0].detail));
    if (status === 401) askToken();
    /* A deadline or a full queue is no mistake of the document's. */
    editor?.mark(problem.errors ?? []);
    markRows(problem.errors ?? []);
});

async function start() {
    started = true;
    try {
        await answered;
        const [contract, materials, shapes, colors, version] = await Promise.all(
            ["openapi.json", "v1/materials", "v1/shapes", "v1/colorspaces", "v1/version"].map(get));
        const schema = new Schema(contract), basis = () => frameOf(store.scene.camera);
        const material = new MaterialPanel(byId("panel-material"), { schema, store, library: materials.materials, choice, basis, preview });
        panels = [material, new LightsPanel(byId("panel-lights"), { schema, store }),
                  new ScenePanel(byId("panel-scene"), { schema, store, shapes: shapes.shapes, choice }),
                  new ColorPanel(byId("panel-color"), { schema, store, colors }),
                  new AccuracyPanel(byId("accuracy"), { schema, store, shown: () => view.plan, hasFloats: version.formats?.includes("tiff") }),
                  Object.assign(new ScopePanel(byId("scopes"), { schema, store, preview }), { show() {} }),
                  Object.assign(new LobePanel(byId("lobe"), { store, material: () => material.material }), { show() {} })];
        makeActions(schema, version.formats ?? ["png", "jpeg", "webp"]);
        show(null);
        if (view.plan) for (const panel of panels) panel.take?.(view.plan);
        document.documentElement.classList.add("is-ready");
        performance.mark("ready");
    } catch (error) {
        started = false;
        if (error.status === 401) askToken();
        else say(`The controls cannot be made: ${error.message}`, true);
    }
}

makeTabs();
showHistory = makeHistory();
editor = new Editor(byId("text"), store);
makeStage(stage, store);
addEventListener("hashchange", readAddress);
if (isBroken) sayBroken();
show(null);
start();

/* For tests and the console. */
globalThis.studio = { store, view, get heat() { return panels.find(panel => panel.heat)?.heat; } };
