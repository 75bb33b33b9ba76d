/**
 * What did gamepads say since the last frame? They tell of nothing by themselves, and a press may begin and end between two frames of a slow
 * machine: so while one is connected it is looked at between frames, too, and what was wanted at any look counts in the next frame.
 */
import type { Intent } from "../core/walker.ts";
import { type Pad, type PadWish, readPads } from "./gamepad.ts";
import type { Command } from "./keys.ts";

/** Shorter than any press. */
const LOOK_EVERY_MS = 16;

const NOTHING = readPads([]);

export class PadWatch {
  private last = NOTHING;
  private since = NOTHING;
  private timer: ReturnType<typeof setInterval> | undefined;

  /** `read` answers all pads, connected or not; `command` hears of each button that goes down. */
  constructor(
    private readonly read: () => readonly (Pad | null)[],
    private readonly command: (command: Command) => void,
  ) {}

  /** Looks once; and from now on by itself, for as long as there is a pad. */
  look(): void {
    const pads = this.read();
    const { last } = this;
    this.last = readPads(pads);
    this.since = both(this.since, this.last);
    if (pads.every((pad) => pad === null)) this.close();
    else this.timer ??= setInterval(() => this.look(), LOOK_EVERY_MS);
    for (const command of this.last.commands) if (!last.commands.has(command)) this.command(command);
  }

  /** All that was wanted since this was asked for the last time. */
  take(): PadWish {
    this.look();
    const { since } = this;
    this.since = NOTHING;
    return since;
  }

  /** Looks no more by itself. */
  close(): void {
    clearInterval(this.timer);
    this.timer = undefined;
  }
}

/** What is wanted first and then, the stronger of each. */
function both(first: PadWish, then: PadWish): PadWish {
  const stronger = (a: number, b: number) => (Math.abs(b) > Math.abs(a) ? b : a);
  const intent: Intent = {
    forward: stronger(first.intent.forward, then.intent.forward),
    right: stronger(first.intent.right, then.intent.right),
    up: stronger(first.intent.up, then.intent.up),
    fast: first.intent.fast || then.intent.fast,
  };
  return {
    intent,
    yaw: stronger(first.yaw, then.yaw),
    pitch: stronger(first.pitch, then.pitch),
    commands: new Set([...first.commands, ...then.commands]),
  };
}
