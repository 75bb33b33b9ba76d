/** What does the page do when it is told to? Each command by key, button, tap or gamepad, and what is used by pointing at it. */
import type { PlacedObject } from "../core/documents/placedobject.ts";
import type { Announcer } from "./announcer.ts";
import type { LiveCompany } from "./company.ts";
import { Controls } from "./controls.ts";
import { DoorHint } from "./doorhint.ts";
import type { Doors } from "./doors.ts";
import { element } from "./elements.ts";
import { focusWorld } from "./focus.ts";
import type { Command } from "./keys.ts";
import type { Panels } from "./panels.ts";
import { Pointing } from "./pointing.ts";
import type { Recording } from "./recording.ts";
import type { Visit } from "./visit.ts";

/** What commands are given to. */
export interface Commanded {
  readonly visit: Visit;
  readonly doors: Doors;
  readonly company: LiveCompany;
  readonly recording: Recording;
  readonly announcer: Announcer;
  readonly panels: Panels;
  /** Something could not be done, and `again` tries it once more. */
  readonly failed: (error: unknown, again: () => void) => void;
}

/** Hears commands from now on; answers what else steers. */
export function takeCommands({ visit, doors, company, recording, announcer, panels, failed }: Commanded): Controls {
  const { inspector, map, help } = panels;
  const canvas = element("view", HTMLCanvasElement);
  const use = async (object: PlacedObject) => {
    try {
      await company.use(object);
    } catch (error) {
      failed(error, () => void use(object));
    }
  };
  const pointing = new Pointing({
    pick: (x, y) => visit.pick(x, y),
    canvas,
    inspector,
    isLive: () => !visit.frozen,
    use: (object) => void use(object),
  });
  const doorButton = element("door", HTMLButtonElement);
  const hint = new DoorHint({
    visit,
    doors,
    announcer,
    button: doorButton,
    label: element("door-text", HTMLSpanElement),
    padButton: element("door-pad", HTMLElement),
    goes: () => {
      if (document.activeElement === doorButton) focusWorld();
    },
    use: (door) => void use(door),
  });
  element("fly-toggle", HTMLButtonElement).onclick = () => visit.toggleFly();
  const commands: Record<Command, () => unknown> = {
    // The door that the page offers goes first: it says that this key opens it.
    door: () => hint.use() || pointing.inspect(),
    inspect: () => pointing.inspect(),
    fly: () => visit.toggleFly(),
    level: () => visit.level(),
    help: () => help.toggle(),
    map: () => map.toggle(),
    inspector: () => inspector.toggle(),
    freeze: () => inspector.toggleFreeze(),
    record: () => recording.toggle(),
    close: () => [help, map, inspector].find(({ open }) => open)?.toggle(false),
  };
  const room = element("free", HTMLDivElement);
  return new Controls(canvas, element("stick", HTMLDivElement), {
    keys: window,
    turn: (yaw, pitch) => visit.turn(yaw, pitch),
    command: (command) => commands[command]() !== false,
    tap: (x, y) => pointing.tap(x, y),
    room: () => room.getBoundingClientRect(),
  });
}
