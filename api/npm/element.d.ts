import type { Problem, Scene } from "./client.js";

export interface Plan {
    plan: string;
    tier: string;
    asked: string | null;
    lights: { used: number; given: number } | null;
    error: Record<string, number>;
}

export interface Bound extends Plan {
    timing: Record<string, number>;
    reuse: string;
    warnings: { detail: string; pointer: string }[];
    milliseconds: number;
    draft: boolean;
    clipped: number;
    bytes: number;
}

export function readPlan(text: string | null): Plan;
export function readTiming(text: string | null): { timing: Record<string, number>; reuse: string };
export function readWarnings(text: string | null): { detail: string; pointer: string }[];

/** `<shaded-preview>`. Beside a daemon's own page it wants `server`. */
export class ShadedPreview extends HTMLElement {
    get scene(): Scene | null;
    set scene(value: Scene | string | null);
    set token(value: string | null);
    material: string | null;
    shape: string | null;
    size: string | number | null;
    width: string | number | null;
    height: string | number | null;
    samples: string | number | null;
    background: string | null;
    display: string | null;
    view: string | null;
    colorSpace: string | null;
    format: string | null;
    quality: string | number | null;
    emissive: string | null;
    ambient: string | null;
    diffuse: string | null;
    specular: string | null;
    shininess: string | number | null;
    ground: boolean;
    server: string | null;
    label: string | null;
    loading: string | null;
    draft: boolean;
    readonly busy: boolean;
    plan: Bound | null;
    picture: Blob | null;
}

declare global {
    interface HTMLElementTagNameMap { "shaded-preview": ShadedPreview; }
}
