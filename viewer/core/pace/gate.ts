/** When may what has been put off go on? Who waits goes on the next time that it is opened. */
export class Gate {
  private readonly waiting = new Set<() => void>();

  next(): Promise<void> {
    return new Promise((resolve) => this.waiting.add(resolve));
  }

  open(): void {
    for (const go of this.waiting) go();
    this.waiting.clear();
  }
}
