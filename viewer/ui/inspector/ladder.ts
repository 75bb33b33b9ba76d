/** Which levels and rungs has the object that was clicked, and which of them is drawn? */
import { distanceToBounds } from "../../core/basics/geometry.ts";
import type { Model } from "../../core/documents/modeldocument.ts";
import { geometricError_m, type PlacedObject } from "../../core/documents/placedobject.ts";
import { filesOf, type Grade, goalOf, gradesOf, isHereWellEnough } from "../../core/strategy/grade.ts";
import { errorOf_px, errorThatDoes } from "../../core/strategy/sight.ts";
import { boxes } from "../../three/overlay.ts";
import type { Announcer } from "../announcer.ts";
import { make, write } from "../dom.ts";
import { shorten, writeBytes } from "../format.ts";
import { isTouched } from "../touch.ts";
import type { Visit } from "../visit.ts";
import { type Section, section } from "./section.ts";

const HINT = isTouched()
  ? "Tap an object to see what it is made of."
  : "Click an object to see what it is made of, or press Space or, where no door is in reach, Enter for what is in the middle of the view.";

const HEAD = ["grade", "triangles", "bytes", "off by", "state"];

/** One way to draw the object. */
interface Row {
  readonly name: string;
  readonly isHeld: boolean;
  /** What stands below the head, but for the name. */
  readonly cells: readonly string[];
}

export class Ladder implements Section {
  readonly element: HTMLElement;
  private readonly name = make("p", { class: "note", "data-testid": "picked" }, HINT);
  private readonly grades = make("table", {
    class: "ladder",
    "data-testid": "ladder",
    "aria-label": "How it can be drawn",
  });
  private readonly note = make("p", { class: "note", "data-testid": "ladder-note" });
  private picked: PlacedObject | undefined;
  private listed = "";

  /** `announcer` tells what was picked. */
  constructor(
    private readonly visit: Visit,
    private readonly announcer: Announcer,
  ) {
    this.element = section("The object", this.name, this.grades, this.note);
  }

  pick(object: PlacedObject | undefined): void {
    this.picked = object;
    const bounds = object ? [object.entry.bounds] : [];
    this.visit.overlay.set("picked", boxes(bounds, { color: 0xffffff, line: 1, fill: 0 }));
    this.visit.redraw();
    this.update();
  }

  /** Says what was picked, or that nothing is there; also when it is the same as before. */
  announce(): void {
    const { held } = this.picked ? this.visit.explorer.models.of(this.picked.model.model) : {};
    const drawn = held ? `, drawn by ${held.kind} ${held.number}` : "";
    this.announcer.say("picked", "");
    this.announcer.say("picked", this.picked ? `${this.name.textContent}${drawn}` : "There is no object");
  }

  update(): void {
    const { explorer } = this.visit;
    const known = this.picked && explorer.placed(this.picked.entry.object);
    if (known && known !== this.picked) this.pick(known);
    const { picked } = this;
    const eye = explorer.eyeNow;
    if (!picked || !eye) {
      this.list([]);
      write(this.note, "");
      write(this.name, HINT);
      return;
    }
    const { entry, model } = picked;
    const distance_m = distanceToBounds(entry.bounds, eye.position);
    const name = known ? `“${entry.sourceNode}”` : "whose name is still to come";
    write(this.name, `o${entry.object} ${name}, model m${model.model}, ${distance_m.toFixed(1)} m away`);
    const holding = explorer.models.of(model.model);
    const { held } = holding;
    const most_error = errorThatDoes(picked, eye, explorer.refinedTo_px);
    const does = isHereWellEnough(model, holding, most_error);
    const wanted = does ? held : goalOf(model, most_error, holding, explorer.models.costOf);
    const rows = gradesOf(model).map((grade) => {
      const error = `${(1000 * geometricError_m(picked, grade)).toFixed(1)} mm · ${errorOf_px(picked, grade, eye).toFixed(1)} px`;
      const isHeld = isPartOf(grade, held);
      const state = [
        isSame(grade, held) ? "drawn" : isHeld ? "held" : "",
        isSame(grade, wanted) ? "wanted" : "",
      ].filter(Boolean);
      const bytes = writeBytes(bytesOf(model, grade));
      const cells = [grade.triangles.toLocaleString("en"), bytes, error, state.join(", ")];
      return { name: `${grade.kind} ${grade.number}`, isHeld, cells };
    });
    this.list(rows);
    const trouble = explorer.models.noteOf(model.model);
    const usual = model.smooth ? RUNGS_NOTE : "It has no smooth LOD.";
    write(
      this.note,
      trouble ? `Drawn by its levels, because what costs less is of no use: ${shorten(trouble)}` : usual,
    );
    this.note.title = trouble ?? "";
  }

  /** Leaves the table alone where it says the same: somebody may be reading it, cell by cell. */
  private list(rows: readonly Row[]): void {
    const listed = JSON.stringify(rows);
    if (listed === this.listed) return;
    this.listed = listed;
    const head = HEAD.map((text) => make("th", { scope: "col" }, text));
    this.grades.replaceChildren(...(rows.length > 0 ? [make("tr", {}, ...head), ...rows.map(tableRow)] : []));
  }
}

function tableRow({ name, isHeld, cells }: Row): HTMLElement {
  const data = cells.map((text) => make("td", {}, text));
  return make("tr", { class: isHeld ? "held" : "" }, make("th", { scope: "row" }, name), ...data);
}

const RUNGS_NOTE = "Rungs are parts of a smooth LOD: each adds its bytes to those before it.";

const isSame = (a: Grade, b: Grade | undefined) => a.kind === b?.kind && a.number === b.number;

/** Whether a grade is drawn, or is a rung that what is drawn was refined from. */
function isPartOf(grade: Grade, held: Grade | undefined): boolean {
  return (
    grade.kind === held?.kind && (grade.kind === "level" ? grade.number === held.number : grade.number <= held.number)
  );
}

/** Of a level without its pictures, of a rung alone, and of all files of an impostor or of rules. */
function bytesOf(model: Model, grade: Grade): number {
  if (grade.kind === "level") return model.levels[grade.number]?.bytes ?? 0;
  if (grade.kind !== "rung") return filesOf(model, grade).reduce((sum, { bytes }) => sum + bytes, 0);
  const { from = 0, to = 0 } = model.smooth?.rungs[grade.number] ?? {};
  return to - from;
}
