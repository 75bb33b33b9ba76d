/**
 * What is there that one does not see? Freezes the view, so that one may fly out of it and look at what was left out; draws
 * the cell, its openings and its neighbours, and boxes around objects by why they count as visible.
 */
import { type Hidden, hiddenFrom, neighboursOf, type Preparation, reasonsAt } from "../../core/atlas/survey.ts";
import type { Bounds } from "../../core/basics/geometry.ts";
import { reasonOf } from "../../core/basics/reason.ts";
import type { PlacedObject } from "../../core/documents/placedobject.ts";
import { PRIORITY } from "../../core/strategy/priority.ts";
import { boxes, hull, type Ink, outlined, pyramid } from "../../three/overlay.ts";
import type { Covered } from "../../three/stage.ts";
import { make, write } from "../dom.ts";
import { writeBytes } from "../format.ts";
import { isTouched } from "../touch.ts";
import type { Visit } from "../visit.ts";
import { type Section, section, toggle } from "./section.ts";

const css = (color: number) => `#${color.toString(16).padStart(6, "0")}`;

const GOLD = 0xe8b96a;
const KEY = isTouched() ? "" : " (G)";
const [FREEZE, THAW] = [`Freeze the view${KEY}`, `Back into the view${KEY}`];
const PREPARED: Record<Preparation, number> = { unknown: 0xe06c5c, known: 0xe0b44c, coming: 0x6fb6e8, ready: 0x74c98a };
const SEEN = { local: 0xf2a65a, objects: 0x5fa8f5, cells: 0xa04dff };
const GHOST: Ink = { color: 0xbcd0ea, line: 0.55, fill: 0.06, through: true };
/** Tinted floors of cells lie so far above those that one walks on. */
const RAISED_M = 0.03;
/** The frozen picture is drawn out to here. */
const FRUSTUM_M = 12;

export class Layers implements Section {
  readonly element: HTMLElement;
  private readonly shown = { cell: true, neighbours: false, reasons: false, ghosts: true, cut: true };
  private readonly freeze = make("button", { type: "button", "aria-pressed": "false" }, FREEZE);
  private readonly saved = make("p", { class: "note", "data-testid": "saved" });
  /** All objects of the scene, once they are known. */
  private all: readonly PlacedObject[] | undefined;
  private hidden: Hidden | undefined;
  /** Why they cannot be known. */
  private unknown = "";
  private drawn = "";

  /** `covered` says how much of the picture the inspector covers. */
  constructor(
    private readonly visit: Visit,
    private readonly covered: () => Covered,
  ) {
    const layer = (name: keyof Layers["shown"], label: string, colours: readonly number[]) =>
      toggle(label, this.shown[name], (on) => this.choose(name, on), colours.map(css));
    this.freeze.onclick = () => this.toggleFreeze();
    this.element = section(
      "What is there",
      make("p", {}, this.freeze),
      this.saved,
      layer("ghosts", "Hidden objects, while frozen", [GHOST.color]),
      layer("cut", "Cut away what is above, while frozen", []),
      layer("cell", "This cell and its openings", [GOLD]),
      layer("neighbours", "Cells next door: unknown, known, coming, ready", Object.values(PREPARED)),
      layer("reasons", "Visible: inside the cell, elsewhere; cells seen into", Object.values(SEEN)),
    );
  }

  toggleFreeze(): void {
    const { visit } = this;
    if (visit.frozen) visit.thaw();
    else {
      visit.freeze(this.covered);
      void visit.cutAway(this.shown.cut);
      void this.findHidden();
    }
    this.freeze.setAttribute("aria-pressed", String(visit.frozen));
    this.freeze.textContent = visit.frozen ? THAW : FREEZE;
    this.update();
  }

  update(): void {
    const { visit, all } = this;
    const { explorer } = visit;
    // What lies ahead still comes while the view is frozen.
    this.hidden = visit.frozen && all ? hiddenFrom(explorer.visible, all, (model) => explorer.wants(model)) : undefined;
    write(this.saved, visit.frozen ? this.describe(this.hidden) : "");
    const key = this.stateKey();
    if (key === this.drawn) return;
    this.drawn = key;
    this.draw();
  }

  /** Takes everything out of the picture. */
  clear(): void {
    if (this.visit.frozen) this.toggleFreeze();
    this.drawn = "";
    for (const name of ["cell", "neighbours", "reasons", "ghosts"]) this.visit.overlay.set(name, []);
    this.visit.redraw();
  }

