/** Does an event stream tell what it may, in order? Reads one session's events, over as many streams as it takes. */
import { insist } from "./tally.mjs";

export class Ear {
  #last;
  #known = new Set();
  #rest = "";
  #drop = () => {};
  #wrong;
  streaming = false;
  greeted = false;

  constructor(wire, path, token) {
    this.wire = wire;
    this.path = path;
    this.token = token;
  }

  /** Begins to listen, or goes on where it was. */
  listen() {
    const resumes = this.#last === undefined ? {} : { "Last-Event-ID": String(this.#last) };
    this.wire.tally.asked(this.#last === undefined ? "stream" : "stream, resumed");
    this.#rest = "";
    this.streaming = true;
    // What an earlier stream still says, or that it ends, is no matter of this one.
    const mine = {};
    this.mine = mine;
    this.#drop = this.wire.stream(
      this.path,
      { Authorization: `Bearer ${this.token}`, ...resumes },
      {
        begun: (status) => this.#try(() => insist(status === 200, `events: ${status}`)),
        heard: (text) => this.mine === mine && this.#try(() => this.#hear(text)),
        ended: () => {
          if (this.mine === mine) this.streaming = false;
        },
      },
    );
  }

  /** Hangs up; what was told until then counts. */
  drop() {
    this.mine = undefined;
    this.streaming = false;
    this.#drop();
  }

  /** Fails when something that was told was wrong. */
  settle() {
    if (this.#wrong) throw this.#wrong;
  }

  #try(step) {
    try {
      step();
    } catch (error) {
      this.#wrong ??= error;
    }
  }

  #hear(text) {
    const blocks = (this.#rest + text).split("\n\n");
    this.#rest = blocks.pop();
    for (const block of blocks) {
      const fields = new Map(block.split("\n").map((line) => line.split(/: (.*)/s)));
      if (fields.has("event"))
        this.#take(Number(fields.get("id")), fields.get("event"), JSON.parse(fields.get("data")));
    }
  }

  #take(id, event, told) {
    this.wire.tally.asked(`event ${event}`);
    insist(this.#last === undefined || id > this.#last, `${event} ${id} after ${this.#last}`);
    this.#last = id;
    if (event === "hello") this.greeted = true;
    else insist(this.greeted || event === "resync", `${event} before hello`);
    if (event === "resync") this.#known.clear();
    if (event === "object-info") this.#known.add(told.object);
    if (event === "object-pos") {
      for (const { object } of told.objects) insist(this.#known.has(object), `a pose of ${object}, which is unknown`);
    }
  }
}
