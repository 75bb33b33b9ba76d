/**
 * Where am I? A map of the cells around, seen from above: of the storey where one is, and elsewhere of the ground below; with one's own
 * place and direction and where other people are. A click or the Enter key goes to the place that is pointed at. It is framed to what is built until one zooms. Cells are learnt a
 * chunk at a time, nearest first.
 */
import { type Bounds, length, subtract, type Vec3 } from "../core/basics/geometry.ts";
import type { CellEntry } from "../core/documents/documents.ts";
import { cellOnMap, type FloorPlan, floorPlan, MapFrame, type Spot } from "../core/movement/floorplan.ts";
import {
  builtAround,
  builtOf,
  firstReach,
  groundOf,
  type ReachRange,
  reachRange,
  scaleBar,
  withinReach,
} from "../core/movement/mapreach.ts";
import type { Announcer } from "./announcer.ts";
import { make } from "./dom.ts";
import { Disclosure } from "./focus.ts";
import { writeLength } from "./format.ts";
import { inks } from "./inks.ts";
import { arrow, cross, dot, scaleLine } from "./mapmarks.ts";
import type { Visit } from "./visit.ts";

/** Its picture has so many pixels for each of the page. */
const SHARPNESS = 2;
const UPDATE_EVERY_MS = 150;
/** For who does not see it. */
const HOW =
  "Click to go there; with the keyboard, point with the arrow keys and press Enter; plus and minus zoom, as do a wheel and two fingers.";
/** How far an arrow key moves the pointer. */
const STEP_PX = 8;
/** A press of a key or a button zooms by so much; a wheel and two fingers on a touchpad by so much for each pixel. */
const [ZOOM_STEP, WHEEL_PER_PX, PINCH_PER_PX] = [1.5, 0.002, 0.01];
/** Wheels that count lines. */
const LINE_PX = 33;
/** How far the scale is from the edge, and how long at most. */
const [SCALE_EDGE_PX, SCALE_PX] = [10, 80];
/** One's own place is shown at the edge when it is beyond it. */
const EDGE_PX = 5;
/** Rooms of a larger world are read only around the eye. */
const MOST_CHUNKS = 64;

export class MapPanel {
  readonly element: HTMLElement;
  /** Where other people are. */
  people: () => readonly Vec3[] = () => [];
  private readonly canvas = make("canvas", {
    tabindex: "0",
    role: "application",
    title: "Click: go there. Wheel, pinch, + and −: zoom.",
    "aria-describedby": "map-how",
  });
  private readonly zoomIn = zoomButton("Zoom in", "+", () => this.zoom(1 / ZOOM_STEP));
  private readonly zoomOut = zoomButton("Zoom out", "−", () => this.zoom(ZOOM_STEP));
  private readonly disclosure: Disclosure;
  private readonly ground: Bounds;
  private readonly built: Bounds;
  private readonly range: ReachRange;
  private reach_m: number;
  /** Whether the person has chosen how much to see. */
  private isZoomed = false;
  private readonly fingers = new Map<number, Spot>();
  private pointer: Spot | undefined;
  private frame: MapFrame | undefined;
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(
    private readonly visit: Visit,
    private readonly announcer: Pick<Announcer, "say">,
    private readonly toggled: (open: boolean) => void,
  ) {
    const { manifest } = visit.explorer.scene;
    this.ground = groundOf(manifest);
    this.built = builtOf(manifest, visit.framed);
    this.range = reachRange(this.ground, visit.walker.size);
    this.reach_m = this.range.most_m;
    const zoom = make("div", { class: "zoom" }, this.zoomIn, this.zoomOut);
    const how = make("p", { id: "map-how", class: "visually-hidden" }, HOW);
    const attributes = { id: "map", class: "card", "aria-label": "Map", hidden: true };
    this.element = make("aside", attributes, this.canvas, zoom, how);
    this.disclosure = new Disclosure(this.element);
    this.element.onkeydown = (event) => this.press(event);
    this.canvas.onclick = ({ offsetX: x, offsetY: y }) => this.goTo({ x, y });
    this.canvas.onwheel = (event) => {
      event.preventDefault();
      const way_px = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
      this.zoom(Math.exp(way_px * (event.ctrlKey ? PINCH_PER_PX : WHEEL_PER_PX)));
    };
    this.canvas.onpointerdown = ({ pointerId, offsetX: x, offsetY: y }) => this.fingers.set(pointerId, { x, y });
    this.canvas.onpointermove = ({ pointerId, offsetX: x, offsetY: y }) => this.moveFinger(pointerId, { x, y });
    for (const name of ["pointerup", "pointercancel", "pointerleave"] as const) {
      this.canvas.addEventListener(name, ({ pointerId }) => this.fingers.delete(pointerId));
    }
    this.canvas.onblur = () => {
      this.pointer = undefined;
    };
  }

  get open(): boolean {
    return this.disclosure.open;
  }

  toggle(open = !this.open): void {
    if (open === this.open) return;
    this.disclosure.open = open;
    clearInterval(this.timer);
    this.toggled(open);
    if (!open) return;
    this.timer = setInterval(() => this.draw(), UPDATE_EVERY_MS);
    void this.visit.explorer
      .learnCells(MOST_CHUNKS)
      .catch(() => {})
      .then(() => this.fit());
    this.fit();
  }

