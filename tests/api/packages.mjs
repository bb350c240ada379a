// The npm packages, from where `run` has put them.
import { createRequire } from "node:module";

const require = createRequire(process.env.SHADED_PACKAGES + "/");

export const fc = require("fast-check");
export const Ajv = require("ajv/dist/2020.js").default;
export const yaml = require("yaml");

// A property, for as many values as FC_RUNS asks for; a failure tells the seed and the smallest
// value that was found.
const seed = Number(process.env.FC_SEED || 20240229);
const times = Number(process.env.FC_RUNS || 1);
console.log(`FC_SEED=${seed} FC_RUNS=${times}`);

export async function holds(runs, arbitrary, predicate) {
    let told = false;
    // Smaller values may take longer to find than the test may.
    const tell = async value => {
        try {
            await predicate(value);
        } catch (error) {
            if (!told) console.log("first failure:", JSON.stringify(value), error.message);
            told = true;
            throw error;
        }
    };
    await fc.assert(fc.asyncProperty(arbitrary, tell),
                    { seed, numRuns: Math.ceil(runs * times), verbose: 0 });
}
