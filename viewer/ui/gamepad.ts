/** What does the person with a gamepad want? Left stick walks, right stick looks, shoulders go down and up, and buttons command. */
import type { Intent } from "../core/movement/walker.ts";
import { type Command, PAD_COMMANDS } from "./keys.ts";

/** What of a `Gamepad` in the standard mapping is needed. */
export interface Pad {
  readonly id: string;
  /** `"standard"` where the browser knows which axis and which button is which. */
  readonly mapping: string;
  readonly axes: readonly number[];
  readonly buttons: readonly { readonly pressed: boolean }[];
}

/** How sticks and held buttons move. */
export interface PadMotion {
  readonly intent: Intent;
  /** Radians a second. */
  readonly yaw: number;
  readonly pitch: number;
}

export interface PadWish extends PadMotion {
  /** What held buttons ask for. */
  readonly commands: ReadonlySet<Command>;
}

/** Sticks never rest exactly in the middle. */
const DEAD_ZONE = 0.15;
const TURN_RAD_PER_S = 2.2;
const [LEFT_SHOULDER, RIGHT_SHOULDER, RIGHT_TRIGGER] = [4, 5, 7];

/** Those whose axes and buttons are known: what rests at −1, as triggers do, would else turn the head without end. */
export function known(pads: readonly (Pad | null)[]): readonly Pad[] {
  return pads.filter((pad) => pad?.mapping === "standard") as Pad[];
}

/** Everything that connected pads say, added up. */
export function readPads(pads: readonly (Pad | null)[]): PadWish {
  let [forward, right, up, yaw, pitch] = [0, 0, 0, 0, 0];
  let fast = false;
  const commands = new Set<Command>();
  for (const pad of known(pads)) {
    const pressed = (button: number) => (pad.buttons[button]?.pressed ? 1 : 0);
    forward -= tilt(pad.axes[1]);
    right += tilt(pad.axes[0]);
    up += pressed(RIGHT_SHOULDER) - pressed(LEFT_SHOULDER);
    yaw -= tilt(pad.axes[2]) * TURN_RAD_PER_S;
    pitch -= tilt(pad.axes[3]) * TURN_RAD_PER_S;
    fast ||= pressed(RIGHT_TRIGGER) === 1;
    for (const [button, command] of Object.entries(PAD_COMMANDS)) if (pressed(Number(button))) commands.add(command);
  }
  return { intent: { forward, right, up, fast }, yaw, pitch, commands };
}

/** What is printed on the lower button of the first connected pad. */
export function lowerButton(pads: readonly (Pad | null)[]): string | undefined {
  const [pad] = known(pads);
  return pad && (/054c|playstation|dualshock|dualsense/i.test(pad.id) ? "×" : "A");
}

/** A stick's tilt beyond its dead zone, from −1 to 1. */
function tilt(axis = 0): number {
  const beyond = Math.max(0, Math.abs(axis) - DEAD_ZONE) / (1 - DEAD_ZONE);
  return Math.sign(axis) * Math.min(1, beyond);
}
