/**
 * Which door can one open from here, and how does one learn of it? A button says so while a door is in reach; Enter, the lower
 * button of a gamepad and a click on it do the same.
 */
import type { PlacedObject } from "../core/documents/placedobject.ts";
import type { Announcer } from "./announcer.ts";
import { write } from "./dom.ts";
import type { Doors } from "./doors.ts";
import { writeDoor } from "./format.ts";
import { lowerButton } from "./gamepad.ts";
import type { Visit } from "./visit.ts";

export interface DoorHintParts {
  readonly visit: Visit;
  readonly doors: Doors;
  readonly announcer: Pick<Announcer, "say">;
  /** What says which door is in reach, and what is printed on the lower button of the gamepad. */
  readonly button: HTMLButtonElement;
  readonly label: HTMLElement;
  readonly padButton: HTMLElement;
  /** The button is about to go, with the focus if it has that. */
  readonly goes: () => void;
  /** Opens a door that is closed, and the reverse. */
  readonly use: (door: PlacedObject) => void;
}

const UPDATE_EVERY_MS = 120;

export class DoorHint {
  private door: PlacedObject | undefined;
  private wasShut = false;
  private updateAgain_ms = 0;

  constructor(private readonly parts: DoorHintParts) {
    parts.button.onclick = () => this.use();
    parts.visit.onFrame((now_ms) => {
      if (now_ms >= this.updateAgain_ms) {
        this.updateAgain_ms = now_ms + UPDATE_EVERY_MS;
        this.update();
      }
      return false;
    });
  }

  /** Uses the door in reach; answers whether there is one. */
  use(): boolean {
    if (this.door) this.parts.use(this.door);
    return this.door !== undefined;
  }

  private update(): void {
    const { explorer } = this.parts.visit;
    const found = this.find();
    const door = found === undefined ? undefined : explorer.placed(found);
    const isSame = door !== undefined && door.entry.object === this.door?.entry.object;
    this.door = door;
    if (!door) {
      this.hide();
      return;
    }
    const shut = explorer.isShut(door.entry.object);
    const name = writeDoor(door.entry.sourceNode);
    const action = `${shut ? "open" : "close"} ${name}`;
    const { announcer, button, label, padButton } = this.parts;
    write(label, action);
    const printed = lowerButton(navigator.getGamepads?.() ?? []);
    padButton.hidden = printed === undefined;
    write(padButton, printed ?? "");
    button.hidden = false;
    if (isSame && shut !== this.wasShut) announcer.say("moved", `${name} is ${shut ? "closed" : "open"} now`);
    else if (!isSame) announcer.say("moved", "");
    announcer.say("door", `Enter: ${action}`);
    this.wasShut = shut;
  }

  private find(): number | undefined {
    const { visit, doors } = this.parts;
    return visit.frozen ? undefined : doors.inReach();
  }

  private hide(): void {
    const { announcer, button, goes } = this.parts;
    if (button.hidden) return;
    // What is hidden has lost the focus already.
    goes();
    button.hidden = true;
    for (const topic of ["door", "moved"]) announcer.say(topic, "");
  }
}
