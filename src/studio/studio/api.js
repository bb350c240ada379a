/* What the daemon has, and what it says of a scene. */

export const base = new URL("..", import.meta.url);
export const url = path => new URL(path, base).href;

/* The token of this tab, where the operator has set tokens. */
let token = sessionStorage.getItem("shaded-token");
const listeners = new Set();
export const access = {
    get token() { return token; },
    set token(value) {
        token = value || null;
        if (token) sessionStorage.setItem("shaded-token", token);
        else sessionStorage.removeItem("shaded-token");
        for (const listener of listeners) listener(token);
    },
    watch(listener) { listeners.add(listener); },
};

const headers = more => token ? { Authorization: `Bearer ${token}`, ...more } : more;

export class Refusal extends Error {
    constructor(status, problem) {
        super(problem.detail || problem.title);
        this.status = status;
        this.problem = problem;
    }
}

async function checked(answer) {
    if (answer.ok) return answer;
    const isJson = answer.headers.get("Content-Type")?.includes("json");
    throw new Refusal(answer.status, isJson ? await answer.json() : { title: answer.statusText, detail: "" });
}

export const get = async path => (await checked(await fetch(url(path), { headers: headers({ Accept: "application/json" }) }))).json();

export async function post(path, scene, { accept = "application/json", signal } = {}) {
    return checked(await fetch(url(path), {
        method: "POST", body: JSON.stringify(scene), signal,
        headers: headers({ "Content-Type": "application/json", Accept: accept }),
    }));
}

/* Asks about the scene, of which the last is meant: what is under way is aborted. Null: it was.
 * Files come as Blobs, with what was told of them as `plan`. */
export class Latest {
    #control = null;
    async post(path, scene, options) {
        this.#control?.abort();
        const control = this.#control = new AbortController();
        try {
            const answer = await post(path, scene, { ...options, signal: control.signal });
            const body = options?.accept ? Object.assign(await answer.blob(), { plan: answer.headers.get("Shaded-Plan") }) : await answer.json();
            return control === this.#control ? body : null;
        } catch (error) {
            if (control !== this.#control || error.name === "AbortError") return null;
            throw error;
        }
    }
}
