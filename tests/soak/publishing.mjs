/** Can scenes be published, rolled back and cleared away, and keys made and revoked, while all that goes on? One step is a round. */
import { until } from "./living.mjs";
import { crawl } from "./objects.mjs";
import { insist, sleep } from "./tally.mjs";

const SCENE = "annex";
const HIDDEN = "vault";
const ROOM = 8;
/** So many drawings, one after the other, then the first again. */
const DRAWINGS = ROOM * ROOM;

export class Publishing {
  round = 0;

  constructor(wire, server) {
    this.wire = wire;
    this.server = server;
  }

  static async with(wire, server) {
    const publishing = new Publishing(wire, server);
    publishing.key = await publishing.newKey("publish", "rollback", "read");
    return publishing;
  }

  async newKey(...scopes) {
    const said = await this.server.ask("keys", "create", "--json", ...scopes.flatMap((scope) => ["--scope", scope]));
    const made = JSON.parse(said);
    return { id: made.id, headers: { Authorization: `Bearer ${made.key}` } };
  }

  async step() {
    const { round } = this;
    this.round += 1;
    await this.publish(SCENE, drawing(round));
    if (round % 2 === 1) await this.goBackAndForth();
    if (round % 3 === 2) await this.clear();
    if (round % 4 === 3) await this.changeKeys();
    if (round % 5 === 4) await this.hide(drawing(round + 1));
    await sleep(2000);
  }

  upload(scene, text, key, want, query = "?format=plan") {
    const path = `/v1/scenes/${scene}${query}`;
    return this.wire.ask("upload", path, { method: "PUT", headers: key.headers, body: text, want });
  }

  async publish(scene, text, query) {
    const job = JSON.parse((await this.upload(scene, text, this.key, [202], query)).body);
    // The stream ends when the job has.
    const { body } = await this.wire.ask("job, followed", job.events_url);
    const ended = await this.wire.json("job", job.url);
    insist(ended.state === "done", `a bake: ${ended.state} ${JSON.stringify(ended.error)}`);
    insist(body.includes("event: done"), "a job's stream does not tell its end");
    await this.stands(scene, ended.revision);
  }

  /** The revision is the current one, and all of it is there. */
  async stands(scene, revision) {
    const { headers } = this.key;
    const current = async () =>
      (await this.wire.json("pointer", `/v1/scenes/${scene}`, { headers, want: [200, 404] })).revision;
    await until(async () => (await current()) === revision, `${scene} does not come to ${revision}`);
    await crawl(this.wire, scene, { headers });
  }

  async goBackAndForth() {
    const go = (body) =>
      this.wire.json("rollback", `/v1/scenes/${SCENE}/rollback`, { method: "POST", headers: this.key.headers, body });
    const back = await go({});
    await this.stands(SCENE, back.revision);
    await go({ revision: back.from });
    await this.stands(SCENE, back.from);
  }

  async clear() {
    await this.server.ask("gc", "--keep", "2");
    this.wire.tally.asked("gc");
    await crawl(this.wire, SCENE, this.key);
  }

  /** A key that is revoked uploads nothing more, and an upload that is cancelled ends. */
  async changeKeys() {
    const key = await this.newKey("publish");
    const { job } = JSON.parse((await this.upload("draft", drawing(this.round), key, [202])).body);
    const { headers } = key;
    const { state } = await this.wire.json("job, cancelled", `/v1/jobs/${job}`, { method: "DELETE", headers });
    insist(["cancelled", "done"].includes(state), `a cancelled job: ${state}`);
    await this.server.ask("keys", "revoke", key.id);
    this.wire.tally.asked("key, revoked");
    await this.upload("draft", drawing(0), key, [401]);
  }

  /** What is private is there for a key and through a link, and for nobody else. */
  async hide(text) {
    await this.publish(HIDDEN, text, "?format=plan&private=true");
    const said = await this.server.ask("sign", HIDDEN, "--expires", "5m", "--at", this.wire.base, "--json");
    const link = new URL(JSON.parse(said).base).pathname.replace(/\/$/, "");
    await crawl(this.wire, HIDDEN, { link });
    await this.wire.ask("stranger", `/v1/scenes/${HIDDEN}`, { want: [404] });
  }
}

/** A room with a thing in it, in a place of its own. */
function drawing(number) {
  const place = number % DRAWINGS;
  const rows = Array.from({ length: ROOM }, (_, z) =>
    Array.from({ length: ROOM }, (_, x) => (z * ROOM + x === place ? "t" : ".")).join(""),
  );
  const wall = "#".repeat(ROOM + 7);
  const drawn = rows.map((row, z) => `#${row}${z === 4 ? "+" : "#"}....#`);
  return ["title: Annex", "tile: 0.5 m", "legend:", "  t = table", "plan:", wall, ...drawn, wall, ""].join("\n");
}
