/** Which key and which button of a gamepad does what? The page's help lists all of them. */

/** What is done once, whenever its key goes down. */
export type Command =
  | "door"
  | "inspect"
  | "fly"
  | "level"
  | "help"
  | "map"
  | "inspector"
  | "freeze"
  | "record"
  | "close";

/** What happens while a key is held, each from −1 to 1. */
export type Motion = Partial<Record<"forward" | "right" | "up" | "turn" | "tilt", number>>;

/** By `KeyboardEvent.code`: where keys are counts, not what is printed on them. */
export const MOTIONS: Readonly<Record<string, Motion>> = {
  KeyW: { forward: 1 },
  ArrowUp: { forward: 1 },
  KeyS: { forward: -1 },
  ArrowDown: { forward: -1 },
  KeyA: { right: -1 },
  KeyD: { right: 1 },
  KeyE: { up: 1 },
  KeyQ: { up: -1 },
  ArrowLeft: { turn: 1 },
  ArrowRight: { turn: -1 },
  KeyR: { tilt: 1 },
  PageUp: { tilt: 1 },
  KeyV: { tilt: -1 },
  PageDown: { tilt: -1 },
};

export const COMMANDS: Readonly<Record<string, Command>> = {
  Enter: "door",
  NumpadEnter: "door",
  Space: "inspect",
  KeyF: "fly",
  KeyC: "level",
  Home: "level",
  KeyH: "help",
  KeyM: "map",
  KeyI: "inspector",
  KeyG: "freeze",
  KeyT: "record",
  Escape: "close",
};

/** By number in the standard mapping of gamepads: the lower, the upper and the start button. */
export const PAD_COMMANDS: Readonly<Record<number, Command>> = { 0: "door", 3: "fly", 9: "help" };

const SCROLLING = /^(Arrow|Page|Home|End|Space)/;

/** What a key asks for; a question mark is one wherever it is printed. */
export function commandOf({ code, key }: Pick<KeyboardEvent, "code" | "key">): Command | undefined {
  return key === "?" ? "help" : COMMANDS[code];
}

/** Whether a key is meant for the control that has the focus, and not for the walker. */
export function isForControl(target: Pick<Element, "closest">, code: string): boolean {
  const isPress = /Enter$|^Space$/.test(code);
  if (target.closest("select, textarea, input:not([type=checkbox])")) return code !== "Escape";
  if (isPress && target.closest("button, a, summary, input")) return true;
  return SCROLLING.test(code) && target.closest("[data-scrolls]") !== null;
}
