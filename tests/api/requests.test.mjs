// Requests made from the contract, and broken ones: every answer is one that the contract documents.
import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { after, before, test } from "node:test";
import { deflateRawSync } from "node:zlib";

import { api, checkAnswer, checkProblem, operations, resolve } from "./contract.mjs";
import { Daemon } from "./daemon.mjs";
import { fc, holds } from "./packages.mjs";
import { sceneArbitrary } from "./scenes.mjs";
import { Values } from "./values.mjs";

let daemon, scenes;

before(async () => {
    daemon = await Daemon.start();
    scenes = await sceneArbitrary(daemon);
    await daemon.ask({ method: "PUT", path: "/v1/scenes", body: SMALL,
                       headers: { "Content-Type": "application/json" } });
});
after(() => daemon.stop());

// ---- Parts of requests ----

// A scene for links.
const SMALL = JSON.stringify({ objects: [{ type: "sphere" }], image: { width: 8, height: 8 } });

const ID = "ABCXYZabcxyz019._-".split("");
const FIELD_TEXT = /^[\t\x20-\x7e\x80-\xff]*$/;

const quality = fc.option(fc.constantFrom("0", "0.1", "0.5", "1", "1.000"), { nil: null });

// A list of media ranges, of what the operation answers and what it does not.
function acceptArbitrary(operation) {
    const types = Object.keys(resolve(operation.responses["200"])?.content ?? {});
    const range = fc.constantFrom(...types, "*/*", "image/*", "application/*", "text/css");
    const element = fc.tuple(range, quality)
        .map(([type, q]) => q === null ? type : `${type};q=${q}`);
    return fc.array(element, { minLength: 1, maxLength: 4 }).map(list => list.join(", "));
}

const tag = fc.oneof(fc.constant("*"), fc.constantFrom('"0123456789abcdef"', 'W/"a"', '""', '"a"'));
const fieldText = fc.string({ unit: "binary-ascii", maxLength: 40 })
    .filter(text => FIELD_TEXT.test(text));

// By place and name; what is not here comes from the parameter's own schema.
const usual = {
    "header If-None-Match": fc.array(tag, { minLength: 1, maxLength: 3 })
        .map(list => list.join(", ")),
    "header X-Request-Id": fc.oneof(fc.array(fc.constantFrom(...ID), { minLength: 1, maxLength: 64 })
        .map(list => list.join("")), fieldText),
    "path material": fc.oneof({ arbitrary: fc.constantFrom("brass", "jade", "pewter"), weight: 5 },
                              fc.string({ minLength: 1, unit: "grapheme" })),
    "path document": fc.tuple(fc.constantFrom("{}", "{", SMALL), fc.boolean()).map(([text, isWhole]) =>
        deflateRawSync(text).subarray(0, isWhole ? 1e6 : -4).toString("base64url") || "A"),
    "path digest": fc.constantFrom(createHash("sha256").update(SMALL).digest("hex"), "0".repeat(64)),
    "path file": fc.oneof(fc.constantFrom("main.js", "studio.css"),
                          fc.string({ minLength: 1, unit: "grapheme" })),
    "query size": fc.integer({ min: 1, max: 66 }),
    "query width": fc.integer({ min: 1, max: 66 }),
    "query height": fc.integer({ min: 1, max: 66 }),
    "query samples": fc.integer({ min: 1, max: 9 }),
    "query display": fc.oneof(fc.constantFrom("sRGB", "Rec.1886"), fc.string()),
    "query view": fc.oneof(fc.constantFrom("Standard", "Raw"), fc.string()),
    ...Object.fromEntries(["background", "emissive", "ambient", "diffuse", "specular"].map(name =>
        [`query ${name}`, fc.oneof(fc.constantFrom("0.5", "1,0,0.25", "#fe0", "transparent", "teal", "lab(50% 20 -9)", "1,0,0,0.5"), fc.string())])),
    "query colorSpace": fc.oneof(fc.constantFrom("sRGB", "HSV", "ACEScg"), fc.string()),
};