  private press(event: KeyboardEvent): void {
    const steps: Record<string, Spot> = {
      ArrowLeft: { x: -STEP_PX, y: 0 },
      ArrowRight: { x: STEP_PX, y: 0 },
      ArrowUp: { x: 0, y: -STEP_PX },
      ArrowDown: { x: 0, y: STEP_PX },
    };
    const zooms: Record<string, number> = { "+": 1 / ZOOM_STEP, "=": 1 / ZOOM_STEP, "-": ZOOM_STEP };
    const [step, zoom] = [steps[event.key], zooms[event.key]];
    const isOnMap = event.target === this.canvas;
    const from = this.pointer ?? this.frame?.spot(this.visit.standpoint.position);
    if (zoom) this.zoom(zoom);
    else if (isOnMap && step && from) this.pointer = this.frame?.nearest({ x: from.x + step.x, y: from.y + step.y }, 0);
    else if (isOnMap && from && event.key === "Enter") this.goTo(from);
    else return;
    event.preventDefault();
    event.stopPropagation();
    this.draw();
    if (step) this.tell();
  }

  /** Says to who does not see it what the keyboard points at. */
  private tell(): void {
    const place = this.pointer && this.frame?.place(this.pointer);
    if (!place) return;
    const entry = cellOnMap(this.plan, place);
    const way_m = length(subtract(place, this.visit.standpoint.position));
    this.announcer.say("map", `${entry ? `Cell c${entry.cell}` : "No cell"} on the map, ${writeLength(way_m)} away`);
  }

  /** Two fingers that part show less. */
  private moveFinger(id: number, to: Spot): void {
    const from = this.fingers.get(id);
    const [other] = [...this.fingers].filter(([one]) => one !== id);
    if (!from) return;
    this.fingers.set(id, to);
    if (!other) return;
    const apart = ({ x, y }: Spot) => Math.max(1, Math.hypot(x - other[1].x, y - other[1].y));
    this.zoom(apart(from) / apart(to));
  }

  private zoom(factor: number): void {
    this.isZoomed = true;
    this.reach_m = withinReach(this.range, this.reach_m * factor);
    this.draw();
  }

  /** Shows what suits the world and the place. */
  private fit(): void {
    const { walker, standpoint } = this.visit;
    const { storey } = this.plan;
    if (!this.isZoomed) this.reach_m = firstReach(this.range, this.matters, storey, standpoint.position, walker.size);
    this.draw();
  }

  /** What the map is about. */
  private get matters(): Bounds {
    return builtAround(this.built, this.visit.standpoint.position, this.ground);
  }

  /** What lies around and below where one stands, as far as it is known. */
  private get plan(): FloorPlan {
    const { walker, explorer, standpoint } = this.visit;
    return floorPlan(explorer.knownCells(), standpoint.position[1], walker.size);
  }

  private goTo(spot: Spot): void {
    const { walker } = this.visit;
    const place = this.frame?.place(spot);
    if (place) this.visit.teleport({ position: place, yaw: walker.yaw, pitch: 0 });
  }

  private draw(): void {
    const pen = this.canvas.getContext("2d");
    const size_px = this.canvas.clientWidth;
    if (!pen || size_px === 0) return;
    const { explorer } = this.visit;
    const { position, yaw } = this.visit.standpoint;
    const frame = new MapFrame(position, this.ground, size_px, size_px, this.reach_m, this.matters);
    this.frame = frame;
    this.describe(frame);
    if (this.canvas.width !== SHARPNESS * size_px) this.canvas.width = this.canvas.height = SHARPNESS * size_px;
    pen.setTransform(SHARPNESS, 0, 0, SHARPNESS, 0, 0);
    pen.clearRect(0, 0, size_px, size_px);
    const seen = new Set(explorer.recordOf(explorer.cellId ?? -1)?.cpvs);
    const { below, storey } = this.plan;
    const colours = inks();
    const colourOf = ({ cell }: CellEntry, other: string) =>
      cell === explorer.cellId ? colours.here : seen.has(cell) ? colours.seen : other;
    pen.strokeStyle = colours.wall;
    pen.lineWidth = 0.5;
    for (const cell of below) drawCell(pen, frame.rectangle(cell.bounds), colourOf(cell, colours.below));
    for (const cell of storey) drawCell(pen, frame.rectangle(cell.bounds), colourOf(cell, colours.storey));
    for (const person of this.people()) dot(pen, frame.spot(person), 3, colours.person, colours);
    arrow(pen, frame.nearest(frame.spot(position), EDGE_PX), yaw, colours);
    if (this.pointer) cross(pen, this.pointer, colours);
    const { length_m, length_px } = scaleBar(frame.px_per_m, SCALE_PX);
    scaleLine(pen, { x: SCALE_EDGE_PX, y: size_px - SCALE_EDGE_PX }, length_px, writeLength(length_m), colours);
  }

  /** Says how much is shown, and whether there is more or less. */
  private describe({ width_m }: MapFrame): void {
    const label = `Map, ${writeLength(width_m)} across.`;
    if (this.canvas.getAttribute("aria-label") !== label) this.canvas.setAttribute("aria-label", label);
    this.zoomIn.setAttribute("aria-disabled", String(this.reach_m <= this.range.least_m));
    this.zoomOut.setAttribute("aria-disabled", String(this.reach_m >= this.range.most_m));
  }
}

function drawCell(
  pen: CanvasRenderingContext2D,
  rectangle: readonly [number, number, number, number],
  colour: string,
): void {
  pen.fillStyle = colour;
  // What lies on top hides what is below it.
  pen.clearRect(...rectangle);
  pen.fillRect(...rectangle);
  pen.strokeRect(...rectangle);
}

function zoomButton(name: string, sign: string, press: () => void): HTMLButtonElement {
  const button = make("button", { type: "button", title: name }, make("span", { "aria-hidden": "true" }, sign));
  button.onclick = press;
  return button;
}
