/**
 * How is long work done in pieces, so that a page can do something else in between? Who does it says where it may stop, and goes on when
 * asked to.
 */

/** Work that gives its result in the end. */
export type Pieces<T> = Generator<void, T>;

/** Does all of it at once. */
export function atOnce<T>(work: Pieces<T>): T {
  for (;;) {
    const { done, value } = work.next();
    if (done) return value as T;
  }
}