function parameterArbitrary(operation, { name, in: place, schema }) {
    if (name === "Accept") return acceptArbitrary(operation);
    return usual[`${place} ${name}`] ?? new Values(schema).of(schema);
}

// {header: {...}, path: {...}, query: {...}}, with what is required and some of the rest.
function parametersArbitrary(operation) {
    const model = { header: {}, path: {}, query: {} }, required = [];
    for (const parameter of (operation.parameters ?? []).map(resolve)) {
        model[parameter.in][parameter.name] = parameterArbitrary(operation, parameter);
        if (parameter.required) required.push(parameter.name);
    }
    const record = part => fc.record(part, {
        requiredKeys: Object.keys(part).filter(name => required.includes(name)),
        noNullPrototype: true,
    });
    return fc.record({ header: record(model.header), path: record(model.path),
                       query: record(model.query) });
}

// Where a path takes no parameters, a query is not looked at.
const anyQuery = fc.constantFrom("", "", "?", "?a=1", "?size=64&shape=torus", "?%00", "?a=%zz");
const jsonTypes = fc.constantFrom("application/json", "application/json; charset=utf-8",
                                  "application/vnd.scene+json", "APPLICATION/JSON");

const fill = (template, values) =>
    template.replace(/\{(.*?)\}/g, (_, name) => encodeURIComponent(values[name]));

const inThrees = (range, most) => fc.array(fc.tuple(...Array(3).fill(fc.integer(range))),
                                           { minLength: 1, maxLength: most }).map(list => list.flat());

// A mesh, with its digest or another one.
const meshRequests = operation => fc.record({
    parameters: parametersArbitrary(operation), type: jsonTypes, isRight: fc.boolean(),
    mesh: fc.record({ positions: inThrees({ min: -9, max: 9 }, 6), indices: inThrees({ min: 0, max: 3 }, 2) },
                    { noNullPrototype: true }),
}).map(({ parameters, type, isRight, mesh }) => {
    const body = JSON.stringify(mesh);
    const digest = createHash("sha256").update(body).digest("hex");
    return { method: "PUT", body, headers: { ...parameters.header, "Content-Type": type },
             path: `/v1/meshes/${isRight ? digest : parameters.path.sha256}` };
});

// A file that need not be a picture.
const assetRequests = operation => fc.record({
    parameters: parametersArbitrary(operation), isRight: fc.boolean(), body: fc.string(),
    type: fc.constantFrom("image/png", "image/x-exr", "application/octet-stream"),
}).map(({ parameters, isRight, body, type }) => {
    const digest = createHash("sha256").update(body).digest("hex");
    return { method: "PUT", body, headers: { ...parameters.header, "Content-Type": type },
             path: `/v1/assets/${isRight ? digest : parameters.path.sha256}` };
});

function validRequests(operation) {
    if (operation.operationId === "putAsset") return assetRequests(operation);
    if (operation.operationId === "putMesh") return meshRequests(operation);
    const { path, method } = operation;
    const common = { parameters: parametersArbitrary(operation), query: anyQuery };
    const body = operation.requestBody ? { scene: scenes, type: jsonTypes } : {};
    return fc.record({ ...common, ...body }).map(({ parameters, query, scene, type }) => {
        const asked = new URLSearchParams(parameters.query).toString();
        const takesQuery = operation.parameters?.some(one => resolve(one).in === "query");
        return {
            method: method.toUpperCase(),
            path: fill(path, parameters.path) + (takesQuery ? asked && `?${asked}` : query),
            headers: scene ? { ...parameters.header, "Content-Type": type } : parameters.header,
            body: scene && JSON.stringify(scene),
        };
    });
}

// ---- Requests that the contract describes ----

