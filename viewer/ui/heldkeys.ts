/** Which keys count in this frame? Those that are held, and those that were pressed and let go since the frame before: none in vain. */

export class HeldKeys {
  private readonly held = new Set<string>();
  /** Those of them that counted already. */
  private readonly counted = new Set<string>();
  private readonly tapped = new Set<string>();

  press(code: string): void {
    this.held.add(code);
  }

  release(code: string): void {
    // While ⌘ is held, macOS tells of no other key that is let go.
    if (code.startsWith("Meta")) this.clear();
    if (this.held.delete(code) && !this.counted.delete(code)) this.tapped.add(code);
  }

  /** Nobody holds any any more. */
  clear(): void {
    for (const keys of [this.held, this.counted, this.tapped]) keys.clear();
  }

  /** Those that are held, and those that were let go before this was asked for. */
  take(): ReadonlySet<string> {
    const taken = new Set([...this.held, ...this.tapped]);
    for (const code of this.held) this.counted.add(code);
    this.tapped.clear();
    return taken;
  }
}
