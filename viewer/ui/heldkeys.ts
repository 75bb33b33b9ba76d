/** Which keys count in this frame? Those that are held, and those that were let go since the frame before: none is pressed in vain. */

export class HeldKeys {
  private readonly held = new Set<string>();
  private readonly released = new Set<string>();

  press(code: string): void {
    this.held.add(code);
  }

  release(code: string): void {
    if (this.held.delete(code)) this.released.add(code);
  }

  /** Nobody holds any any more. */
  clear(): void {
    this.held.clear();
    this.released.clear();
  }

  /** All that were held since this was asked for the last time. */
  take(): ReadonlySet<string> {
    const taken = new Set([...this.held, ...this.released]);
    this.released.clear();
    return taken;
  }
}
