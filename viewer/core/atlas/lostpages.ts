/** Which parts of the map of cells cannot be had? Each is asked for once, until one tries again. */
import { reasonOf } from "../basics/reason.ts";
import type { PageEntry } from "../documents/documents.ts";
import { forgive, type Retried } from "../fetch/losses.ts";
import { FetchError } from "../fetch/transfer.ts";

/** Something of the map of cells cannot be had, so that one may be elsewhere than it seems, and walk through walls there. */
export class IncompleteMapError extends Error {
  override readonly name = "IncompleteMapError";
}

export class LostPages {
  private readonly lost = new Map<string, { readonly entry: PageEntry; readonly error: IncompleteMapError }>();

  /** `told` hears of the first. */
  constructor(private readonly told: (error: IncompleteMapError) => void) {}

  /** Whether there are some. */
  get some(): boolean {
    return this.lost.size > 0;
  }

  /** Whether one of them should say something of a cell. */
  holds(cell: number): boolean {
    return [...this.lost.values()].some(({ entry: { first, count } }) => first <= cell && cell - first < count);
  }

  errorOf({ url }: PageEntry): IncompleteMapError {
    return this.lost.get(url)?.error ?? new IncompleteMapError(`${url} was not read`);
  }

  get notes(): string[] {
    return [...this.lost.values()].map(({ error }) => error.message);
  }

  forgive(retried: Retried): void {
    forgive(this.lost, retried);
  }

  /** What `read` brings for an entry; `undefined` when that cannot be had. */
  async unless<T>(entry: PageEntry, read: () => Promise<T>): Promise<T | undefined> {
    if (this.lost.has(entry.url)) return undefined;
    try {
      return await read();
    } catch (error) {
      if (error instanceof FetchError && error.isCancelled) throw error;
      this.lose(entry, error);
      return undefined;
    }
  }

  private lose(entry: PageEntry, cause: unknown): void {
    const isFirst = !this.some;
    const error = new IncompleteMapError(`the map of cells is incomplete: ${reasonOf(cause)}`, { cause });
    this.lost.set(entry.url, { entry, error });
    if (isFirst) this.told(error);
  }
}
