/**
 * Which of several elements on a page listens to a gamepad? A gamepad points at nothing: the one that has the focus, or, while none has it,
 * the one that was used last; none while somebody types elsewhere.
 */

/** What one can be at with a keyboard. */
export interface Attentive {
  /** Whether it has the focus. */
  readonly hasFocus: boolean;
}

export class Attention<T extends Attentive> {
  /** Those on the page: what was used last first, then in the order in which they came. */
  private order: T[] = [];

  /** `isTyping` says whether what somebody types goes to something else on the page. */
  constructor(private readonly isTyping: () => boolean) {}

  enters(one: T): void {
    if (!this.order.includes(one)) this.order.push(one);
  }

  leaves(one: T): void {
    this.order = this.order.filter((other) => other !== one);
  }

  /** Somebody clicks into it, or goes to it by keys. */
  uses(one: T): void {
    this.order = [one, ...this.order.filter((other) => other !== one)];
  }

  /** Whether it is the one that listens. */
  has(one: T): boolean {
    const focused = this.order.find(({ hasFocus }) => hasFocus);
    return (focused ?? (this.isTyping() ? undefined : this.order[0])) === one;
  }
}

/** Whether somebody types, or chooses, in something that has the focus. */
export function isTyping(active: Pick<Element, "matches"> | null): boolean {
  return active?.matches("input, textarea, select, [contenteditable]:not([contenteditable=false]), iframe") ?? false;
}
