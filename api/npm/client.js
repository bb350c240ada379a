/* What a daemon of shaded answers, as promises: for browsers, and Node from 20.19 on. Types are in
 * client.d.ts; those of scenes and answers are generated from api/openapi.yaml. */

/* A refusal: its status, and the problem (RFC 9457) with a sentence and the places of all mistakes. */
export class ShadedError extends Error {
    constructor(status, problem, retryAfter) {
        super(problem.detail ?? problem.title ?? `status ${status}`);
        Object.assign(this, { name: "ShadedError", status, problem, retryAfter });
    }
}

/* The document in a link: deflate, in base64url. */
async function pack(scene) {
    const deflated = new Blob([JSON.stringify(scene)]).stream()
        .pipeThrough(new CompressionStream("deflate-raw"));
    const bytes = new Uint8Array(await new Response(deflated).arrayBuffer());
    const text = Array.from(bytes, byte => String.fromCharCode(byte)).join("");
    return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

export class Shaded {
    #server; #token; #fetch;

    constructor(server, { token = null, fetch = globalThis.fetch } = {}) {
        this.#server = new URL(server);
        this.#token = token;
        this.#fetch = fetch;
    }

    /* The answer as fetch gives it; a ShadedError if it is a refusal. */
    async request(path, { method = "GET", body, headers = {}, signal } = {}) {
        const sent = { ...headers };
        if (this.#token) sent.Authorization = `Bearer ${this.#token}`;
        const isText = typeof body === "string" || body instanceof Uint8Array || body instanceof Blob;
        if (body !== undefined) sent["Content-Type"] ??= "application/json";
        const answer = await (0, this.#fetch)(new URL(path, this.#server), {
            method, headers: sent, signal, body: body === undefined || isText ? body : JSON.stringify(body) });
        if (answer.ok || answer.status === 304) return answer;
        const problem = await answer.json().catch(() => ({ title: answer.statusText }));
        throw new ShadedError(answer.status, problem, Number(answer.headers.get("Retry-After")) || null);
    }

    /* One picture, or as form data all of a scene with `outputs`. With the entity tag of a picture
     * that is there already: null, if it is that one. */
    async render(scene, { accept = "image/png", etag, signal } = {}) {
        const headers = { Accept: accept, ...(etag ? { "If-None-Match": etag } : {}) };
        const answer = await this.request("v1/render", { method: "POST", body: scene, headers, signal });
        if (answer.status === 304) return null;
        const of = name => answer.headers.get(name);
        return { blob: await answer.blob(), type: of("Content-Type"), etag: of("ETag"),
                 plan: of("Shaded-Plan"), codec: of("Shaded-Codec"), timing: of("Server-Timing"), warnings: of("Shaded-Warning") };
    }

    async #tell(path, options) { return (await this.request(path, options)).json(); }

    explain(scene, options) { return this.#tell("v1/explain", { ...options, method: "POST", body: scene }); }
    compare(scene, options) { return this.#tell("v1/compare", { ...options, method: "POST", body: scene }); }
    analyze(scene, options) { return this.#tell("v1/analyze", { ...options, method: "POST", body: scene }); }
    brdf(scene, options) {
        const headers = { Accept: "application/json" };
        return this.#tell("v1/brdf", { ...options, method: "POST", body: scene, headers });
    }

    /* How far the pictures of two scenes are apart, or pictures that are kept, by their names. */
    diff(a, b, options) {
        const headers = { Accept: "application/json" };
        return this.#tell("v1/diff", { ...options, method: "POST", body: { a, b }, headers });
    }

    /* The coefficients of an object's material (its name; undefined: all objects have one) from a photo that was put. */
    fit(scene, photo, object, options) {
        const headers = { Accept: "application/json" };
        return this.#tell("v1/fit", { ...options, method: "POST", body: { scene, photo, object }, headers });
    }

    /* The parts as they come, in the body of the answer. */
    batch(batch, options) { return this.request("v1/batch", { ...options, method: "POST", body: batch }); }

    keepScene(scene, options) { return this.#tell("v1/scenes", { ...options, method: "PUT", body: scene }); }

    /* Bytes of a file or a Blob. Answers the name that `diff` and `fit` take. */
    async keepPicture(bytes, options) {
        const body = new Uint8Array(bytes instanceof Blob ? await bytes.arrayBuffer() : bytes);
        const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", body));
        const sha256 = Array.from(hash, byte => byte.toString(16).padStart(2, "0")).join("");
        await this.request(`v1/assets/${sha256}`, { ...options, method: "PUT", body,
                                                    headers: { "Content-Type": "application/octet-stream" } });
        return `sha256-${sha256}`;
    }

    materials(options) { return this.#tell("v1/materials", options); }
    shapes(options) { return this.#tell("v1/shapes", options); }
    colorspaces(options) { return this.#tell("v1/colorspaces", options); }
    version(options) { return this.#tell("v1/version", options); }

    /* For `src` of an <img>: of a whole scene, or of a material with the parameters of previews. */
    async sceneUrl(scene, suffix = "png") {
        return new URL(`v1/scene/${await pack(scene)}.${suffix}`, this.#server).href;
    }

    previewUrl(material, parameters = {}) {
        const url = new URL(`v1/preview/${encodeURIComponent(material)}`, this.#server);
        url.search = new URLSearchParams(Object.entries(parameters).map(([k, v]) => [k, String(v)])).toString();
        return url.href;
    }
}
