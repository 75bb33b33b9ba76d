/**
 * When is tried again what failed for a reason that passes? After a pause that grows from time to time, so that nobody hammers a server
 * that is down; and differs from visitor to visitor, so that they do not all come back at once.
 */

const [FIRST_PAUSE_MS, LONGEST_PAUSE_MS] = [5000, 60_000];
/** Pauses are longer or shorter by up to this share. */
const JITTER = 0.2;

export class Recovery {
  private tries = 0;
  private isDue = false;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `again` tries all of it again. */
  constructor(
    private readonly again: () => void,
    private readonly random: () => number = Math.random,
  ) {}

  /** Something was lost. */
  lost(): void {
    if (this.isDue) return;
    this.isDue = true;
    const pause_ms = Math.min(LONGEST_PAUSE_MS, FIRST_PAUSE_MS * 2 ** this.tries);
    this.tries += 1;
    this.wait(() => this.now(), pause_ms * (1 + JITTER * (2 * this.random() - 1)));
  }

  /** Tries at once. When nothing is lost after that for long enough, the next pause is the first again. */
  now(): void {
    this.isDue = false;
    this.wait(() => {
      this.tries = 0;
    }, LONGEST_PAUSE_MS);
    this.again();
  }

  close(): void {
    clearTimeout(this.timer);
    this.isDue = true;
  }

  private wait(then: () => void, ms: number): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(then, ms);
  }
}
