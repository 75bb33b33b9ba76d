/**
 * Can others be met here? Asks the server once it is there, and again after pauses where it does not answer; a static tree says that it has no
 * live sessions, and is not asked again.
 */
import { Pauses } from "../fetch/pauses.ts";
import type { Clock } from "./hearing.ts";
import { NoAnswer, type Participant, type Session } from "./session.ts";

const LENGTHS = { first_ms: 5000, longest_ms: 120_000 };

/** Whether others are met, might be once the server answers, or never are. */
export type Meeting = "met" | "away" | "never";

export class Joining {
  private offered: Session | "never" | undefined;
  private isAsking = false;
  private again_ms = -Infinity;
  private readonly pauses: Pauses;
  /** Tells one visit to the page from the next. */
  private visit = 0;

  /** `ask` answers a session, or none where there are none, and fails where nobody can say. */
  constructor(
    private readonly ask: () => Promise<Session | undefined>,
    private readonly clock: Pick<Clock, "now_ms" | "random">,
  ) {
    this.pauses = new Pauses(LENGTHS, clock.random);
  }

  /** The session, also while it is not open. */
  get session(): Session | undefined {
    return this.offered === "never" ? undefined : this.offered;
  }

  get meeting(): Meeting {
    if (this.offered === "never") return "never";
    return this.offered?.isHeard ? "met" : "away";
  }

  /** Says where one is, or asks whether others can be met; call it in every frame. */
  update(self: Participant): void {
    if (this.offered) this.session?.update(self);
    else if (!this.isAsking && this.clock.now_ms() >= this.again_ms) void this.askNow();
  }

  /** Leaves. */
  leave(): void {
    this.session?.close();
  }

  /** Comes again, after having left. */
  comeAgain(): void {
    this.visit += 1;
    this.offered = undefined;
    this.isAsking = false;
    this.again_ms = -Infinity;
  }

  private async askNow(): Promise<void> {
    const { visit } = this;
    this.isAsking = true;
    let refused: NoAnswer | undefined;
    const session = await this.ask().then(
      (one) => one ?? ("never" as const),
      (error: unknown) => {
        if (error instanceof NoAnswer) refused = error;
        return undefined;
      },
    );
    if (visit !== this.visit) return;
    this.isAsking = false;
    this.offered = session;
    if (!session) this.again_ms = this.pauses.after(this.clock.now_ms(), refused);
  }
}
