/**
 * Who waits for a part of a file that is still on its way? Each is given its part as soon as that has come and is what its
 * own name promises, whatever becomes of the rest.
 */
import type { Incoming } from "../basics/incoming.ts";
import type { FileRef } from "../documents/documents.ts";
import type { IsSound } from "./verify.ts";

/** A file that also stands in another one, from some byte on. */
export interface Part extends FileRef {
  readonly from: number;
}

interface Waiting {
  readonly part: Part;
  readonly isWanted: () => boolean;
  readonly resolve: (bytes: ArrayBuffer) => void;
  readonly reject: (error: unknown) => void;
}

/** A part did not come, or is not what its name promises. */
export class PartError extends Error {
  override readonly name = "PartError";
}

export class Slices {
  private readonly waiting = new Set<Waiting>();
  private readonly taken: Part[] = [];

  /** `isSound` says whether bytes are what a URL promises. */
  constructor(private readonly isSound: IsSound) {}

  /** Whether a part that somebody waited for has come. */
  get hasGiven(): boolean {
    return this.taken.length > 0;
  }

  /** Parts that have come. */
  get given(): readonly Part[] {
    return this.taken;
  }

  /** Whether some had their part, and nobody else wants one. */
  get areServed(): boolean {
    return this.hasGiven && [...this.waiting].every(({ isWanted }) => !isWanted());
  }

  ask(part: Part, isWanted: () => boolean): Promise<ArrayBuffer> {
    return new Promise((resolve, reject) => this.waiting.add({ part, isWanted, resolve, reject }));
  }

  /** Hands on what has come. */
  look(incoming: Incoming): void {
    for (const one of this.waiting) {
      const { from, bytes } = one.part;
      if (from + bytes > incoming.length) continue;
      this.waiting.delete(one);
      this.taken.push(one.part);
      void this.give(one, incoming.slice(from, from + bytes));
    }
  }

  /** Nothing more will come. */
  end(error: unknown): void {
    for (const { reject } of this.waiting) reject(error);
    this.waiting.clear();
  }

  private async give({ part, resolve, reject }: Waiting, bytes: ArrayBuffer): Promise<void> {
    try {
      if (!(await this.isSound(part.url, bytes))) throw new PartError(`${part.url} is damaged where it stands`);
      resolve(bytes);
    } catch (error) {
      reject(error);
    }
  }
}
