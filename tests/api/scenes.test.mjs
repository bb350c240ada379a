// Scenes made from the schema: what is valid by it is drawn, or refused for what a schema cannot
// say; what is not is refused, with pointers to what is wrong.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { checkAnswer, checkBeyondSchema, checkProblem, isScene, operations } from "./contract.mjs";
import { Daemon } from "./daemon.mjs";
import { holds } from "./packages.mjs";
import { leadsSomewhere, mutantArbitrary, sceneArbitrary } from "./scenes.mjs";

// A batch and a fit have their scene inside, which tests/e2e holds against what they are.
const submitting = operations.filter(operation => operation.method === "post" && !["/v1/batch", "/v1/fit"].includes(operation.path));
// What has no one picture in color.
const notCompared = /"pointer":"\/[ab]\/output(s|\/channel|\/scope|)"/;
// Fuzzers have random scenes for sanitizers, too: half as many are enough for these.
const share = process.env.SHADED_SANITIZE ? 0.5 : 1;
let daemon, scenes;

before(async () => {
    // A sanitized daemon takes a minute for what is a second of work elsewhere.
    daemon = await Daemon.start("--max-work", "1");
    scenes = await sceneArbitrary(daemon);
});
after(() => daemon.stop());

test("scenes that are valid by the schema are taken, or refused for what it cannot say", async () => {
    for (const operation of submitting) {
        let taken = 0, refused = 0;
        await holds(operation.path === "/v1/render" ? 200 * share : 40, scenes, async scene => {
            assert.ok(isScene(scene));
            const isPair = operation.path === "/v1/diff"; // of itself: nothing differs
            const answer = await daemon.post(operation.path, isPair ? { a: scene, b: scene } : scene);
            checkAnswer(answer, operation);
            if (isPair && answer.status === 200) {
                const { differing, flip, deltaE2000 } = JSON.parse(answer.body);
                assert.deepEqual([differing, flip.max, deltaE2000.max], [0, 0, 0]);
            }
            if (answer.status === 200) {
                taken++;
            } else {
                refused++;
                if (!isPair || !notCompared.test(answer.body)) checkBeyondSchema(answer);
            }
        });
        console.log(`${operation.path}: ${taken} taken, ${refused} refused`);
        assert.ok(taken > (operation.path === "/v1/diff" ? 0 : refused / 3), "most scenes are refused: nothing was tested");
    }
});

test("scenes that are not valid by the schema are refused, with pointers", async () => {
    let invalid = 0, valid = 0;
    await holds(500 * share, mutantArbitrary(scenes), async ({ scene }) => {
        const answer = await daemon.post("/v1/render", scene);
        if (isScene(scene)) {
            valid++;
            if (answer.status !== 200) checkBeyondSchema(answer);
            return;
        }
        invalid++;
        assert.equal(answer.status, 422, `${answer.status}: only the schema refuses it`);
        for (const { pointer } of checkProblem(answer).errors)
            assert.ok(leadsSomewhere(scene, pointer), pointer);
    });
    console.log(`${invalid} mistakes, ${valid} that are none`);
    assert.ok(invalid > valid / 2, "most mistakes are none: nothing was tested");
});
