/**
 * Which downloads has the server begun to be silent about? Whoever waits is told from the first time that nothing came for long, and not only
 * when all tries are over; and that this has ended.
 */

export interface Silence {
  readonly url: string;
  /** The try that has brought nothing … */
  readonly attempt: number;
  /** … of so many … */
  readonly attempts: number;
  /** … within this time. */
  readonly waited_ms: number;
}

export class Silences {
  private readonly silent = new Set<string>();

  /** `told` hears of each try that brought nothing while there is another one, and of `undefined` when nothing is silent any more. */
  constructor(private readonly told: (silence: Silence | undefined) => void) {}

  /** A try was given up, and there is another one. */
  stalled(silence: Silence): void {
    this.silent.add(silence.url);
    this.told(silence);
  }

  /** Something came of it, or nobody waits for it any more. */
  over(url: string): void {
    if (this.silent.delete(url) && this.silent.size === 0) this.told(undefined);
  }
}
