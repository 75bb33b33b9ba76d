/** What does somebody read whose link leads nowhere? */
import type { Astray } from "../core/movement/astray.ts";

/** The way out. */
export const TO_THE_START = "Go to the start";

export const ASTRAY: Readonly<Record<Astray, string>> = {
  outside: "This link leads out of the world.",
  walled: "This link leads to where nobody can stand, as inside of a wall.",
  unreadable:
    "The place in this link cannot be read: it should be “p=x,y,z”, three numbers in metres, with “yaw” and “pitch” in degrees.",
};
