/** Is what is published served rightly in every way in which it can be asked for? One step asks in one of them. */
import http2 from "node:http2";
import { check, crawl } from "./objects.mjs";
import { insist, pick, sleep } from "./tally.mjs";
import { PATIENCE_MS } from "./wire.mjs";

const ENCODINGS = ["gzip", "zstd", "gzip, deflate, br, zstd", "zstd;q=0.5, gzip;q=0.8", "identity", "br"];

export class Reading {
  constructor(wire, scene, { pointer, objects }) {
    this.wire = wire;
    this.scene = `/v1/scenes/${scene}`;
    this.pointer = pointer;
    this.objects = objects;
    this.urls = [...objects.keys()];
    this.ways = [
      ...Array(6).fill(() => this.whole()),
      ...Array(4).fill(() => this.range()),
      ...Array(3).fill(() => this.unchanged()),
      ...Array(3).fill(() => this.bundle()),
      ...[this.ranges, this.beyond, this.head, this.query, this.visible, this.plain].map((way) => way.bind(this)),
      ...[this.mistaken, this.page, this.alone].map((way) => way.bind(this)),
    ];
  }

  static async of(wire, scene) {
    return new Reading(wire, scene, await crawl(wire, scene));
  }

  async step() {
    await pick(this.ways)();
    await sleep(5);
  }

  place() {
    const { min, max } = this.pointer.bounds;
    return min.map((low, i) => low + (0.1 + 0.8 * Math.random()) * (max[i] - low));
  }

  async whole() {
    const url = pick(this.urls);
    check(url, await this.wire.ask("object, negotiated", url, { headers: { "Accept-Encoding": pick(ENCODINGS) } }));
  }

  async unchanged() {
    const [url, accept] = [pick(this.urls), { "Accept-Encoding": pick(ENCODINGS) }];
    const { headers } = await this.wire.ask("HEAD", url, { method: "HEAD", headers: accept });
    const asked = { ...accept, "If-None-Match": `"x", W/${headers.etag}` };
    const { body } = await this.wire.ask("not modified", url, { headers: asked, want: [304] });
    insist(body.length === 0, `${url}: 304 with a body`);
  }

  slice(bytes) {
    const from = Math.floor(Math.random() * bytes.length);
    return [from, from + 1 + Math.floor(Math.random() * Math.min(65_536, bytes.length - from))];
  }

  async range() {
    const url = pick(this.urls);
    const bytes = this.objects.get(url);
    const [from, to] = this.slice(bytes);
    const headers = { Range: `bytes=${from}-${to - 1}` };
    const { body } = await this.wire.ask("range", url, { headers, want: [206] });
    insist(body.equals(bytes.subarray(from, to)), `${url}: other bytes in ${from} to ${to}`);
  }

  async ranges() {
    const url = pick(this.urls);
    const bytes = this.objects.get(url);
    const middle = bytes.length >> 1;
    if (middle < 8) return;
    const headers = { Range: `bytes=0-3,${middle}-${middle + 3}` };
    const answer = await this.wire.ask("several ranges", url, { headers, want: [206] });
    for (const part of [bytes.subarray(0, 4), bytes.subarray(middle, middle + 4)]) {
      insist(answer.body.includes(part), `${url}: a range is missing`);
    }
  }

  async beyond() {
    const url = pick(this.urls);
    const { length } = this.objects.get(url);
    const headers = { Range: `bytes=${length}-` };
    const answer = await this.wire.ask("beyond the end", url, { headers, want: [416] });
    insist(answer.headers["content-range"] === `bytes */${length}`, `${url}: ${answer.headers["content-range"]}`);
  }

  async head() {
    const url = pick(this.urls);
    const { headers } = await this.wire.ask("HEAD", url, { method: "HEAD" });
    insist(Number(headers["content-length"]) === this.objects.get(url).length, `${url}: another length by HEAD`);
  }

