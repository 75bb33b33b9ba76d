/** Do programs move things, and doors open? Movers come, are moved many at once, and go; a door is opened and closed. */
import { insist, sleep } from "./tally.mjs";

const MOVERS = 200;
const RENEWED = 10;

export class Moving {
  movers = [];
  t_ms = 0;

  constructor(living) {
    this.living = living;
    this.wire = living.wire;
    this.scene = living.scene;
  }

  async create() {
    const position = this.living.place();
    const persistent = Math.random() < 0.1;
    const trajectory = { keys: [0, 4000].map((t_ms) => ({ t_ms, position: this.living.place() })), repeat: true };
    const guided = Math.random() < 0.1;
    const body = guided ? { trajectory } : { position, max_speed_mps: 5, persistent, t_ms: this.t_ms };
    const made = await this.wire.json("mover", `${this.scene}/movers`, { method: "POST", body, want: [201] });
    this.movers.push({ ...made, position, guided });
  }

  async destroy({ object, token }) {
    const headers = { Authorization: `Bearer ${token}` };
    await this.wire.ask("mover, gone", `/v1/movers/${object}`, { method: "DELETE", headers, want: [204] });
  }

  /** A second: five batches, then some movers give way to others. */
  async step() {
    while (this.movers.length < MOVERS) await this.create();
    for (let batch = 0; batch < 5; batch += 1) {
      await this.move();
      await sleep(200);
    }
    for (const mover of this.movers.splice(0, RENEWED)) await this.destroy(mover);
  }

  async move() {
    this.t_ms += 200;
    const { min, max } = this.living.bounds;
    const lines = this.movers
      .filter(({ guided }) => !guided)
      .map((mover) => {
        const near = (x, i) => (i === 1 ? x : Math.min(max[i], Math.max(min[i], x + Math.random() - 0.5)));
        mover.position = mover.position.map(near);
        const { object, token, position } = mover;
        return JSON.stringify({ object, token, position, t_ms: this.t_ms });
      });
    const { body } = await this.wire.ask("poses of movers", `${this.scene}/movers/poses`, {
      method: "POST",
      headers: { "Content-Type": "application/x-ndjson" },
      body: lines.join("\n"),
    });
    const { accepted, refused } = JSON.parse(body);
    insist(accepted === lines.length, `${accepted} of ${lines.length} poses, ${JSON.stringify(refused[0])}`);
  }
}

export class Door {
  constructor(living, object) {
    this.living = living;
    this.path = `${living.scene}/doors/${object}`;
  }

  async step(soak) {
    const me = await this.living.enter();
    const headers = { Authorization: `Bearer ${me.token}` };
    const { wire } = this.living;
    for (const open of [false, true, false, true]) {
      await wire.json("door", this.path, { method: "PUT", headers, body: { open } });
      const stands = await wire.json("door", this.path);
      insist(stands.open === open, `the door is ${stands.open ? "open" : "closed"}`);
      await this.living.walk(me, soak, 1);
    }
    await this.living.close(me);
  }
}
