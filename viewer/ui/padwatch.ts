/**
 * What do gamepads say in this frame? They tell of nothing by themselves, and a press may begin and end between two frames of a slow
 * machine: so while one is connected it is looked at between frames, too, and what was pressed and let go by then counts once.
 */
import { known, type Pad, type PadMotion, readPads } from "./gamepad.ts";
import type { Command } from "./keys.ts";

/** Shorter than any press. */
const LOOK_EVERY_MS = 16;

const NOTHING = readPads([]);

export class PadWatch {
  /** At the last look … */
  private last = NOTHING;
  /** … when it was taken, and the strongest since then. */
  private taken: PadMotion = NOTHING;
  private since: PadMotion = NOTHING;
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
    this.since = combined([this.since, this.last], (first = 0, then = 0) =>
      Math.abs(then) > Math.abs(first) ? then : first,
    );
    if (known(pads).length === 0) this.close();
    else this.timer ??= setInterval(() => this.look(), LOOK_EVERY_MS);
    for (const command of this.last.commands) if (!last.commands.has(command)) this.command(command);
  }

  /** What is wanted, and what was meanwhile since this was asked for the last time. */
  take(): PadMotion {
    this.look();
    const { last, taken, since } = this;
    this.taken = last;
    this.since = NOTHING;
    return combined(
      [last, taken, since],
      (now = 0, before = 0, meanwhile = 0) => now || (before === 0 ? meanwhile : 0),
    );
  }

  /** Looks no more by itself. */
  close(): void {
    clearInterval(this.timer);
    this.timer = undefined;
  }
}

/** Makes one of several, number by number. */
function combined(motions: readonly PadMotion[], combine: (...values: number[]) => number): PadMotion {
  const of = (read: (motion: PadMotion) => number) => combine(...motions.map(read));
  return {
    intent: {
      forward: of(({ intent }) => intent.forward),
      right: of(({ intent }) => intent.right),
      up: of(({ intent }) => intent.up),
      fast: of(({ intent }) => Number(intent.fast)) > 0,
    },
    yaw: of(({ yaw }) => yaw),
    pitch: of(({ pitch }) => pitch),
  };
}
