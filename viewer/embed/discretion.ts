/**
 * What of it does a page that shows a world among other things say aloud? What is wrong, always; what concerns only who is in the world,
 * such as a door in reach, while somebody is.
 */

/** What only who is there needs to know. */
const FOR_WHO_IS_THERE: ReadonlySet<string> = new Set(["manner", "door", "moved"]);

interface Saying {
  say(topic: string, text: string): void;
}

export class Discretion implements Saying {
  private readonly held = new Map<string, string>();

  constructor(
    private readonly announcer: Saying,
    /** Whether somebody is in the world. */
    private readonly isThere: () => boolean,
  ) {}

  say(topic: string, text: string): void {
    const isHeld = FOR_WHO_IS_THERE.has(topic);
    if (isHeld) this.held.set(topic, text);
    if (!isHeld || text === "" || this.isThere()) this.announcer.say(topic, text);
  }

  /** Somebody comes, and hears what holds by now. */
  comes(): void {
    for (const [topic, text] of this.held) this.announcer.say(topic, text);
  }
}
