/**
 * What is held? For each model at most one level of detail at a time, its bytes in memory and when it was last needed.
 *
 * Guarantees: a held level goes only when a finer one has taken its place or when no visible object needs it; models
 * outside the visible set are kept while memory allows and go in the order in which they were last needed.
 */

export interface Held {
  readonly level: number;
  /** Memory of geometry and textures. */
  readonly bytes: number;
}

interface Resident extends Held {
  lastNeeded: number;
}

export class ResidencySet {
  private readonly residents = new Map<number, Resident>();
  private needed: ReadonlySet<number> = new Set();
  private uses = 0;
  private total = 0;

  constructor(readonly limit_bytes: number) {}

  get bytes(): number {
    return this.total;
  }

  get size(): number {
    return this.residents.size;
  }

  held(model: number): Held | undefined {
    return this.residents.get(model);
  }

  /** Whether what is visible alone fills the memory, so that nothing finer should be fetched. */
  get full(): boolean {
    return this.total >= this.limit_bytes;
  }

  /** Names the models that are visible now. */
  need(models: ReadonlySet<number>): void {
    this.needed = models;
    this.uses += 1;
    for (const model of models) {
      const resident = this.residents.get(model);
      if (resident) resident.lastNeeded = this.uses;
    }
  }

  /** Takes a level in. Refuses, answering `false`, one that is no finer than what is held. */
  hold(model: number, held: Held): boolean {
    const before = this.residents.get(model);
    if (before && before.level <= held.level) return false;
    this.total += held.bytes - (before?.bytes ?? 0);
    this.residents.set(model, { ...held, lastNeeded: this.uses });
    return true;
  }

  /** Drops models that are not needed, the longest unused first, until the limit is kept; answers which ones. */
  evict(): number[] {
    if (this.total <= this.limit_bytes) return [];
    const idle = [...this.residents]
      .filter(([model]) => !this.needed.has(model))
      .sort(([, a], [, b]) => a.lastNeeded - b.lastNeeded);
    const evicted: number[] = [];
    for (const [model, resident] of idle) {
      if (this.total <= this.limit_bytes) break;
      this.residents.delete(model);
      this.total -= resident.bytes;
      evicted.push(model);
    }
    return evicted;
  }

  /** Held models by level, for the inspector. */
  levels(): Record<string, number> {
    const counts: Record<string, number> = {};
    for (const { level } of this.residents.values()) counts[level] = (counts[level] ?? 0) + 1;
    return counts;
  }
}
