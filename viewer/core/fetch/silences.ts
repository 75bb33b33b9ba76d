/**
 * Of which downloads does nothing come? Whoever waits is told a few seconds after they were asked for, and not only when a try, or all of
 * them, are over; and that this has ended.
 */
export interface Silence {
  readonly url: string;
  /** What is wrong with the try: nothing has come of it so far, it was given up for that, what came was cut or damaged, or the server asked to wait. */
  readonly how: "quiet" | "stalled" | "broken" | "backing off";
  /** Which it is … */
  readonly attempt: number;
  /** … of so many … */
  readonly attempts: number;
  /** … and how long nothing came, or how long one was asked to wait; zero of what broke. */
  readonly waited_ms: number;
}

export class Silences {
  private readonly silent = new Set<string>();

  /** `told` hears of each try of which nothing comes while it goes on or there is another one, and of `undefined` when nothing is silent any more. */
  constructor(private readonly told: (silence: Silence | undefined) => void) {}

  /** Whether something is silent. */
  get any(): boolean {
    return this.silent.size > 0;
  }

  /** Nothing comes of a try, and it goes on or there is another one. */
  begins(silence: Silence): void {
    this.silent.add(silence.url);
    this.told(silence);
  }

  /** Something came of it, or nobody waits for it any more. */
  over(url: string): void {
    if (this.silent.delete(url) && this.silent.size === 0) this.told(undefined);
  }
}
