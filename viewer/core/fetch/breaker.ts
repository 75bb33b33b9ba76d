/**
 * Is the server worth asking? A circuit breaker (Nygard, *Release It!*, 2007): when two downloads were given up and nothing was
 * answered meanwhile, it does not answer; one alone may be a file that fails, for which nobody else need wait. Then all others wait,
 * but for one at a time that tries whether there is an answer again: when one is let, and for what one needs to know where one has
 * gone. The first answer lets all of them go.
 */
export interface BreakerEvents {
  /** A download was given up that may come later. */
  readonly lost: () => void;
  /** The server answers after it was silent, or has what it could not bring before. */
  readonly answered: (wasSilent: boolean) => void;
}

export class Breaker {
  private answers = 0;
  private silent = false;
  private mayProbe = false;
  private probe: string | undefined;
  /** What was given up since the last answer. */
  private readonly unanswered = new Set<string>();
  /** How often each URL was given up. */
  private readonly misses = new Map<string, number>();

  constructor(private readonly events: BreakerEvents) {}

  /** Whether the server does not answer. */
  get isOpen(): boolean {
    return this.silent;
  }

  /** To be remembered when a download begins, for {@link lost}. */
  get mark(): number {
    return this.answers;
  }

  /** Lets one more download try, where the server does not answer. */
  allow(): void {
    this.mayProbe = this.silent;
  }

  /**
   * The one of these, the most urgent first, that may try: what was given up least often, so that no single file stands in the way
   * of all. What is new and `pressing` need not be let.
   */
  choose<T extends { readonly url: string }>(inLine: readonly T[], pressing: (one: T) => boolean): T | undefined {
    if (this.probe !== undefined) return undefined;
    const missesOf = ({ url }: T) => this.misses.get(url) ?? 0;
    const fresh = inLine.find((one) => missesOf(one) === 0 && pressing(one));
    const [allowed] = this.mayProbe ? [...inLine].sort((a, b) => missesOf(a) - missesOf(b)) : [];
    const chosen = fresh ?? allowed;
    if (chosen) {
      this.mayProbe = false;
      this.probe = chosen.url;
    }
    return chosen;
  }

  /** Nobody wants a file any more; if it was the one that tried, another one may. */
  cancelled(url: string): void {
    if (url !== this.probe) return;
    this.probe = undefined;
    this.mayProbe = true;
  }

  /** A download that began at a mark was given up. */
  lost(url: string, mark: number): void {
    this.misses.set(url, (this.misses.get(url) ?? 0) + 1);
    if (url === this.probe) this.probe = undefined;
    if (mark === this.answers) this.unanswered.add(url);
    if (this.unanswered.size > 1) this.silent = true;
    this.events.lost();
  }

  /** It answers, and yet a download was given up that may come later, since what comes of it is cut or damaged. */
  broke(url: string): void {
    const wasSilent = this.hears();
    this.misses.set(url, (this.misses.get(url) ?? 0) + 1);
    if (wasSilent) this.events.answered(wasSilent);
    this.events.lost();
  }

  answered(url: string): void {
    const silent = this.hears();
    if (this.misses.delete(url) || silent) this.events.answered(silent);
  }

  /** There is an answer; tells whether there was none before. */
  private hears(): boolean {
    const { silent } = this;
    this.answers += 1;
    this.unanswered.clear();
    this.silent = false;
    this.mayProbe = false;
    this.probe = undefined;
    return silent;
  }
}
