/**
 * Who else is here, and which doors do they close? Joins a live session where one is offered, and draws people. In a static tree
 * there is nobody, and doors open and close for oneself alone.
 */
import { length, subtract } from "../core/basics/geometry.ts";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import type { Throttle } from "../core/fetch/throttle.ts";
import { Company, type Mover } from "../core/live/company.ts";
import type { LiveEvent } from "../core/live/events.ts";
import type { Clock } from "../core/live/hearing.ts";
import { Joining, type Meeting } from "../core/live/joining.ts";
import { type Participant, Session } from "../core/live/session.ts";
import { slowStream } from "../core/live/slowstream.ts";
import { standIn } from "../core/live/stand.ts";
import { orientationOf } from "../core/movement/address.ts";
import { Avatars } from "../three/avatars.ts";
import type { Doors } from "./doors.ts";
import type { Visit } from "./visit.ts";

/** Who is nearer than this is not drawn: one would look at a figure from inside. */
const NEAREST_M = 0.5;
const REPORT_EVERY_MS = 5000;
const CLOCK: Clock = {
  now_ms: () => performance.now(),
  later: (then, ms) => {
    const timer = setTimeout(then, ms);
    return () => clearTimeout(timer);
  },
  random: Math.random,
};

export interface LivePartsOfPage {
  readonly visit: Visit;
  readonly doors: Doors;
  /** Slows down what is said and heard, when a slow line is tried out. */
  readonly line: Throttle;
  /** How many other people are in sight, when that changes. */
  readonly counted: (people: number) => void;
  /** The scene was published anew while one was in it. */
  readonly outdated: () => void;
  /** A door was moved that is one only here, since the scene was published anew. */
  readonly movedAlone: () => void;
}

export class LiveCompany {
  /** Discs under people's feet tell how often they are heard of. */
  showRates = false;
  private readonly company: Company;
  private readonly avatars: Avatars;
  private readonly reports = new URL(location.href).searchParams.get("report") === "quality";
  private reportAgain_ms = 0;
  private readonly joining: Joining;
  private count = 0;
  private people: readonly Mover[] = [];

  constructor(private readonly parts: LivePartsOfPage) {
    this.company = new Company(parts.visit.explorer.scene.pointer.revision);
    this.joining = new Joining(() => this.ask(), CLOCK);
    this.avatars = new Avatars({
      prepare: (root) => parts.visit.prepare(root),
      paint: (painting) => parts.visit.paint(painting),
      fetch: (file) => parts.visit.fetch(file),
    });
    parts.visit.add(this.avatars.root);
    parts.visit.onFrame((now_ms) => this.frame(now_ms));
    parts.visit.onRest(() => this.session?.rest(this.self()));
    addEventListener("pagehide", () => this.joining.leave());
    // A page that comes back from the browser's memory has left its session.
    addEventListener("pageshow", ({ persisted }) => persisted && this.joining.comeAgain());
  }

  /** Whether other people are met here. */
  get meeting(): Meeting {
    return this.joining.meeting;
  }

  /** Those in sight. */
  get movers(): readonly Mover[] {
    return this.people;
  }

  /** What those in sight are called; empty for who has no name. */
  get names(): readonly string[] {
    return this.people.map(({ name }) => name);
  }

  private get session(): Session | undefined {
    return this.joining.session;
  }

  private ask(): Promise<Session | undefined> {
    const { line, visit } = this.parts;
    const { scene } = visit.explorer;
    return Session.offered({
      tree: scene.tree,
      scene: scene.pointer.scene,
      fetch: line.fetch,
      listen: (url) => slowStream(new EventSource(url), (bytes) => line.carry(bytes)),
      clock: CLOCK,
      told: (event) => this.hear(event),
    });
  }

  /** Opens a door that is closed, and the reverse. Answers whether the object is a door. */
  async use({ entry }: PlacedObject): Promise<boolean> {
    if (!entry.door) return false;
    const { doors, visit } = this.parts;
    let isCurrent = this.company.isCurrent;
    const shared = isCurrent && this.session?.isOpen ? this.session : undefined;
    // That the world was published anew may be heard with the answer first.
    if (shared) isCurrent = await shared.setDoor(entry.object, visit.explorer.isShut(entry.object));
    if (!shared || !isCurrent) doors.use(entry.object);
    if (!isCurrent) this.parts.movedAlone();
    return true;
  }

  private hear(event: LiveEvent): void {
    const { company, parts } = this;
    const wasCurrent = company.isCurrent;
    company.take(event, performance.now());
    const saysRevision = event.kind === "revision" || event.kind === "hello";
    if (saysRevision && !company.isCurrent) parts.outdated();
    const saysDoors = saysRevision || event.kind === "door" || event.kind === "resync";
    // Once it is published anew doors move for oneself alone.
    if (saysDoors && (company.isCurrent || wasCurrent)) parts.doors.shutExactly(company.closedDoors);
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
    this.joining.update(this.self());
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
