/* How exact the picture is and what it took: from its own headers at once, and from /v1/explain once
 * it stands still. */
import { Latest } from "./api.js";
import * as controls from "./controls.js";
import { debounce, figure, h } from "./dom.js";
import { Form } from "./form.js";
import { HeatMap } from "./heat.js";
import { titleOf } from "./hints.js";

const STAGES = ["parse", "plan", "visibility", "shade", "color", "encode"];
const UNITS = { deltaE2000: ["ΔE 2000", "CIEDE2000 against the exact tier"], code: ["8-bit codes", "Codes of 8 bits against the exact tier"],
                linear: ["linear", "Components of linear light against the model"] };

export class AccuracyPanel {
    #asked = new Latest();
    #measured = new Latest();
    #form = null;
    #isBudget = null;

    constructor(element, { schema, store, shown, hasFloats }) {
        Object.assign(this, { schema, store });
        const tiers = [...schema.of("AskedTier").enum, "budget"];
        this.tier = controls.segments("Accuracy", tiers, {
            labels: Object.fromEntries(tiers.map(one => [one, titleOf(one)])),
            change: one => store.set("/accuracy", one === "budget" ? { maxError: 0.5 } : one === "standard" ? undefined : { tier: one }),
        });
        this.budget = h("div.rows");
        this.figures = Object.fromEntries(Object.entries(UNITS).map(([unit, [name, why]]) =>
            [unit, h("div.stat", { title: why, "data-unit": unit }, h("dd", {}, "–"), h("dt", {}, name))]));
        this.bar = h("div.stages", { role: "img" });
        this.legend = h("ul.legend");
        this.words = h("ul.words");
        this.measures = h("div.measures");
        this.heat = hasFloats ? new HeatMap({ store, shown }) : null;
        const measure = h("button.quiet", { type: "button", onclick: () => this.#measure(measure) }, "Measure against exact");
        element.append(h("h2", {}, "Accuracy"), ...this.tier.element, this.budget,
                       h("dl.stats", {}, ...Object.values(this.figures)), this.bar, this.legend,
                       h("details.more", {}, h("summary", {}, "What was done, and what was left out"), this.words), measure, this.heat?.element ?? "", this.measures);
        this.explainSoon = debounce(150, seen => this.#explain(seen));
    }

    /* A picture has come. */
    take(bound) {
        for (const [unit, stat] of Object.entries(this.figures)) {
            const value = bound.error[unit];
            stat.firstChild.textContent = value === undefined ? "unknown" : `≤ ${figure(value)}`;
            stat.classList.toggle("is-unknown", value === undefined);
        }
        const spent = STAGES.map(stage => [stage, bound.timing[stage] ?? 0]), total = spent.reduce((sum, [, ms]) => sum + ms, 0);
        this.bar.classList.toggle("is-kept", bound.reuse === "picture");
        this.bar.replaceChildren(...spent.map(([stage, ms]) => {
            const part = h("span", { class: `stage-${stage}`, title: `${stage}: ${ms.toFixed(2)} ms` });
            part.style.flexGrow = String(Math.max(ms, 0.001));
            return part;
        }));
        this.bar.setAttribute("aria-label", "Time by stage: " + spent.map(([stage, ms]) => `${stage} ${ms.toFixed(2)} ms`).join(", "));
        this.legend.replaceChildren(...spent.filter(([, ms]) => ms > 0.005 * total).map(([stage, ms]) =>
            h("li", {}, h("i", { class: `stage-${stage}` }), h("span", {}, stage), h("b", {}, ms.toFixed(ms < 10 ? 2 : 0)))),
            h("li.sum", {}, h("span", {}, { nothing: "total", picture: "the same picture was made before" }[bound.reuse] ?? `total, ${bound.reuse} kept`),
              h("b", {}, `${total.toFixed(total < 10 ? 2 : 0)} ms`)));
        if (!bound.draft) this.explainSoon(this.store.scene);
    }

    async #explain(seen) {
        const { scene } = this.store;
        if (scene !== seen) return;
        const told = await this.#asked.post("v1/explain", scene).catch(() => null);
        if (!told || scene !== this.store.scene) return;
        this.words.replaceChildren(...told.words.map(word => h("li", {}, word)));
        for (const [unit, stat] of Object.entries(this.figures)) stat.title = told.bound[unit].why ?? UNITS[unit][1];
    }

    async #measure(button) {
        const { scene } = this.store;
        button.disabled = true;
        try {
            const told = await this.#measured.post("v1/compare", scene);
            if (!told || scene !== this.store.scene) return;
            await this.heat?.measure(told.measuredIn);
            if (scene !== this.store.scene) return;
            const line = (title, pick) => h("tr", {}, h("th", { scope: "row" }, title), ...told.tiers.map(tier => h("td", {}, pick(tier))));
            this.measures.replaceChildren(h("table", {}, h("caption", {}, "Measured in this picture"),
                h("thead", {}, h("tr", {}, h("td"), ...told.tiers.map(({ tier }) => h("th", { scope: "col" }, tier)))),
                h("tbody", {}, line("ΔE 2000, largest", one => figure(one.error.deltaE2000.max)), line("99 %", one => figure(one.error.deltaE2000.p99)),
                  line("Codes, largest", one => figure(one.error.code.max)), line("Linear, largest", one => figure(one.error.linear.max)),
                  line("PSNR", one => one.error.psnr === null ? "∞" : `${figure(one.error.psnr)} dB`),
                  line("Time", one => `${figure(1000 * Object.values(one.seconds).reduce((a, b) => a + b, 0))} ms`))));
        } catch (error) {
            this.measures.replaceChildren(h("p.note", {}, error.message));
        } finally {
            button.disabled = false;
        }
    }

    show() {
        const { accuracy } = this.store.scene, isBudget = accuracy?.maxError !== undefined;
        this.tier.show(isBudget ? "budget" : accuracy?.tier ?? "standard");
        if (isBudget !== this.#isBudget) {
            this.#form = new Form(this.schema, this.store, {});
            const budget = this.schema.variants("Accuracy").find(one => one.properties.maxError);
            this.budget.replaceChildren(...(isBudget ? this.#form.members(budget, "/accuracy") : []));
        }
        this.#isBudget = isBudget;
        this.#form?.show();
        if (this.measures.firstChild) this.measures.replaceChildren();
        this.heat?.clear();
    }
}
