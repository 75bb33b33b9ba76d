/** Do people come, walk, listen and leave? One step is one visit, which ends in one of the ways in which visits do. */
import net from "node:net";
import { Ear } from "./ear.mjs";
import { insist, pick, sleep } from "./tally.mjs";

const POSE_MS = 250;

export class Living {
  constructor(wire, scene, bounds, lease_s) {
    this.wire = wire;
    this.scene = `/v1/scenes/${scene}`;
    this.bounds = bounds;
    this.lease_s = lease_s;
  }

  /** Somewhere inside. */
  place() {
    const { min, max } = this.bounds;
    const [x, z] = [0, 2].map((i) => min[i] + (0.1 + 0.8 * Math.random()) * (max[i] - min[i]));
    return [x, 1.6, z];
  }

  async enter() {
    const body = { position: this.place(), max_speed_mps: 3, include: pick([["movers"], ["movers", "static"]]) };
    const me = await this.wire.json("session", `${this.scene}/sessions`, { method: "POST", body, want: [201] });
    return { ...me, at: body.position, t_ms: 0, path: `/v1/sessions/${me.session}` };
  }

  own(me, kind, method, path, body, want) {
    const headers = { Authorization: `Bearer ${me.token}` };
    return this.wire.json(kind, `${me.path}${path}`, { method, headers, body, want });
  }

  async walk(me, soak, seconds) {
    for (let left = (seconds * 1000) / POSE_MS; left > 0 && !soak.over; left -= 1) {
      me.t_ms += POSE_MS;
      const { min, max } = this.bounds;
      me.at = me.at.map((x, i) => (i === 1 ? x : Math.min(max[i], Math.max(min[i], x + Math.random() - 0.5))));
      await this.own(me, "pose", "PUT", "/pose", { t_ms: me.t_ms, position: me.at });
      await sleep(POSE_MS);
    }
  }

  async visit(soak) {
    await pick([
      ...Array(4).fill(() => this.stay(soak)),
      ...Array(3).fill(() => this.comeBack(soak)),
      () => this.stall(soak),
      () => this.lapse(soak),
    ])();
  }

  /** Listens, walks, and closes the session; then the stream ends. */
  async stay(soak) {
    const me = await this.enter();
    const ear = new Ear(this.wire, me.events_url, me.token);
    ear.listen();
    await this.walk(me, soak, 5 + 20 * Math.random());
    await this.own(me, "area", "PUT", "/aoi", { enter_m: 20, leave_m: 25 });
    await this.own(me, "quality", "PUT", "/quality", { quality: Math.random() }, [204]);
    await this.walk(me, soak, 5);
    insist(ear.streaming, "the stream ended before its session");
    await this.close(me);
    await until(() => !ear.streaming, "the stream goes on after its session");
    ear.settle();
    insist(ear.greeted, "nobody said hello");
  }

  async close(me) {
    await this.own(me, "close", "DELETE", "", undefined, [204]);
    await this.own(me, "closed", "PUT", "/pose", { position: me.at }, [404]);
  }

  /** Loses the line again and again, and goes on where it was. */
  async comeBack(soak) {
    const me = await this.enter();
    const ear = new Ear(this.wire, me.events_url, me.token);
    for (let turn = 0; turn < 4 && !soak.over; turn += 1) {
      ear.listen();
      await this.walk(me, soak, 4);
      insist(ear.streaming, "the stream ended before its session");
      ear.drop();
      await this.walk(me, soak, 2 * Math.random());
    }
    ear.settle();
    await this.close(me);
  }

  /** Asks for the events and never reads them. */
  async stall(soak) {
    const me = await this.enter();
    const { hostname, port } = new URL(this.wire.base);
    const socket = net.connect(Number(port), hostname);
    socket.on("error", () => {});
    socket.pause();
    socket.write(`GET ${me.events_url}?token=${me.token} HTTP/1.1\r\nHost: ${hostname}\r\n\r\n`);
    this.wire.tally.asked("stream, never read");
    try {
      await this.walk(me, soak, 60);
    } finally {
      socket.destroy();
    }
    await this.close(me);
  }

  /** Falls silent; the session ends with its lease. */
  async lapse(soak) {
    const me = await this.enter();
    await this.walk(me, soak, 5);
    if (soak.over) return;
    await sleep(1000 * (2 * this.lease_s + 5));
    await this.own(me, "lapsed", "PUT", "/pose", { position: me.at }, [404]);
  }
}

/** Waits for what comes at once; a minute is as good as never. */
export async function until(so, words) {
  const due = Date.now() + 60_000;
  while (!(await so())) {
    insist(Date.now() < due, words);
    await sleep(50);
  }
}
