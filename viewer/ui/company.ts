/**
 * Who else is here, and which doors do they close? Joins a live session where one is offered, and draws people. In a static tree
 * there is nobody, and doors open and close for oneself alone.
 */
import { orientationOf } from "../core/address.ts";
import { length, subtract } from "../core/geometry.ts";
import { Company, type Mover } from "../core/live/company.ts";
import type { LiveEvent } from "../core/live/events.ts";
import { type Participant, Session } from "../core/live/session.ts";
import { slowStream } from "../core/live/slowstream.ts";
import { standIn } from "../core/live/stand.ts";
import type { PlacedObject } from "../core/objects.ts";
import type { Throttle } from "../core/throttle.ts";
import { Avatars } from "../three/avatars.ts";
import type { Doors } from "./doors.ts";
import type { Visit } from "./visit.ts";

/** Who is nearer than this is not drawn: one would look at a figure from inside. */
const NEAREST_M = 0.5;
const REPORT_EVERY_MS = 5000;

export interface LivePartsOfPage {
  readonly visit: Visit;
  readonly doors: Doors;
  /** Slows down what is said and heard, when a slow line is tried out. */
  readonly line: Throttle;
  /** How many other people are in sight, when that changes. */
  readonly counted: (people: number) => void;
  /** The scene was published anew while one was in it. */
  readonly outdated: () => void;
}

export class LiveCompany {
  /** Discs under people's feet tell how often they are heard of. */
  showRates = false;
  private readonly company = new Company();
  private readonly avatars: Avatars;
  private readonly reports = new URL(location.href).searchParams.get("report") === "quality";
  private reportAgain_ms = 0;
  private session: Session | undefined;
  private count = 0;
  private people: readonly Mover[] = [];

  constructor(private readonly parts: LivePartsOfPage) {
    this.avatars = new Avatars({
      prepare: (root) => parts.visit.prepare(root),
      paint: (painting) => parts.visit.paint(painting),
      fetch: (file) => parts.visit.fetch(file),
    });
    parts.visit.add(this.avatars.root);
    parts.visit.onFrame((now_ms) => this.frame(now_ms));
    addEventListener("pagehide", () => this.session?.close());
    // A page that comes back from the browser's memory has left its session.
    addEventListener("pageshow", ({ persisted }) => void (persisted && this.join()));
  }

  /** Whether other people can be met here. */
  get live(): boolean {
    return this.session?.isOpen ?? false;
  }

  /** Those in sight. */
  get movers(): readonly Mover[] {
    return this.people;
  }

  /** Joins, where that is possible; a server that cannot be asked is one without company. */
  async join(): Promise<void> {
    const { line, visit } = this.parts;
    const { scene } = visit.explorer;
    try {
      this.session = await Session.offered({
        tree: scene.tree,
        scene: scene.pointer.scene,
        fetch: line.fetch,
        listen: (url) => slowStream(new EventSource(url), (bytes) => line.carry(bytes)),
        now_ms: () => performance.now(),
        told: (event) => this.hear(event),
      });
    } catch {
      this.session = undefined;
    }
  }

  /** Opens a door that is closed, and the reverse. Answers whether the object is a door. */
  async use({ entry }: PlacedObject): Promise<boolean> {
    if (!entry.door) return false;
    const { doors, visit } = this.parts;
    if (this.session?.isOpen) await this.session.setDoor(entry.object, visit.explorer.isShut(entry.object));
    else doors.use(entry.object);
    return true;
  }

  private hear(event: LiveEvent): void {
    const { scene } = this.parts.visit.explorer;
    this.company.take(event, performance.now());
    const published = event.kind === "revision" || event.kind === "hello" ? event.revision : undefined;
    if (published !== undefined && published !== scene.pointer.revision) this.parts.outdated();
    if (event.kind === "door" || event.kind === "resync") this.parts.doors.shutExactly(this.company.closedDoors);
  }

  /** Visitors who asked for it with `?report=quality` say now and then what they get to see. */
  private report(now_ms: number): void {
    if (!this.reports || now_ms < this.reportAgain_ms) return;
    if (!this.session?.isOpen) return;
    // Not the last sample, which may be of where one was before a jump.
    const here = this.parts.visit.explorer.quality()?.here;
    if (here === undefined) return;
    this.reportAgain_ms = now_ms + REPORT_EVERY_MS;
    this.session.report(here);
  }

  private frame(now_ms: number): boolean {
    this.session?.update(this.self());
    this.report(now_ms);
    this.people = this.company.movers(now_ms);
    if (this.people.length !== this.count) {
      this.count = this.people.length;
      this.parts.counted(this.count);
    }
    const eye = this.parts.visit.walker.position;
    const outside = this.people.filter(({ position }) => length(subtract(position, eye)) > NEAREST_M);
    const walked = this.avatars.show(outside, { eye: this.parts.visit.eye, now_ms, rates: this.showRates });
    return walked;
  }

  private self(): Participant {
    const { walker, standpoint, frozen, explorer } = this.parts.visit;
    const { position, yaw } = standpoint;
    return {
      position: standIn(explorer.scene.manifest.bounds, position),
      orientation: orientationOf(yaw, 0),
      velocity: frozen ? [0, 0, 0] : walker.speed,
    };
  }
}
