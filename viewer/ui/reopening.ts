/**
 * What becomes of a scene that cannot be opened just now? It is tried again: after pauses that grow, and at once when somebody asks for that.
 * What does not pass by itself ends it.
 */
import { answerOf, passes } from "../core/fetch/losses.ts";
import { Recovery } from "../core/fetch/recovery.ts";

export class Reopening<T> {
  /** What was opened; fails with what does not pass. Nobody hears of one that was closed. */
  readonly opened: Promise<T>;
  private readonly recovery = new Recovery(() => void this.try());
  private resolve: (opened: T) => void = () => {};
  private reject: (error: unknown) => void = () => {};
  private isTrying = false;
  private isOver = false;

  /** Begins to `open`; `failed` hears of what passes, and is tried again. */
  constructor(
    private readonly open: () => Promise<T>,
    private readonly failed: (error: unknown) => void,
  ) {
    this.opened = new Promise((resolve, reject) => {
      this.resolve = resolve;
      this.reject = reject;
    });
    this.opened.catch(() => {});
    void this.try();
  }

  /** Tries at once, unless it tries already; answers whether it can still be opened. */
  now(): boolean {
    if (!this.isOver && !this.isTrying) this.recovery.now();
    return !this.isOver;
  }

  close(): void {
    this.isOver = true;
    this.recovery.close();
  }

  private async try(): Promise<void> {
    this.isTrying = true;
    try {
      const opened = await this.open();
      if (this.isOver) return;
      this.close();
      this.resolve(opened);
    } catch (error) {
      if (this.isOver) return;
      if (passes(error)) {
        this.recovery.lost(answerOf(error));
        this.failed(error);
      } else {
        this.close();
        this.reject(error);
      }
    } finally {
      this.isTrying = false;
    }
  }
}