  private describe(hidden: Hidden | undefined): string {
    if (!hidden) return this.unknown || "Asking what else there is …";
    const all = hidden.objects.length + this.visit.explorer.visible.length;
    const share = `${writeBytes(hidden.saved_bytes)} of ${writeBytes(hidden.whole_bytes)}`;
    const others = hidden.objects.length - hidden.absent;
    const told = `${hidden.objects.length} of ${all} objects are hidden. Nothing of ${hidden.absent} of them is here: ${share} saved.`;
    const here = ` The models of ${others} are here: in sight too, seen before, or fetched ahead.`;
    const unknown = this.unknown && ` ${this.unknown}.`;
    return `${told}${others > 0 ? here : ""}${unknown} Fly out and look.`;
  }

  private async findHidden(): Promise<void> {
    const { explorer } = this.visit;
    const { objects, loss } = await explorer.directory.everything(PRIORITY.prefetch);
    this.all = objects;
    this.unknown = loss ? `That is not all: ${reasonOf(loss.error)}` : "";
    this.update();
  }

  private choose(name: keyof Layers["shown"], on: boolean): void {
    this.shown[name] = on;
    void this.visit.cutAway(this.shown.cut);
    this.update();
  }

  /** What the drawing depends on. */
  private stateKey(): string {
    const { explorer, frozen } = this.visit;
    const cell = explorer.cellId ?? -1;
    const states = this.shown.neighbours ? neighboursOf(explorer, cell).map(({ preparation }) => preparation) : [];
    const reasons = this.shown.reasons ? reasonsAt(explorer, cell) : undefined;
    const known = [
      explorer.recordOf(cell) !== undefined,
      reasons?.local.length,
      reasons?.objects.length,
      reasons?.cells.length,
    ];
    return JSON.stringify([cell, frozen, this.hidden?.objects.length, this.shown, states, known]);
  }

  private draw(): void {
    const { explorer, overlay, frozen, walker } = this.visit;
    const cell = explorer.cellId ?? -1;
    const record = explorer.recordOf(cell);
    const { shown } = this;
    overlay.set(
      "cell",
      shown.cell && record
        ? [
            ...hull(record.hull.points, record.hull.faces, { color: GOLD, line: 0.9, fill: frozen ? 0.06 : 0 }),
            ...record.portals.flatMap(({ polygon }) => outlined(polygon, { color: GOLD, line: 1, fill: 0.16 })),
          ]
        : [],
    );
    const next = shown.neighbours ? neighboursOf(explorer, cell) : [];
    overlay.set(
      "neighbours",
      (Object.keys(PREPARED) as Preparation[]).flatMap((state) =>
        boxes(
          next.filter(({ preparation }) => preparation === state).map(({ bounds }) => bounds),
          { color: PREPARED[state], line: 0.9, fill: 0.12 },
        ),
      ),
    );
    const reasons = shown.reasons ? reasonsAt(explorer, cell) : { local: [], objects: [], cells: [] };
    overlay.set("reasons", [
      // Cells are large and stand behind each other, and walls stand at their edges: tinted as a whole they would hide the others.
      ...boxes(reasons.cells, { color: SEEN.cells, line: 0.9, fill: 0, through: true }),
      ...boxes(
        reasons.cells.map((cell) => floorOf(cell, RAISED_M * walker.size)),
        { color: SEEN.cells, line: 0, fill: 0.2 },
      ),
      ...boxes(reasons.objects, { color: SEEN.objects, line: 0.8, fill: 0.1 }),
      ...boxes(reasons.local, { color: SEEN.local, line: 0.9, fill: 0.16 }),
    ]);
    const ghosts = frozen && shown.ghosts ? (this.hidden?.objects ?? []) : [];
    const eye = explorer.eyeNow;
    overlay.set("ghosts", [
      ...boxes(
        ghosts.map(({ entry }) => entry.bounds),
        GHOST,
      ),
      ...(frozen && eye
        ? pyramid(eye.position, this.visit.frozenCorners(FRUSTUM_M), {
            color: 0xffffff,
            line: 0.9,
            fill: 0,
            through: true,
          })
        : []),
    ]);
    this.visit.redraw();
  }
}

/** The bottom of a box, raised a little. */
function floorOf({ min, max }: Bounds, raised_m: number): Bounds {
  const height = min[1] + raised_m;
  return { min: [min[0], height, min[2]], max: [max[0], height, max[2]] };
}
