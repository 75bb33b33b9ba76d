/**
 * Which place in a row belongs to which object? Slots are numbered without gaps: where an object leaves, the last one takes its slot.
 * What is kept for each slot grows to twice what is needed, so that objects which come one by one are seldom copied.
 */

/** Slots of objects, by number. */
export class Slots {
  private readonly objects: number[] = [];
  private readonly slots = new Map<number, number>();

  get count(): number {
    return this.objects.length;
  }

  /** The object in a slot. */
  objectIn(slot: number): number | undefined {
    return this.objects[slot];
  }

  /** The slot of an object: the one that it has, or a new one behind all others. */
  take(object: number): number {
    const held = this.slots.get(object);
    if (held !== undefined) return held;
    this.slots.set(object, this.objects.length);
    return this.objects.push(object) - 1;
  }

  /** Takes an object's slot from it; answers which that was, for the last one, which has `count` now, to be moved there. */
  free(object: number): number | undefined {
    const slot = this.slots.get(object);
    if (slot === undefined) return undefined;
    this.slots.delete(object);
    const last = this.objects.pop();
    if (last !== undefined && last !== object) {
      this.objects[slot] = last;
      this.slots.set(last, slot);
    }
    return slot;
  }
}

/** Some numbers for each slot. */
export class Rows {
  private numbers = new Float64Array(0);

  constructor(readonly width: number) {}

  get array(): Float64Array {
    return this.numbers;
  }

  /** Makes room for so many slots. */
  reserve(slots: number): void {
    if (slots * this.width <= this.numbers.length) return;
    const grown = new Float64Array(2 * slots * this.width);
    grown.set(this.numbers);
    this.numbers = grown;
  }

  /** Writes what is in one slot into another. */
  move(from: number, to: number): void {
    this.numbers.copyWithin(to * this.width, from * this.width, (from + 1) * this.width);
  }
}
