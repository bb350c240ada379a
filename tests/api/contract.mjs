// api/openapi.yaml, and whether answers are as it says.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { Ajv, yaml } from "./packages.mjs";

const source = path => readFileSync(`${process.env.SHADED_SOURCE}/${path}`, "utf8");

export const api = yaml.parse(source("api/openapi.yaml"));
export const schema = JSON.parse(source("api/scene.schema.json"));
// [regular expression, example]: what the reader refuses and a schema cannot.
export const rules = JSON.parse(source("tests/conformance/beyond_schema.json"));

const METHODS = ["get", "head", "post", "put", "delete", "options", "patch", "trace"];
// Fields that HTTP itself defines for every message.
const GENERAL = new Set(["date", "content-length", "content-type", "connection", "transfer-encoding"]);

// `title`, `example` and what else OpenAPI adds are not asserted; unknown keywords are mistakes.
const ajv = new Ajv({ strict: true, strictTypes: false, strictTuples: false, strictRequired: false,
                      allowUnionTypes: true, validateFormats: false });
ajv.addVocabulary(["example", "discriminator"]);
ajv.addSchema(schema, "scene.schema.json");

// The contract's schemas as one document that references lead into.
const rooted = part =>
    JSON.parse(JSON.stringify(part).replaceAll('"#/components/schemas/', '"openapi.yaml#/$defs/'));
ajv.addSchema({ $id: "openapi.yaml", $defs: rooted(api.components.schemas) });

const compiled = new Map();

function validator(part) {
    if (!compiled.has(part)) compiled.set(part, ajv.compile(rooted(part)));
    return compiled.get(part);
}

export const isScene = ajv.getSchema("scene.schema.json");

export function resolve(value) {
    while (value?.$ref) {
        const keys = value.$ref.replace("#/", "").split("/");
        value = keys.reduce((at, key) => at[key], api);
    }
    return value;
}

export const operations = Object.entries(api.paths).flatMap(([path, item]) =>
    METHODS.filter(method => item[method]).map(method => ({ path, method, ...item[method] })));

function assertValid(value, part, what) {
    const validate = validator(part);
    assert.ok(validate(value), `${what}: ${JSON.stringify(value)?.slice(0, 300)}: ` +
              ajv.errorsText(validate.errors));
}

// What a media type's bytes begin with.
const BEGINNINGS = {
    "image/png": [0x89, 0x50, 0x4e, 0x47], "image/jpeg": [0xff, 0xd8, 0xff],
    "image/webp": [...Buffer.from("RIFF")], "image/tiff": [...Buffer.from("II*\0")],
    "image/x-exr": [0x76, 0x2f, 0x31, 0x01], "image/vnd.radiance": [...Buffer.from("#?RADIANCE")],
    "image/svg+xml": [...Buffer.from("<")],
    "text/html": [...Buffer.from("<!doctype html>")], "text/css": [...Buffer.from("/*")],
    "text/javascript": [...Buffer.from("/*")],
    "multipart/form-data": [...Buffer.from("--shaded-")], "application/yaml": [...Buffer.from("openapi: ")],
};

function checkHeaders(answer, documented) {
    const known = new Map(Object.entries(documented ?? {})
        .map(([name, header]) => [name.toLowerCase(), resolve(header)]));
    for (const [name, header] of known)
        if (header.required) assert.ok(answer.headers.has(name), `${name} is missing`);
    for (const [name, values] of answer.headers) {
        if (known.has(name))
            for (const value of values) assertValid(value, known.get(name).schema, name);
        else
            assert.ok(GENERAL.has(name), `${name} is not documented`);
    }
}

function checkBody(answer, content, method) {
    if (method === "head" || !content) {
        assert.equal(answer.body.length, 0);
        return;
    }
    const mediaType = answer.headers.get("content-type")[0].split(";")[0];
    assert.ok(mediaType in content, `${mediaType} is not documented`);
    if (mediaType.endsWith("json")) {
        const value = JSON.parse(answer.body);
        assertValid(value, content[mediaType].schema, mediaType);
        if (mediaType === "application/problem+json") assert.equal(value.status, answer.status);
    } else {
        assert.deepEqual([...answer.body.subarray(0, BEGINNINGS[mediaType].length)],
                         BEGINNINGS[mediaType], mediaType);
    }
}

// The answer is one that the operation documents.
export function checkAnswer(answer, operation) {
    const response = resolve(operation.responses[answer.status]);
    assert.ok(response, `${answer.status} is not documented: ${answer.body.subarray(0, 500)}`);
    checkHeaders(answer, response.headers);
    checkBody(answer, response.content, operation.method);
}

const problem = { $ref: "#/components/schemas/Problem" };

// The answer is a refusal with a sound problem document, which is returned.
export function checkProblem(answer) {
    assert.equal(answer.headers.get("content-type")?.[0], "application/problem+json");
    assert.equal(answer.headers.get("cache-control")?.[0], "no-store");
    const value = JSON.parse(answer.body);
    assertValid(value, problem, "problem");
    assert.equal(value.status, answer.status);
    return value;
}

// Limits and budgets are the operator's and the plan's; the other rules are the reader's.
const reasons = [...rules.map(([rule]) => new RegExp(rule)), /the limit `\w+`/, /^no tier stays within/,
                 /^\w+ of quality \d+ does not stay within/, /^no bound in \w+ is known for this scene/,
                 /^what \w+ loses is not known/, /^it cannot be drawn/, /^a pattern or a picture is many reflectances/,
                 /^a material with a map of normals needs /,
                 /^a westin material has no pattern or picture in a spectral scene/];

// The refusal of a scene that is valid by the schema names only what a schema cannot say.
export function checkBeyondSchema(answer) {
    const value = checkProblem(answer);
    assert.ok([409, 422].includes(answer.status), `${answer.status}`);
    for (const { detail } of value.errors)
        assert.ok(reasons.some(reason => reason.test(detail)), `the schema does not say: ${detail}`);
}
