/** How is one request sent, counted and held against what it should be answered with? */
import http from "node:http";
import { insist } from "./tally.mjs";

/** Far longer than any answer takes, so that one that never comes is an error and not the end of the load. */
export const PATIENCE_MS = 60_000;

export class Wire {
  #agent = new http.Agent({ keepAlive: true });

  constructor(base, tally) {
    this.base = base;
    this.tally = tally;
  }

  /** The answer, whose status is one of `want`. */
  async ask(kind, path, { method = "GET", headers = {}, body, want = [200], alone = false } = {}) {
    const answer = await this.#send(path, { method, headers, body, alone });
    this.tally.asked(kind);
    const { status } = answer;
    insist(want.includes(status), `${method} ${path.slice(0, 90)}: ${status}, wanted ${want} ${problemOf(answer)}`);
    return answer;
  }

  /** The same with JSON both ways. */
  async json(kind, path, { body, headers, ...rest } = {}) {
    const said = body === undefined ? {} : { "Content-Type": "application/json" };
    const sent = body === undefined ? undefined : JSON.stringify(body);
    const answer = await this.ask(kind, path, { headers: { ...said, ...headers }, body: sent, ...rest });
    return answer.body.length > 0 ? JSON.parse(answer.body) : null;
  }

  /** An answer without end: calls `heard` with each piece, `ended` once; returns what ends it. */
  stream(path, headers, { begun, heard, ended }) {
    const request = http.request(`${this.base}${path}`, { agent: this.#agent, headers });
    request.on("response", (response) => {
      begun(response.statusCode);
      response.setEncoding("utf8");
      response.on("data", heard);
      response.on("close", ended);
    });
    request.on("error", ended);
    request.end();
    return () => request.destroy();
  }

  #send(path, { method, headers, body, alone }) {
    return new Promise((resolve, reject) => {
      const length = body === undefined ? {} : { "Content-Length": Buffer.byteLength(body) };
      const request = http.request(
        `${this.base}${path}`,
        { method, agent: alone ? false : this.#agent, headers: { ...headers, ...length }, timeout: PATIENCE_MS },
        (response) => {
          const pieces = [];
          response.on("data", (piece) => pieces.push(piece));
          response.on("error", reject);
          response.on("end", () =>
            resolve({ status: response.statusCode, headers: response.headers, body: Buffer.concat(pieces) }),
          );
        },
      );
      request.on("timeout", () => request.destroy(new Error(`${method} ${path.slice(0, 90)}: no answer`)));
      request.on("error", reject);
      request.end(body);
    });
  }
}

function problemOf({ headers, body }) {
  return headers["content-type"] === "application/problem+json" ? body.toString().slice(0, 200) : "";
}
