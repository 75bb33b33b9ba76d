/** Which values are in reach, and where do they lie? Finding one takes as long however many there are. */
export class Reach {
  private readonly names: string[] = [];
  /** The slots of all values of a name, the nearest last. */
  private readonly slots = new Map<string, number[]>();

  get length(): number {
    return this.names.length;
  }

  /** Brings one more into reach; each has the slot after the one before. */
  push(name: string): number {
    const slot = this.names.push(name) - 1;
    const slots = this.slots.get(name);
    if (slots) slots.push(slot);
    else this.slots.set(name, [slot]);
    return slot;
  }

  /** Leaves only the first ones in reach. */
  truncate(length: number): void {
    for (const name of this.names.splice(length)) this.slots.get(name)?.pop();
  }

  /** The name of the value that came into reach last. */
  get last(): string | undefined {
    return this.names.at(-1);
  }

  /** The slot of the nearest value of that name. */
  slotOf(name: string): number | undefined {
    return this.slots.get(name)?.at(-1);
  }
}
