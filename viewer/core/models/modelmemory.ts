/**
 * For what is there memory, and what goes for it? Promises it to what will be fetched, by an estimate, books what is held beside the meshes
 * of a model too, and has the renderer drop what has to go.
 */
import type { Model } from "../documents/modeldocument.ts";
import { NO_PICTURES } from "../strategy/pictures.ts";
import type { Cause, Want } from "../strategy/priority.ts";
import type { Gone, Held, Part, ResidencySet, Terms } from "../strategy/residency.ts";
import { Footprint } from "./footprint.ts";
import type { ModelHost } from "./modelloads.ts";
import { type Plain, PlainModels } from "./plainmodels.ts";
import type { SmoothLods } from "./smoothlods.ts";

/** What is held beside the meshes of a model. */
interface Beside {
  /** Its impostor. */
  readonly impostor: Held | undefined;
  /** What refines its smooth LOD further. */
  readonly stream_bytes: number;
}

export interface ModelMemoryParts {
  readonly host: Pick<ModelHost, "blunt" | "evict">;
  readonly residency: ResidencySet;
  readonly smooth: SmoothLods;
}

const NOTHING_BESIDE: Beside = { impostor: undefined, stream_bytes: 0 };
/** After so many wants without memory, what is less urgent waits. */
const REFUSALS = 4;

export class ModelMemory {
  readonly plain = new PlainModels();
  private readonly footprint = new Footprint();
  private readonly beside = new Map<number, Beside>();
  private isShort = false;
  /** Whether something went since it was told. */
  private hasReleased = false;

  constructor(private readonly parts: ModelMemoryParts) {}

  /** Whether something visible of which nothing is held had to be left out for want of memory. */
  get short(): boolean {
    return this.isShort;
  }

  /** Whether pictures of an impostor are held. */
  hasPictures(model: number): boolean {
    return this.besideOf(model).impostor !== undefined;
  }

  /** What refines a smooth LOD further takes so much. */
  stream_bytes(model: number): number {
    return this.besideOf(model).stream_bytes;
  }

  /** Whether something went since this was asked for the last time. */
  takeReleased(): boolean {
    const { hasReleased } = this;
    this.hasReleased = false;
    return hasReleased;
  }

  /**
   * Promises memory to what will be fetched, the most urgent first; leaves out what there is none for. What refines leaves
   * room for what lies ahead.
   */
  affordable(wants: readonly Want[]): Want[] {
    const { residency } = this.parts;
    this.isShort = false;
    const sizes = wants.map(({ object, grade }) => this.footprint.estimate_bytes(object.model, grade));
    const reserve_bytes = wants.reduce((sum, { cause }, i) => sum + (cause.kind === "ahead" ? (sizes[i] ?? 0) : 0), 0);
    const blunt = residency.stayBlunt();
    let refused = 0;
    return wants.filter(({ object, cause }, i) => {
      if (refused >= REFUSALS) return false;
      const { model } = object.model;
      // What takes the place of something useless is no luxury.
      if (cause.kind === "finer" && cause.error_px < Number.MAX_VALUE && blunt.has(model)) return false;
      const terms = termsFor(cause, reserve_bytes, residency.wasBlunted(model));
      const gone = residency.promise(model, sizes[i] ?? 0, terms);
      if (gone) this.release(gone);
      else {
        refused += 1;
        this.isShort ||= cause.kind === "missing";
      }
      return gone !== undefined;
    });
  }

  /** A mesh is drawn, without some of its textures maybe, and so much is kept to refine it. */
  holdMesh(of: Model, part: Part, held: Held, stream_bytes: number, plain: Plain): void {
    const { model } = of;
    const { residency } = this.parts;
    this.footprint.learn(of, held.grade, residency.new_bytes(held) + stream_bytes);
    residency.hold(model, part, held);
    this.plain.drawn(model, held.grade, plain);
    this.keepBeside(model, { stream_bytes });
    this.release(residency.evict());
  }

  /** Pictures are held, beside a mesh or alone. */
  holdPictures(of: Model, impostor: Held): void {
    const { model } = of;
    const { residency } = this.parts;
    const { grade } = impostor;
    this.footprint.learn(of, grade, residency.new_bytes(impostor));
    if (!residency.held(model)) residency.hold(model, "base", { grade, bytes: 0, pictures: NO_PICTURES });
    this.keepBeside(model, { impostor });
    this.release(residency.evict());
  }

  private besideOf(model: number): Beside {
    return this.beside.get(model) ?? NOTHING_BESIDE;
  }

  private keepBeside(model: number, change: Partial<Beside>): void {
    const { residency } = this.parts;
    const beside = { ...this.besideOf(model), ...change };
    this.beside.set(model, beside);
    this.plain.keepOnly(
      model,
      [residency.base(model), residency.held(model)].flatMap((held) => held?.grade ?? []),
    );
    const { impostor, stream_bytes } = beside;
    const bytes = (impostor?.bytes ?? 0) + stream_bytes + this.plain.bytes(model);
    residency.keepBeside(model, { bytes, pictures: impostor?.pictures ?? NO_PICTURES });
  }

  private release({ details, models }: Gone): void {
    const { host, residency, smooth } = this.parts;
    this.hasReleased ||= details.length + models.length > 0;
    for (const model of details) {
      host.blunt(model);
      const base = residency.base(model)?.grade;
      const stream_bytes = smooth.rewind(model, base?.kind === "rung" ? base.number + 1 : 0);
      this.keepBeside(model, { stream_bytes });
    }
    for (const model of models) {
      host.evict(model);
      smooth.close(model);
      this.beside.delete(model);
      this.plain.keepOnly(model, []);
    }
  }
}

/**
 * What had to go once comes back only for what is further away than this. Else whoever goes to and fro between two rooms that
 * memory cannot hold sharp together would fetch each of them again at every turn.
 */
const SHARP_STEPS = 2;

/** On which terms memory is promised; so much is needed for what lies ahead. */
function termsFor(cause: Cause, reserve_bytes: number, wasBlunted: boolean): Terms {
  switch (cause.kind) {
    case "missing":
      return { spare_bytes: 0, within_steps: 0, sharp_within_steps: -1 };
    case "coarser":
      return { spare_bytes: 0, within_steps: 0, sharp_within_steps: -1, isInstead: true };
    case "ahead":
      return { spare_bytes: 0, within_steps: cause.step === 3 ? 2 : 1, sharp_within_steps: cause.due ? -1 : 0 };
    case "finer":
    case "plain":
    case "relief":
      return { spare_bytes: reserve_bytes, within_steps: 2, sharp_within_steps: wasBlunted ? SHARP_STEPS : 0 };
  }
}
