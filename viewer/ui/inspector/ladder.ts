/** Which levels and rungs has the object that was clicked, and which of them is drawn? */
import { distanceToBounds } from "../../core/geometry.ts";
import { geometricError_m, type PlacedObject } from "../../core/objects.ts";
import { desiredLevel, screenError_px } from "../../core/scheduler.ts";
import { boxes } from "../../three/overlay.ts";
import { make, write } from "../dom.ts";
import { writeBytes } from "../format.ts";
import { TARGET_PX, type Visit } from "../visit.ts";
import { type Section, section } from "./section.ts";

export class Ladder implements Section {
  readonly element: HTMLElement;
  private readonly name = make(
    "p",
    { class: "note", "data-testid": "picked" },
    "Click an object to see what it is made of.",
  );
  private readonly levels = make("table", { class: "ladder" });
  private readonly rungs = make("p", { class: "note" });
  private picked: PlacedObject | undefined;

  constructor(private readonly visit: Visit) {
    this.element = section("The object", this.name, this.levels, this.rungs);
  }

  pick(object: PlacedObject | undefined): void {
    this.picked = object;
    const bounds = object ? [object.entry.bounds] : [];
    this.visit.overlay.set("picked", boxes(bounds, { color: 0xffffff, line: 1, fill: 0 }));
    this.visit.redraw();
    this.update();
  }

  update(): void {
    const { picked } = this;
    const eye = this.visit.explorer.eyeNow;
    if (!picked || !eye) {
      this.levels.replaceChildren();
      write(this.rungs, "");
      write(this.name, "Click an object to see what it is made of.");
      return;
    }
    const { entry, model } = picked;
    const distance_m = distanceToBounds(entry.bounds, eye.position);
    write(this.name, `o${entry.object} “${entry.sourceNode}”, model m${model.model}, ${distance_m.toFixed(1)} m away`);
    const held = this.visit.explorer.residency.held(model.model)?.level;
    const wanted = desiredLevel(picked, eye, TARGET_PX);
    const head = ["level", "triangles", "bytes", "off by", ""].map((text) => make("th", { scope: "col" }, text));
    const rows = model.levels.map((level) => {
      const error_m = geometricError_m(picked, level);
      const error = `${(1000 * error_m).toFixed(1)} mm · ${screenError_px(error_m, distance_m, eye).toFixed(1)} px`;
      const state = [level.level === held ? "drawn" : "", level.level === wanted ? "wanted" : ""]
        .filter(Boolean)
        .join(", ");
      const cells = [String(level.level), level.triangles.toLocaleString("en"), writeBytes(level.bytes), error, state];
      return make("tr", { class: level.level === held ? "held" : "" }, ...cells.map((text) => make("td", {}, text)));
    });
    this.levels.replaceChildren(make("tr", {}, ...head), ...rows);
    const { smooth } = model;
    const rungs = smooth?.rungs
      .map(({ to, triangles }) => `${triangles.toLocaleString("en")} at ${writeBytes(to)}`)
      .join(", ");
    write(this.rungs, rungs ? `Smooth LOD, triangles by rung: ${rungs}.` : "It has no smooth LOD.");
  }
}
