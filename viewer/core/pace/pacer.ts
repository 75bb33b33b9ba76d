/**
 * When is work done that many things ask for, one after the other? At once for the first, and then once for all that follow within a
 * while, which is the longer the longer the work takes.
 */

/** So many times as long as the work takes, nothing is done for who only asks. */
const REST = 9;

export class Pacer {
  private asked = false;
  private isResting = false;
  private pause: ReturnType<typeof setTimeout> | undefined;
  private took_ms = 0;

  constructor(
    private readonly work: () => void,
    private readonly pause_ms: number,
    private readonly now_ms: () => number = () => performance.now(),
  ) {}

  /** Whether it was asked for since it was done. */
  get isAsked(): boolean {
    return this.asked;
  }

  /** Asks for it. */
  ask(): void {
    if (this.isResting) {
      this.asked = true;
      return;
    }
    this.isResting = true;
    try {
      this.now();
    } finally {
      this.pause = setTimeout(() => this.rested(), Math.max(this.pause_ms, REST * this.took_ms));
    }
  }

  /** Does it now. */
  now(): void {
    this.asked = false;
    const start_ms = this.now_ms();
    this.work();
    this.took_ms = this.now_ms() - start_ms;
  }

  /** Does it no more. */
  close(): void {
    clearTimeout(this.pause);
    this.asked = false;
  }

  private rested(): void {
    this.isResting = false;
    if (this.asked) this.ask();
  }
}
