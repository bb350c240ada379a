// The built daemon on a free port of the loopback, and requests to it.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import http from "node:http";
import net from "node:net";
import { createInterface } from "node:readline";

// Limits that keep pictures small; scenes meet them now and then.
const LIMITS = ["--max-pixels", "4096", "--max-samples", "16384", "--max-triangles", "60000",
                "--max-body", "1000000"];

// No request runs into a deadline because the machine is slow.
const PATIENT = { SHADED_TIMEOUT: "600", SHADED_BODY_TIME: "600", SHADED_SEND_TIME: "600" };

export class Daemon {
    static async start(...flags) {
        const daemon = new Daemon();
        const clean = Object.entries(process.env).filter(([name]) => !name.startsWith("SHADED_"));
        daemon.process = spawn(`${process.env.SHADED_BUILD}/shaded`,
                               ["--listen", "127.0.0.1:0", "--admin", "off", "--log-requests", "off",
                                ...LIMITS, ...flags],
                               { stdio: ["ignore", "ignore", "pipe"], env: { ...Object.fromEntries(clean), ...PATIENT } });
        daemon.ended = once(daemon.process, "exit");
        daemon.log = [];
        daemon.agent = new http.Agent({ keepAlive: true, maxSockets: 1 });
        const lines = createInterface({ input: daemon.process.stderr });
        const listening = new Promise((resolve, reject) => {
            lines.on("line", line => {
                daemon.log.push(line);
                if (line.includes('"event":"listening"')) resolve(JSON.parse(line).address);
            });
            lines.on("close", () => reject(new Error("it does not start:\n" + daemon.log.join("\n"))));
        });
        daemon.port = Number((await listening).split(":")[1]);
        return daemon;
    }

    // {status, headers: Map of lower-case names to lists of values, body: Buffer}
    async ask({ method, path, headers = {}, body }) {
        // Node sends bodies of OPTIONS and DELETE without a length, unless it is told one.
        const length = body === undefined ? {} : { "Content-Length": Buffer.byteLength(body) };
        const request = http.request({ host: "127.0.0.1", port: this.port, agent: this.agent,
                                       method, path, headers: { ...headers, ...length } });
        request.end(body);
        const [answer] = await once(request, "response");
        const pieces = [];
        for await (const piece of answer) pieces.push(piece);
        const fields = new Map();
        for (let i = 0; i < answer.rawHeaders.length; i += 2) {
            const name = answer.rawHeaders[i].toLowerCase();
            fields.set(name, [...(fields.get(name) ?? []), answer.rawHeaders[i + 1]]);
        }
        return { status: answer.statusCode, headers: fields, body: Buffer.concat(pieces) };
    }

    post(path, scene, headers = {}) {
        const body = typeof scene === "string" ? scene : JSON.stringify(scene);
        return this.ask({ method: "POST", path, body,
                          headers: { "Content-Type": "application/json", ...headers } });
    }

    // Sends bytes as they are; everything that comes back until the connection ends.
    async raw(bytes) {
        const socket = net.connect(this.port, "127.0.0.1");
        socket.end(bytes);
        const pieces = [];
        for await (const piece of socket) pieces.push(piece);
        return Buffer.concat(pieces);
    }

    async stop() {
        this.agent.destroy();
        this.process.kill("SIGTERM");
        const [status] = await this.ended;
        const log = this.log.join("\n");
        assert.equal(status, 0, log);
        assert.doesNotMatch(log, /Sanitizer|runtime error/);
    }
}
