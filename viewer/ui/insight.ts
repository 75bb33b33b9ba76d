/**
 * Who is in sight, in words? For who listens to the page: said once it has stayed the same for a while, so that nobody is told of people
 * who come and go.
 */
import type { Announcer } from "./announcer.ts";
import { writePeople } from "./format.ts";

/** So often one looks, and nobody came into sight or went out of it for so long. */
const [LOOK_EVERY_MS, SETTLED_MS] = [200, 2000];

export class InSight {
  /** Nobody needs to be told of that to begin with. */
  private told = writePeople([]);
  private people = this.told;
  private since_ms = 0;
  private again_ms = 0;

  constructor(private readonly announcer: Pick<Announcer, "say">) {}

  /** Takes in who is in sight now, by their names; empty ones of who has none. */
  update(now_ms: number, names: () => readonly string[]): void {
    if (now_ms < this.again_ms) return;
    this.again_ms = now_ms + LOOK_EVERY_MS;
    const people = writePeople(names());
    if (people !== this.people) [this.people, this.since_ms] = [people, now_ms];
    if (people === this.told || now_ms - this.since_ms < SETTLED_MS) return;
    this.told = people;
    this.announcer.say("people", people);
  }
}
