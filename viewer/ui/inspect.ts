/**
 * What can one ask and do from a browser's console? `belvedere.state()`, `belvedere.teleport([x, y, z])` and a few more;
 * tests in a real browser use the same.
 */
import type { Vec3 } from "../core/basics/geometry.ts";
import type { CellRecord } from "../core/documents/cellrecord.ts";
import type { Mode } from "../core/movement/address.ts";
import type { LiveCompany } from "./company.ts";
import type { Recording } from "./recording.ts";
import type { Visit } from "./visit.ts";

export interface State {
  readonly scene: string;
  readonly revision: string;
  /** The cell that holds the eye, or the nearest one. */
  readonly cell: string | null;
  readonly inside: boolean;
  /** `null` while nobody knows what can be seen, as for `missing`. */
  readonly visible: number | null;
  readonly objects: number;
  /** Body bytes, content encoding removed. */
  readonly bytesFetched: number;
  /** The same as they travelled, where the browser tells. */
  readonly bytesEncoded: number;
  readonly bytesTotal: number | null;
  readonly position: Vec3;
  readonly yaw: number;
  readonly pitch: number;
  readonly mode: Mode;
  /** Visible objects of which a level is held and yet nothing is drawn; always 0. */
  readonly holes: number;
  /** Visible objects of which nothing is held yet; `null` while nobody knows what can be seen. */
  readonly missing: number | null;
  /** Held models by level, and by rung as `r0`, `r1` …. */
  readonly levelsHeld: Record<string, number>;
  readonly memoryBytes: number;
  /** Requests so far. */
  readonly requests: number;
  /** Objects that came several with one request. */
  readonly bundled: number;
  /** Bytes that need not travel, because this device had kept them from an earlier visit. */
  readonly bytesKept: number;
  /** Writes under way that keep what was fetched for the next visit. */
  readonly keeping: number;
  /** What the last picture took. */
  readonly drawCalls: number;
  readonly triangles: number;
  /** What 95 of 100 frames do not exceed besides drawing and decoding, milliseconds. */
  readonly workP95_ms: number;
  /** Downloads and decodings under way. */
  readonly pending: number;
  /** Whether everything visible has at least its coarsest level. */
  readonly settled: boolean;
  /** Bodies that could not be compared with the hash in their URL. */
  readonly unverified: number;
  /** Other people in sight, where they stand. */
  readonly people: readonly Vec3[];
  /** Doors that are closed. */
  readonly closedDoors: readonly number[];
  /** What could not be loaded so far. */
  readonly problems: readonly string[];
  /** Why models are drawn by levels although they have smooth LODs. */
  readonly notes: readonly string[];
}

export interface Inspector {
  state(): State;
  /** Angles in radians; left as they are when not given. */
  teleport(position: Vec3, yaw?: number, pitch?: number): void;
  /** Walks straight ahead; answers whether it arrived. */
  walk(forward_m: number): Promise<boolean>;
  walkTo(position: Vec3, speed_mps?: number): Promise<boolean>;
  /** Where in the page a visible object can be clicked, by its name in the source. */
  find(sourceNode: string): { x: number; y: number } | undefined;
  /** Takes down which way one goes, for `belvedere walk --script`; `stop` answers that as JSON lines. */
  readonly recording: Pick<Recording, "isRunning" | "start" | "stop">;
  /** What is visible from a cell, by its id or number. */
  record(cell: number | string): Promise<CellRecord>;
}

declare global {
  interface Window {
    belvedere?: Inspector;
  }
}

export interface InspectorParts {
  readonly visit: Visit;
  readonly company: LiveCompany;
  readonly recording: Recording;
  readonly encodedBytes: () => number;
  readonly problems: readonly string[];
}

export function inspector({ visit, company, recording, encodedBytes, problems }: InspectorParts): Inspector {
  const { explorer, walker } = visit;
  const { pointer, manifest, queue } = explorer.scene;
  return {
    state: () => ({
      scene: pointer.scene,
      revision: pointer.revision,
      cell: explorer.cellId === undefined ? null : `c${explorer.cellId}`,
      inside: explorer.inside,
      visible: explorer.visibleCount ?? null,
      objects: manifest.counts.objects,
      bytesFetched: queue.tally.bytes,
      bytesEncoded: encodedBytes(),
      bytesTotal: pointer.bytes.get("published") ?? pointer.bytes.get("level0") ?? null,
      position: walker.position,
      yaw: walker.yaw,
      pitch: walker.pitch,
      mode: walker.mode,
      holes: explorer.holes,
      missing: explorer.missing ?? null,
      levelsHeld: explorer.residency.grades(),
      memoryBytes: explorer.residency.bytes,
      requests: queue.tally.requests,
      bundled: queue.tally.bundled,
      bytesKept: queue.tally.kept_bytes,
      keeping: queue.shelf?.pending ?? 0,
      ...visit.drawn,
      workP95_ms: visit.work.quantile_ms(0.95),
      pending: explorer.pending,
      settled: explorer.settled,
      unverified: queue.tally.unverified,
      people: company.movers.map(({ position: place }) => place),
      closedDoors: [...explorer.doors].filter((door) => explorer.isShut(door)),
      problems,
      notes: explorer.notes,
    }),
    teleport: (position, yaw = walker.yaw, pitch = walker.pitch) => visit.teleport({ position, yaw, pitch }),
    walk: (forward_m) => visit.walkTo(visit.ahead(forward_m), walker.walkSpeed_mps),
    walkTo: (position, speed_mps = walker.walkSpeed_mps) => visit.walkTo(position, speed_mps),
    recording,
    find: (sourceNode) => visit.find(sourceNode),
    record: (cell) => explorer.record(typeof cell === "number" ? cell : Number(cell.replace(/^c/, ""))),
  };
}