test("valid requests get documented answers, with documented fields and bodies", async () => {
    const seen = {};
    for (const operation of operations) {
        const runs = operation.requestBody || operation.parameters?.length > 5 ? 60 : 15;
        await holds(runs, validRequests(operation), async request => {
            const answer = await daemon.ask(request);
            checkAnswer(answer, operation);
            if (!request.body && request.headers["If-None-Match"]?.split(", ").includes("*"))
                assert.notEqual(answer.status, 200, "it has changed since *");
            if (/^[A-Za-z0-9._-]{1,64}$/.test(request.headers["X-Request-Id"] ?? ""))
                assert.deepEqual(answer.headers.get("x-request-id"),
                                 [request.headers["X-Request-Id"]]);
            seen[answer.status] = (seen[answer.status] ?? 0) + 1;
        });
    }
    console.log(seen);
    for (const status of [200, 201, 204, 304, 406, 422]) assert.ok(seen[status] > 5, `${status}`);
});

// ---- Requests that are broken ----

// Bytes with some of them changed, left out or repeated.
function broken(bytes) {
    const edit = fc.record({ at: fc.nat(), how: fc.constantFrom("set", "cut", "drop", "repeat"),
                             byte: fc.oneof(fc.nat(255), fc.constantFrom(...'{}[]":,\\0e\r\n ')
                                 .map(c => c.charCodeAt(0))) });
    return fc.tuple(bytes, fc.array(edit, { minLength: 1, maxLength: 3 })).map(([whole, edits]) => {
        for (const { at, how, byte } of edits) {
            const i = at % (whole.length + 1);
            const end = how === "cut" ? whole.length : how === "drop" ? i + 3 : i + 1;
            const middle = how === "set" ? Buffer.from([byte])
                : how === "repeat" ? Buffer.concat([whole.subarray(i, i + 9), whole.subarray(i, i + 9)])
                : Buffer.alloc(0);
            whole = Buffer.concat([whole.subarray(0, i), middle, whole.subarray(end)]);
        }
        return whole;
    });
}

const paths = Object.keys(api.paths);
const submitted = paths.filter(path => api.paths[path].post);
const anyPath = fc.oneof(
    { arbitrary: fc.constantFrom(...paths), weight: 3 },
    { arbitrary: fc.constantFrom(...submitted), weight: 4 },
    fc.constantFrom(...paths).map(path => path + "/"),
    fc.webPath({ size: "small" }).map(path => "/" + path.replace(/^\/+/, "")));
const anyMethod = fc.oneof(
    { arbitrary: fc.constant("POST"), weight: 2 },
    fc.constantFrom("GET", "HEAD", "OPTIONS", "PUT", "DELETE", "PATCH", "TRACE", "PROPFIND"));
const anyHeaders = fc.record({
    "Content-Type": fc.oneof({ arbitrary: jsonTypes, weight: 3 }, fieldText,
                             fc.constantFrom("text/css", "application/xml", "multipart/form-data")),
    "Content-Encoding": fc.constantFrom("identity", "identity", "gzip", "zstd", "br", ""),
    "Accept": fc.oneof(fieldText, fc.constantFrom("image/png", "application/json", "*/*", ",,")),
    "If-None-Match": fieldText,
    "X-Request-Id": fieldText,
    "Authorization": fieldText,
    "Origin": fieldText,
}, { requiredKeys: [], noNullPrototype: true });

function brokenRequests() {
    const text = scenes.map(scene => Buffer.from(JSON.stringify(scene)));
    const body = fc.oneof({ arbitrary: broken(text), weight: 3 }, text,
                          fc.uint8Array({ maxLength: 200 }).map(bytes => Buffer.from(bytes)),
                          fc.jsonValue().map(value => Buffer.from(JSON.stringify(value))));
    return fc.record({ method: anyMethod, path: anyPath, headers: anyHeaders, body })
        .map(request => ["GET", "HEAD", "TRACE"].includes(request.method)
            ? { ...request, body: undefined } : request);
}