  async bundle() {
    const members = Array.from({ length: 1 + Math.floor(Math.random() * 16) }, () => {
      const url = pick(this.urls);
      const [from, to] = this.slice(this.objects.get(url));
      return Math.random() < 0.5 ? { url, from, to } : { url };
    });
    const names = members.map(({ url, from, to }) => url.slice(3) + (to === undefined ? "" : `@${from}-${to}`));
    const { body } = await this.wire.ask("bundle", `/o/bundle/${names.join("+")}`);
    insist(body.toString("latin1", 0, 4) === "BVBN" && body.readUInt16LE(6) === members.length, "a bundle's head");
    const table = 8 + 4 * members.length;
    let begin = table;
    for (const [i, { url, from, to }] of members.entries()) {
      const end = table + body.readUInt32LE(8 + 4 * i);
      const wanted = this.objects.get(url).subarray(from, to);
      insist(body.subarray(begin, end).equals(wanted), `${names[i]}: other bytes in a bundle`);
      begin = end;
    }
  }

  async query() {
    const at = this.place();
    const { cell } = await this.wire.json("query", `${this.scene}/cells?at=${at}`);
    const record = await this.wire.json("query", `${this.scene}/cells/${cell}`);
    insist(record.cell === cell, `${cell} is told to be ${record.cell}`);
    await this.wire.json("query", `${this.scene}/cells/${cell}/visible?limit=20`);
    const box = [...at.map((x) => x - 2), ...at.map((x) => x + 2)];
    await this.wire.json("query", `${this.scene}/objects?bbox=${box}&limit=20`);
  }

  async visible() {
    const body = { position: this.place(), radius_m: 0.3, limit: 100 };
    const seen = await this.wire.json("POST visible", `${this.scene}/visible`, { method: "POST", body });
    insist(seen.revision === this.pointer.revision, `visible of ${seen.revision}`);
    insist(seen.objects.length === Math.min(100, seen.total), `${seen.objects.length} of ${seen.total} objects`);
  }

  async plain() {
    const { body } = await this.wire.ask("plain level", `${this.scene}/objects/o0/lods/0?form=plain`);
    insist(body.toString("latin1", 0, 4) === "glTF", "a plain level is no GLB");
  }

  async page() {
    const { headers } = await this.wire.ask("pointer", this.scene);
    await this.wire.ask("pointer", this.scene, { headers: { "If-None-Match": headers.etag }, want: [304] });
    await this.wire.ask("viewer", "/");
    await this.wire.ask("healthz", "/healthz");
  }

  /** What is wrong is told so, as a problem. */
  async mistaken() {
    const [path, want, method] = pick([
      [`/o/${"0".repeat(64)}.glb`, 404],
      ["/o/nothing", 404],
      ["/v1/scenes/nowhere", 404],
      [`${this.scene}/cells?at=1,2`, 400],
      [`${this.scene}/objects/o99999999`, 404],
      [`${this.scene}/visible`, 400, "POST"],
      [this.scene, 405, "DELETE"],
      [this.scene, 401, "PUT"],
      ["/v1/sessions/s999999999/pose", 404, "PUT"],
    ]);
    const { headers } = await this.wire.ask("mistake", path, { method, want: [want], body: method && "{}" });
    insist(headers["content-type"] === "application/problem+json", `${path}: ${headers["content-type"]}`);
  }

  /** On a connection of its own, which ends with it. */
  async alone() {
    const url = pick(this.urls);
    check(url, await this.wire.ask("object, then close", url, { alone: true }));
  }

  /** A connection of HTTP/2 with some objects at once. */
  async second() {
    const session = http2.connect(this.wire.base);
    try {
      await new Promise((connected, failed) => session.once("connect", connected).once("error", failed));
      for (let turn = 0; turn < 20; turn += 1) {
        await Promise.all(Array.from({ length: 4 }, () => this.#overSecond(session, pick(this.urls))));
        await sleep(20);
      }
    } finally {
      session.close();
    }
  }

  async #overSecond(session, url) {
    const stream = session.request({ ":path": url, "accept-encoding": pick(ENCODINGS) });
    const pieces = [];
    stream.setTimeout(PATIENCE_MS, () => stream.destroy(new Error(`${url} over HTTP/2: no answer`)));
    const headers = await new Promise((resolve, reject) => {
      let head;
      stream.on("response", (heard) => {
        head = heard;
      });
      stream.on("data", (piece) => pieces.push(piece));
      stream.on("end", () => resolve(head));
      stream.on("error", reject);
    });
    this.wire.tally.asked("object, HTTP/2");
    insist(headers[":status"] === 200, `${url} over HTTP/2: ${headers[":status"]}`);
    check(url, { headers, body: Buffer.concat(pieces) });
  }
}
