/** What was made of these values before? A tree with a branch for each of them. */
import { keyOf, type Value } from "./value.ts";

export class Known {
  /** What was made; `undefined` as long as nothing was. */
  index: number | undefined;
  private below: Map<number | string, Known> | undefined;

  /** Where what is made of one number more is known. */
  at(number: number | string): Known {
    this.below ??= new Map();
    let next = this.below.get(number);
    if (!next) {
      next = new Known();
      this.below.set(number, next);
    }
    return next;
  }

  /** The same of any value. */
  of(value: Value): Known {
    return this.at(typeof value === "number" ? value : keyOf(value));
  }
}