test("broken requests are refused with problem documents", async () => {
    const seen = {};
    const byName = new Map(operations.map(operation =>
        [`${operation.method} ${operation.path}`, operation]));
    await holds(600, brokenRequests(), async request => {
        const answer = await daemon.ask(request);
        const path = request.path === "/docs/" ? "/docs" : request.path; // one page
        const operation = byName.get(`${request.method.toLowerCase()} ${path}`);
        seen[answer.status] = (seen[answer.status] ?? 0) + 1;
        if (operation) {
            checkAnswer(answer, operation);
            assert.ok(answer.status < 500, `${answer.status}`);
            return;
        }
        const known = path in api.paths;
        assert.equal(answer.status, known ? 405 : 404);
        assert.ok(answer.headers.get("x-request-id"));
        if (known) assert.ok(answer.headers.get("allow"));
        if (request.method !== "HEAD") checkProblem(answer);
    });
    console.log(seen);
    for (const status of [200, 400, 404, 405, 406, 415, 422]) assert.ok(seen[status] > 2, `${status}`);
});

// ---- Messages that are broken ----

// libmicrohttpd's own answers, as the contract's description lists them.
const OWN = [400, 413, 414, 431, 505];

function messages() {
    const field = fc.oneof(
        fc.constantFrom("Content-Length: 5", "Content-Length: +5", "Transfer-Encoding: chunked",
                        "Transfer-Encoding: gzip", "Expect: 100-continue", "Host: b", " folded",
                        "Connection: close", "Upgrade: h2c", "Cookie: a=b", "Content-Length: 9e9"),
        fc.tuple(fc.string({ maxLength: 9 }), fieldText).map(([name, text]) => `${name}: ${text}`));
    const parts = {
        method: anyMethod, path: anyPath, scene: scenes, fields: fc.array(field, { maxLength: 3 }),
        version: fc.constantFrom("HTTP/1.1", "HTTP/1.1", "HTTP/1.0", "HTTP/2.0", "HTTP/1.2", "http"),
    };
    const whole = fc.record(parts).map(({ method, path, scene, fields, version }) => {
        const body = Buffer.from(JSON.stringify(scene));
        return Buffer.from([`${method} ${path} ${version}`, "Host: a", "Content-Type: application/json",
                            `Content-Length: ${body.length}`, ...fields, "", body].join("\r\n"),
                           "latin1");
    });
    return fc.oneof(whole, broken(whole));
}

test("broken messages get whole answers, and take nothing from those who come after", async () => {
    const seen = {};
    const check = async message => {
        const answer = (await daemon.raw(message)).toString("latin1")
            .replace("HTTP/1.1 100 Continue\r\n\r\n", "");
        const status = Number(/^HTTP\/1\.[01] (\d{3}) /.exec(answer)?.[1] ?? 0);
        seen[status] = (seen[status] ?? 0) + 1;
        if (!answer) return; // it waits for more than came
        assert.ok(status, answer.slice(0, 200));
        const end = answer.indexOf("\r\n\r\n");
        assert.ok(end > 0, answer);
        const head = answer.slice(0, end), body = answer.slice(end + 4);
        if (status >= 400 && !/^content-type: application\/problem\+json\r?$/im.test(head)) {
            assert.ok(OWN.includes(status), answer.slice(0, 500));
            seen[`own ${status}`] = (seen[`own ${status}`] ?? 0) + 1;
        } else {
            assert.ok(status < 500, answer.slice(0, 500));
            assert.match(head, /^x-request-id: /im);
        }
        if (status >= 200 && !message.subarray(0, 8).includes("HEAD"))
            assert.ok(body.length >= Number(/^content-length: (\d+)/im.exec(head)?.[1] ?? 0), answer);
    };
    // Side by side: some of them wait until the daemon finds that nothing more will come.
    const several = fc.array(messages(), { minLength: 8, maxLength: 8 });
    await holds(20, several, async list => { await Promise.all(list.map(check)); });
    console.log(seen);
    assert.equal((await daemon.ask({ method: "GET", path: "/" })).status, 200);
});
