/* The picture in other places: as a command, as code, as a file. */
import { access, post, Refusal, url } from "./api.js";
import { h, icon } from "./dom.js";
import { writeJson } from "./json.js";
import { pack } from "./store.js";

const shell = text => `'${text.replaceAll("'", "'\\''")}'`;
const html = text => text.replaceAll("&", "&amp;").replaceAll('"', "&quot;").replaceAll("<", "&lt;");
const formatOf = scene => scene.output?.format ?? "png";
const SUFFIX = { jpeg: "jpg" };

const LANGUAGES = {
    curl: scene => `curl -o picture.${SUFFIX[formatOf(scene)] ?? formatOf(scene)} ${url("v1/render")} \\
  -H 'Content-Type: application/json'${access.token ? " \\\n  -H \"Authorization: Bearer $SHADED_TOKEN\"" : ""} \\
  -d ${shell(writeJson(scene))}`,
    fetch: scene => `const scene = ${writeJson(scene)};
const answer = await fetch(${JSON.stringify(url("v1/render"))}, {
  method: "POST",
  headers: {"Content-Type": "application/json"${access.token ? ", Authorization: `Bearer ${token}`" : ""}},
  body: JSON.stringify(scene),
});
if (!answer.ok) throw new Error((await answer.json()).detail);
const picture = await answer.blob();`,
    Python: scene => `import json
import urllib.request

scene = json.loads(r"""${writeJson(scene)}""")
request = urllib.request.Request(
    ${JSON.stringify(url("v1/render"))}, json.dumps(scene).encode(),
    {"Content-Type": "application/json"${access.token ? ', "Authorization": "Bearer " + token' : ""}})
with urllib.request.urlopen(request) as answer, open("picture.${SUFFIX[formatOf(scene)] ?? formatOf(scene)}", "wb") as file:
    file.write(answer.read())`,
};

/* A picture by its address alone: of the whole scene, if this daemon has links to scenes. */
async function imageTag(scene, schema) {
    const { width = 512, height = 512 } = scene.image ?? {};
    const end = `width="${width}" height="${height}" alt="">`;
    if (schema.has("/v1/scene/")) {
        const format = formatOf(scene), suffix = ["png", "jpeg", "webp"].includes(format) ? SUFFIX[format] ?? format : "png";
        return `<img src="${url(`v1/scene/${await pack(scene)}.${suffix}`)}"\n     ${end}`;
    }
    const object = scene.objects.find(one => typeof one.material === "string" || one.material?.preset);
    const name = typeof object?.material === "string" ? object.material : object?.material?.preset;
    return name ? `<!-- The material in the light of the library, not this scene. -->\n<img src="${url(`v1/preview/${encodeURIComponent(name)}?shape=${object.type}&size=${width}`)}"\n     width="${width}" height="${width}" alt="${html(name)}">`
        : "<!-- This daemon has no links to whole scenes, and the scene no material of the library. -->";
}

const element = scene => `<script type="module" src="${url("shaded-preview.js")}"></script>
<shaded-preview label="…" scene="${html(JSON.stringify(scene))}"></shaded-preview>`;

export async function snippet(language, scene, schema) {
    if (language === "<img>") return imageTag(scene, schema);
    return language === "<shaded-preview>" ? element(scene) : LANGUAGES[language](scene);
}
export const languages = [...Object.keys(LANGUAGES), "<img>", "<shaded-preview>"];

export async function copyText(text) {
    if (navigator.clipboard) return navigator.clipboard.writeText(text);
    const area = h("textarea", { value: text, "aria-hidden": "true" });
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
}

/* The scene in another format, without what that format has not. */
export function inFormat(scene, format) {
    const { outputs, ...rest } = scene;
    const output = { ...(rest.output ?? outputs?.[0]) };
    delete output.name;
    if (output.format !== format) for (const name of ["bitDepth", "compression", "layers"]) delete output[name];
    if (["exr", "hdr"].includes(format)) for (const name of ["display", "view"]) delete output[name];
    return { ...rest, output: { ...output, format } };
}

export async function download(scene, format) {
    const answer = await post("v1/render", inFormat(scene, format), { accept: "*/*" });
    const address = URL.createObjectURL(await answer.blob());
    h("a", { href: address, download: `shaded.${SUFFIX[format] ?? format}` }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
}

/* The dialog with code to copy. */
export function makeCodeDialog(dialog, store, schema, say) {
    const code = h("pre.snippet", { tabindex: "0" }), tabs = h("div.segments", { role: "radiogroup", "aria-label": "Language" });
    let language = "curl";
    const show = async () => { code.textContent = await snippet(language, store.scene, schema); };
    for (const one of languages) {
        const input = h("input", { type: "radio", name: "language", value: one, checked: one === language });
        input.addEventListener("change", () => { language = one; show(); });
        tabs.append(h("label", {}, input, h("span", {}, one)));
    }
    const copy = h("button.primary", { type: "button", onclick: async () => {
        await copyText(code.textContent);
        say(`Copied: ${language}`);
    } }, icon("copy"), "Copy");
    const close = h("button.quiet", { type: "button", onclick: () => dialog.close() }, "Close");
    dialog.append(h("h2", {}, "This picture elsewhere"), tabs, code, h("div.dialog-foot", {}, close, copy));
    dialog.addEventListener("click", event => { if (event.target === dialog) dialog.close(); });
    return { open() { show(); dialog.showModal(); } };
}

export function makeDownloads(menu, store, formats, say) {
    menu.append(...formats.map(format => h("button.menu-item", { type: "button", onclick: async () => {
        menu.closest("details").open = false;
        try {
            await download(store.scene, format);
            say(`Saved as ${format.toUpperCase()}`);
        } catch (error) {
            if (!(error instanceof Refusal)) throw error;
            say(error.message, true);
        }
    } }, h("span", {}, format === "exr" ? "OpenEXR" : format === "hdr" ? "Radiance HDR" : format === "webp" ? "WebP" : format.toUpperCase()),
        h("small", {}, { png: "8 or 16 bits", jpeg: "8 bits, small", webp: "8 bits, smaller", tiff: "to floats", exr: "linear light", hdr: "linear light" }[format] ?? ""))));
}
