/**
 * Where am I? A map of the cells around, seen from above, with one's own place and direction and where other people are; a
 * click or the Enter key goes to the place that is pointed at. Cells are learnt a chunk at a time, nearest first.
 */
import type { CellEntry } from "../core/documents.ts";
import { MapFrame, type Spot, storey } from "../core/floorplan.ts";
import type { Vec3 } from "../core/geometry.ts";
import { make } from "./dom.ts";
import type { Visit } from "./visit.ts";

const SIZE_PX = 220;
/** From the middle to the edge; the wheel changes it. */
const [REACH_M, NEAREST_M, FURTHEST_M] = [42, 12, 2000];
const UPDATE_EVERY_MS = 150;
/** How far an arrow key moves the pointer. */
const STEP_PX = 8;
/** Rooms of a larger world are read only around the eye. */
const MOST_CHUNKS = 64;

export class MapPanel {
  readonly element: HTMLElement;
  /** Where other people are. */
  people: () => readonly Vec3[] = () => [];
  private readonly canvas = make("canvas", {
    width: String(2 * SIZE_PX),
    height: String(2 * SIZE_PX),
    tabindex: "0",
    role: "application",
    "aria-label":
      "Map. Click to go there; with the keyboard, point with the arrow keys and press Enter; plus and minus zoom.",
  });
  private reach_m = REACH_M;
  private pointer: Spot | undefined;
  private frame: MapFrame | undefined;
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(
    private readonly visit: Visit,
    private readonly toggled: (open: boolean) => void,
  ) {
    this.element = make("aside", { id: "map", class: "card", "aria-label": "Map", hidden: true }, this.canvas);
    this.canvas.onclick = ({ offsetX, offsetY }) => {
      // On small screens it is drawn smaller.
      const shrunk = SIZE_PX / this.canvas.clientWidth;
      this.goTo({ x: offsetX * shrunk, y: offsetY * shrunk });
    };
    this.canvas.onkeydown = (event) => this.press(event);
    this.canvas.onwheel = (event) => {
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.2 : 1 / 1.2);
    };
    this.canvas.onblur = () => {
      this.pointer = undefined;
    };
  }

  get open(): boolean {
    return !this.element.hidden;
  }

  toggle(open = !this.open): void {
    if (open === this.open) return;
    this.element.hidden = !open;
    clearInterval(this.timer);
    this.toggled(open);
    if (!open) return;
    this.timer = setInterval(() => this.draw(), UPDATE_EVERY_MS);
    void this.visit.explorer
      .learnCells(MOST_CHUNKS)
      .catch(() => {})
      .then(() => this.draw());
    this.draw();
  }

  private press(event: KeyboardEvent): void {
    const steps: Record<string, Spot> = {
      ArrowLeft: { x: -STEP_PX, y: 0 },
      ArrowRight: { x: STEP_PX, y: 0 },
      ArrowUp: { x: 0, y: -STEP_PX },
      ArrowDown: { x: 0, y: STEP_PX },
    };
    const step = steps[event.key];
    const from = this.pointer ?? { x: SIZE_PX / 2, y: SIZE_PX / 2 };
    if (step) this.pointer = { x: from.x + step.x, y: from.y + step.y };
    else if (event.key === "+" || event.key === "-") this.zoom(event.key === "-" ? 1.2 : 1 / 1.2);
    else if (event.key === "Enter") this.goTo(from);
    else return;
    event.preventDefault();
    event.stopPropagation();
    this.draw();
  }

  private zoom(factor: number): void {
    this.reach_m = Math.min(FURTHEST_M, Math.max(NEAREST_M, this.reach_m * factor));
    this.draw();
  }

  private goTo(spot: Spot): void {
    const { walker } = this.visit;
    const place = this.frame?.place(spot);
    if (place) this.visit.teleport({ position: place, yaw: walker.yaw, pitch: 0 });
  }

  private draw(): void {
    const pen = this.canvas.getContext("2d");
    if (!pen) return;
    const { walker, explorer, frozenPose } = this.visit;
    const { position, yaw } = frozenPose ?? walker;
    const frame = new MapFrame(position, explorer.scene.manifest.bounds, SIZE_PX, SIZE_PX, this.reach_m);
    this.frame = frame;
    pen.setTransform(2, 0, 0, 2, 0, 0);
    pen.clearRect(0, 0, SIZE_PX, SIZE_PX);
    const seen = new Set(explorer.recordOf(explorer.cellId ?? -1)?.cpvs);
    for (const cell of storey(explorer.knownCells(), position[1])) this.drawCell(pen, frame, cell, seen);
    for (const person of this.people()) dot(pen, frame.spot(person), 3, "#74c98a");
    arrow(pen, frame.spot(position), yaw);
    if (this.pointer) cross(pen, this.pointer);
  }

  private drawCell(
    pen: CanvasRenderingContext2D,
    frame: MapFrame,
    { cell, bounds }: CellEntry,
    seen: ReadonlySet<number>,
  ) {
    const here = cell === this.visit.explorer.cellId;
    pen.fillStyle = here
      ? "rgb(232 185 106 / 75%)"
      : seen.has(cell)
        ? "rgb(232 185 106 / 28%)"
        : "rgb(200 212 228 / 16%)";
    pen.strokeStyle = "rgb(10 13 18 / 55%)";
    pen.lineWidth = 0.5;
    const rectangle = frame.rectangle(bounds);
    pen.fillRect(...rectangle);
    pen.strokeRect(...rectangle);
  }
}

function dot(pen: CanvasRenderingContext2D, { x, y }: Spot, radius: number, colour: string): void {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}

/** One's own place, and a wedge where one looks. */
function arrow(pen: CanvasRenderingContext2D, { x, y }: Spot, yaw: number): void {
  const ahead = -Math.PI / 2 - yaw;
  pen.fillStyle = "rgb(255 255 255 / 30%)";
  pen.beginPath();
  pen.moveTo(x, y);
  pen.arc(x, y, 22, ahead - 0.5, ahead + 0.5);
  pen.fill();
  dot(pen, { x, y }, 4, "#ffffff");
}

function cross(pen: CanvasRenderingContext2D, { x, y }: Spot): void {
  pen.strokeStyle = "#ffffff";
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(x - 6, y);
  pen.lineTo(x + 6, y);
  pen.moveTo(x, y - 6);
  pen.lineTo(x, y + 6);
  pen.stroke();
}
