import type { components, paths } from "./schema.js";

type Schemas = components["schemas"];
/** The JSON that a path answers 200 with. */
type Answer<P extends keyof paths, M extends keyof paths[P]> =
    paths[P][M] extends { responses: { 200: { content: { "application/json": infer A } } } } ? A : never;

export type Scene = Schemas["Scene"];
export type Problem = Schemas["Problem"];
/** Merge patches (RFC 7396) of a scene, or lists of values by JSON Pointer. What the contract calls an
 * object is any object; generated types know the empty one only. */
export type Batch = { scene: Partial<Scene>; name?: string } &
    ({ variants?: object[]; sweep?: never } | { sweep: Record<string, unknown[]>; variants?: never });

export interface Asking { signal?: AbortSignal; }

export interface Picture {
    blob: Blob;
    type: string | null;
    etag: string | null;
    /** The plan in a line: the tier, what is used, and bounds of the error. */
    plan: string | null;
    /** Under a budget, what JPEG or WebP lose: the quality that was found, and its error. */
    codec: string | null;
    timing: string | null;
    warnings: string | null;
}

export class ShadedError extends Error {
    constructor(status: number, problem: Problem, retryAfter: number | null);
    readonly status: number;
    readonly problem: Problem;
    /** Seconds until it is worth asking again, of 429 and 503. */
    readonly retryAfter: number | null;
}

export class Shaded {
    constructor(server: string | URL, options?: { token?: string | null; fetch?: typeof fetch });
    request(path: string, options?: Asking & { method?: string; headers?: Record<string, string>;
                                               body?: unknown }): Promise<Response>;
    render(scene: Scene, options: Asking & { accept?: string; etag: string }): Promise<Picture | null>;
    render(scene: Scene, options?: Asking & { accept?: string }): Promise<Picture>;
    explain(scene: Scene, options?: Asking): Promise<Answer<"/v1/explain", "post">>;
    compare(scene: Scene, options?: Asking): Promise<Answer<"/v1/compare", "post">>;
    analyze(scene: Scene, options?: Asking): Promise<Answer<"/v1/analyze", "post">>;
    brdf(scene: Scene, options?: Asking): Promise<Answer<"/v1/brdf", "post">>;
    diff(a: Scene | string, b: Scene | string, options?: Asking): Promise<Answer<"/v1/diff", "post">>;
    fit(scene: Scene, photo: string, object?: string, options?: Asking): Promise<Answer<"/v1/fit", "post">>;
    batch(batch: Batch, options?: Asking): Promise<Response>;
    keepScene(scene: Scene, options?: Asking): Promise<Answer<"/v1/scenes", "put">>;
    /** Puts the file of a picture, and answers its name for `diff` and `fit`. */
    keepPicture(bytes: Blob | ArrayBuffer | Uint8Array, options?: Asking): Promise<`sha256-${string}`>;
    materials(options?: Asking): Promise<Answer<"/v1/materials", "get">>;
    shapes(options?: Asking): Promise<Answer<"/v1/shapes", "get">>;
    colorspaces(options?: Asking): Promise<Answer<"/v1/colorspaces", "get">>;
    version(options?: Asking): Promise<Answer<"/v1/version", "get">>;
    sceneUrl(scene: Scene, suffix?: "png" | "jpg" | "webp"): Promise<string>;
    previewUrl(material: string, parameters?: Record<string, string | number | boolean>): string;
}
