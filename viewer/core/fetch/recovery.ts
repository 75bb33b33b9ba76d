/** When is tried again what failed for a reason that passes? By itself, after pauses that grow (`pauses.ts`). */
import { type Answer, Pauses } from "./pauses.ts";

/** It is calm after more than a download may take which fails because nothing comes, with all that is tried for it. */
const LENGTHS = { first_ms: 5000, longest_ms: 60_000, calm_ms: 300_000 };

export class Recovery {
  private readonly pauses: Pauses;
  private isDue = false;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `again` tries all of it again. */
  constructor(
    private readonly again: () => void,
    random: () => number = Math.random,
  ) {
    this.pauses = new Pauses(LENGTHS, random);
  }

  /** Something was lost; what the server answered may say when to ask again. */
  lost(answer?: Answer): void {
    if (this.isDue) return;
    this.isDue = true;
    const now_ms = performance.now();
    this.timer = setTimeout(() => this.now(), this.pauses.after(now_ms, answer) - now_ms);
  }

  /** Tries at once. */
  now(): void {
    clearTimeout(this.timer);
    this.isDue = false;
    this.again();
  }

  close(): void {
    clearTimeout(this.timer);
    this.isDue = true;
  }
}
