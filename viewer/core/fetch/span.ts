/**
 * Is what came the part of a file that was asked for? A server may answer a range with that part (206) or, where it knows no ranges, with all
 * of the file (200); whatever else it answers is not believed. `client/src/source/http.rs` has the same rules, but for two: it takes no part without its place, which it
 * can always read, and all of a file at whatever length the hash in its name is of; here that is verified later, and the published length is kept to at once.
 */

/** A part of a file. */
export interface Span {
  readonly from: number;
  /** The byte behind its last one. */
  readonly to: number;
  /** All that the file has. */
  readonly of_bytes: number;
}

/** What asks for a part. */
export function rangeOf({ from, to }: Span): string {
  return `bytes=${from}-${to - 1}`;
}

/** Whether an answer is all of a file of which a part was asked for. */
export function isWhole({ status }: Response): boolean {
  return status !== 206;
}

/** What is wrong with the place that an answer tells. */
export function misplaced(answer: Response, { from, to }: Span): string | undefined {
  if (isWhole(answer)) return undefined;
  const told = answer.headers.get("Content-Range");
  // A page may read no more of another origin's answer than that shows it: then its length has to do.
  if (told === null && answer.type === "cors") return undefined;
  const isRight = told?.startsWith(`bytes ${from}-${to - 1}/`);
  return isRight ? undefined : `with ${told ?? "a part that has no place"}`;
}

/** What is wrong with so many bytes of an answer that is all of a file, or a part of it. */
export function mismeasured(bytes: number, isAll: boolean, { from, to, of_bytes }: Span): string | undefined {
  if (isAll) return bytes === of_bytes ? undefined : `with ${bytes} bytes as if that were all of it`;
  return bytes === to - from ? undefined : `with ${bytes} bytes instead of ${to - from}`;
}

/** How many bytes an answer may have. */
export function most_bytes(isAll: boolean, { from, to, of_bytes }: Span): number {
  return isAll ? of_bytes : to - from;
}
