/** When is work done that many things ask for, one after the other? At once for the first, and then once for all that follow within a while. */
export class Pacer {
  private asked = false;
  private pause: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly work: () => void,
    private readonly pause_ms: number,
  ) {}

  /** Whether it was asked for since it was done. */
  get isAsked(): boolean {
    return this.asked;
  }

  /** Asks for it. */
  ask(): void {
    if (this.pause !== undefined) {
      this.asked = true;
      return;
    }
    this.pause = setTimeout(() => {
      this.pause = undefined;
      if (this.asked) this.ask();
    }, this.pause_ms);
    this.now();
  }

  /** Does it now. */
  now(): void {
    this.asked = false;
    this.work();
  }

  /** Does it no more. */
  close(): void {
    clearTimeout(this.pause);
    this.asked = false;
  }
}
