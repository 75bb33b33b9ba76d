/** What does somebody hear who listens to the page? What was last said on each topic, once things are quiet. */

const QUIET_MS = 800;

export class Announcer {
  private readonly waiting = new Map<string, string>();
  private readonly said = new Map<string, string>();
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `line` is a live region. */
  constructor(private readonly line: { textContent: string | null }) {}

  /** Says a text that differs from what was said last on its topic; what was not yet heard on it is not said any more. */
  say(topic: string, text: string): void {
    if (text === (this.waiting.get(topic) ?? this.said.get(topic))) return;
    if (text === "" || text === this.said.get(topic)) this.waiting.delete(topic);
    else this.waiting.set(topic, text);
    if (text === "") this.said.delete(topic);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.speak(), QUIET_MS);
  }

  private speak(): void {
    if (this.waiting.size === 0) return;
    for (const [topic, text] of this.waiting) this.said.set(topic, text);
    this.line.textContent = [...this.waiting.values()].join(". ");
    this.waiting.clear();
  }
}
