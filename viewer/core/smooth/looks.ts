/**
 * How much may a reader look at (`docs/SLOD.md` §9)? Splits cost bits, and what a reader looks at for them is the triangles
 * around vertices: of these a few bytes could bring very many together, and have them looked through again and again.
 */
import type { Header } from "./header.ts";

/** For each vertex and each triangle that there will be. */
const LOOKS = 256;
/** So many triangles of a list are searched or moved in the time of one look. */
const AT_ONCE = 8;

export const TOO_MANY_LOOKS = "it makes its reader look at more than a mesh of its size needs";

/** What may still be looked at. */
export class Looks {
  private left: number;

  constructor({ vertices, triangles }: Header) {
    this.left = LOOKS * (vertices + triangles);
  }

  take(looks: number): void {
    this.left -= looks;
  }

  /** A list of so many triangles is searched. */
  takeForSearch(length: number): void {
    this.left -= Math.floor(length / AT_ONCE);
  }

  get areUsedUp(): boolean {
    return this.left <= 0;
  }
}
