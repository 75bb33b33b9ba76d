/**
 * What is held, what has been promised a place, and what goes when memory is short? Of each model what came of it first, its
 * *base*, and at most one finer grade, its *detail*, which can go at any time without leaving a hole.
 *
 * Guarantees, as in `client/src/strategy/residency.rs`: nothing is promised that would exceed the limit together with what
 * is held and promised already, but for what takes the place of something larger, and the base of what is visible never
 * goes. Details go first, then bases; of each those first that are needed furthest away, counted in steps from cell to
 * adjacent cell, and of these the longest unused (Marvie & Bouatouch, A VRML97-X3D extension for massive scenery management
 * in virtual worlds, 2004, §6.2).
 */
import type { Grade } from "./grade.ts";
import { NO_PICTURES, type Pictures, SharedPictures } from "./pictures.ts";

export interface Held {
  readonly grade: Grade;
  /** Memory that it takes alone. */
  readonly bytes: number;
  /** What it is drawn with, as others may be, too. */
  readonly pictures: Pictures;
}

/** What something takes of memory. */
type Taken = Pick<Held, "bytes" | "pictures">;

/** Whether a mesh stays for good, or until memory is short. */
export type Part = "base" | "detail";

interface Resident {
  base: Held;
  detail: Held | undefined;
  /** Pictures that are drawn instead of a mesh, and what refines a smooth LOD further. */
  beside: Taken;
  lastNeeded: number;
}

/** How many steps from here a model is needed; infinite where nobody knows. */
export type StepsTo = (model: number) => number;

/** On which terms memory is promised. */
export interface Terms {
  /** So much must stay free beside it. */
  readonly spare_bytes: number;
  /** Bases of what is needed within so many steps do not go for it; those of what is visible never do. */
  readonly within_steps: number;
  /** Details of what is needed within so many steps do not go for it: those of what is visible at 0, any may at −1. */
  readonly sharp_within_steps: number;
  /** Whether what is held of the model goes when it comes: then only what it takes more needs room. */
  readonly isInstead?: boolean;
}

/** What went for want of memory. */
export interface Gone {
  /** Models that are drawn by their base again. */
  readonly details: readonly number[];
  /** Models that are not drawn any more. */
  readonly models: readonly number[];
}

/** Something that may go, and what comes free thereby. */
export interface Leaving {
  readonly model: number;
  readonly part: Part;
  readonly bytes: number;
}

/** Not even the coarsest levels of what can be seen from a place fit into the memory. */
export class MemoryShortError extends Error {
  override readonly name = "MemoryShortError";

  constructor(readonly limit_bytes: number) {
    super(`what can be seen from here does not fit into ${Math.round(limit_bytes / 1e6)} MB of memory`);
  }
}

const LETTERS = { level: "", impostor: "i", rung: "r", grown: "g" };

const NOWHERE_NEAR: StepsTo = () => Number.POSITIVE_INFINITY;
const NOTHING_BESIDE: Taken = { bytes: 0, pictures: NO_PICTURES };
const NOTHING: Gone = { details: [], models: [] };
const NO_MODELS: ReadonlySet<number> = new Set();

export class ResidencySet {
  private readonly residents = new Map<number, Resident>();
  private readonly promises = new Map<number, number>();
  private readonly blunted = new Set<number>();
  /** Those that the cell or one next door saw then, and has seen since. */
  private readonly bluntedNear = new Set<number>();
  private needed: ReadonlySet<number> = new Set();
  private stepsTo = NOWHERE_NEAR;
  private uses = 0;
  private readonly pictures = new SharedPictures();
  /** Without pictures. */
  private total = 0;
  private promised = 0;

  constructor(readonly limit_bytes: number) {}

  /** Memory of what is held. */
  get bytes(): number {
    return this.total + this.pictures.bytes;
  }

  /** Memory that is kept free for what is on its way. */
  get promised_bytes(): number {
    return this.promised;
  }

  get size(): number {
    return this.residents.size;
  }

  /** What a model is drawn with. */
  held(model: number): Held | undefined {
    const resident = this.residents.get(model);
    return resident?.detail ?? resident?.base;
  }

  /** What of a model came first and stays. */
  base(model: number): Held | undefined {
    return this.residents.get(model)?.base;
  }

  /** What would come free of a model if its base were another one. */
  baseAlone_bytes(model: number): number {
    const base = this.base(model);
    return base ? this.freedWith([base]) : 0;
  }

  /** Whether a model has ever lost its detail for want of memory. */
  wasBlunted(model: number): boolean {
    return this.blunted.has(model);
  }

  /**
   * Models that get nothing finer for now: those that lost their detail for want of memory while they were near, and have been
   * near since, as long as what is near takes more than a quarter of it. Else details would come in one cell and go in the
   * next, again and again.
   */
  stayBlunt(): ReadonlySet<number> {
    const isNoneOrFree = this.bluntedNear.size === 0 || this.near_bytes() <= this.limit_bytes / 4;
    return isNoneOrFree ? NO_MODELS : this.bluntedNear;
  }

  /** Names the models that are visible now, and says how near the others are needed. */
  need(models: ReadonlySet<number>, stepsTo: StepsTo = NOWHERE_NEAR): void {
    this.needed = models;
    this.stepsTo = stepsTo;
    this.uses += 1;
    for (const model of models) {
      const resident = this.residents.get(model);
      if (resident) resident.lastNeeded = this.uses;
    }
    for (const model of this.bluntedNear) if (!this.isNear(model)) this.bluntedNear.delete(model);
  }

  /**
   * Promises memory to what will be fetched, when there is room or can be made; answers what has gone for it, or
   * `undefined` when there is no room.
   */
  promise(model: number, bytes: number, terms: Terms): Gone | undefined {
    const { spare_bytes, within_steps, sharp_within_steps, isInstead = false } = terms;
    const resident = isInstead ? this.residents.get(model) : undefined;
    const own_bytes = resident ? this.freedWith(meshesOf(resident)) : 0;
    const more_bytes = bytes - own_bytes;
    // What takes less than what it takes the place of helps, also where more than the limit is held.
    const helps = isInstead && more_bytes <= 0;
    const short_bytes = helps ? 0 : this.bytes + this.promised + more_bytes + spare_bytes - this.limit_bytes;
    const mayGo = (steps: number, part: Part) => steps > (part === "detail" ? sharp_within_steps : within_steps);
    const gone = short_bytes > 0 ? this.free(short_bytes, mayGo) : NOTHING;
    if (!gone) return undefined;
    this.withdraw(model);
    this.promises.set(model, bytes);
    this.promised += bytes;
    return gone;
  }

  /** Takes a promise back. */
  withdraw(model: number): void {
    this.promised -= this.promises.get(model) ?? 0;
    this.promises.delete(model);
  }

  /** As what a grade will be held of its model; as its base too when the one that is there is of no use or finer. */
  partFor(model: number, grade: Grade, baseIsSound: boolean): Part {
    const base = this.base(model);
    const stays = base && baseIsSound && grade.geometricError <= base.grade.geometricError;
    return stays ? "detail" : "base";
  }

  /** Takes a grade in instead of what was held as that part of its model; the promise is kept thereby. A new base is alone. */
  hold(model: number, part: Part, held: Held): void {
    this.withdraw(model);
    const before = this.residents.get(model);
    const beside = before?.beside ?? NOTHING_BESIDE;
    const base = part === "detail" && before ? before.base : held;
    const detail = base === held ? undefined : held;
    const resident = { base, detail, beside, lastNeeded: before?.lastNeeded ?? this.uses };
    for (const mesh of meshesOf(resident)) this.count(mesh);
    for (const mesh of before ? meshesOf(before) : []) this.discount(mesh);
    this.residents.set(model, resident);
  }

  /** Says what is held beside the meshes of a model. */
  keepBeside(model: number, beside: Taken): void {
    const resident = this.residents.get(model);
    if (!resident) return;
    this.count(beside);
    this.discount(resident.beside);
    resident.beside = beside;
  }

  /** What something would take more than is held. */
  new_bytes({ bytes, pictures }: Taken): number {
    return bytes + this.pictures.new_bytes(pictures);
  }

  /** Frees memory until the limit is kept, when what came was larger than what was promised; answers what went. */
  evict(): Gone {
    const short_bytes = this.bytes + this.promised - this.limit_bytes;
    if (short_bytes <= 0) return NOTHING;
    const mayGo = (steps: number, part: Part) => part === "detail" || steps > 0;
    return this.free(short_bytes, mayGo, "as much as may go") ?? NOTHING;
  }

  /** What may go, in the order in which it would: details before bases, and nothing of what is visible. */
  inOrderOfLeaving(): Leaving[] {
    return this.leaving((steps) => steps > 0);
  }

  /** How many models are drawn by each level, and by each rung, as `r0`, `r1` …, as an impostor alone, as `i0`, and grown here, as `g0`. */
  grades(): Record<string, number> {
    const counts: Record<string, number> = {};
    for (const { base, detail } of this.residents.values()) {
      const { grade } = detail ?? base;
      const name = `${LETTERS[grade.kind]}${grade.number}`;
      counts[name] = (counts[name] ?? 0) + 1;
    }
    return counts;
  }

  /** Makes so many bytes free out of what may go; nothing goes when that does not suffice, unless as much as may go is wanted. */
  private free(
    short_bytes: number,
    mayGo: (steps: number, part: Part) => boolean,
    otherwise?: "as much as may go",
  ): Gone | undefined {
    let freed_bytes = 0;
    const gone: Leaving[] = [];
    for (const one of this.leaving(mayGo)) {
      if (freed_bytes >= short_bytes) break;
      gone.push(one);
      freed_bytes += one.bytes;
    }
    if (freed_bytes < short_bytes && !otherwise) return undefined;
    for (const one of gone) this.drop(one);
    const of = (part: Part) => gone.flatMap((one) => (one.part === part ? one.model : []));
    const models = new Set(of("base"));
    return { details: of("detail").filter((model) => !models.has(model)), models: [...models] };
  }

  /** What is on its way to something finer stays. Of each is told what comes free once those before it have gone. */
  private leaving(mayGo: (steps: number, part: Part) => boolean): Leaving[] {
    const residents = [...this.residents].filter(([model]) => !this.promises.has(model));
    const far = residents.map(([model, resident]) => ({ model, resident, steps: this.stepsFrom(model) }));
    far.sort((a, b) => b.steps - a.steps || a.resident.lastNeeded - b.resident.lastNeeded || a.model - b.model);
    const pictures_bytes = this.pictures.ifReleased();
    const parts = (part: Part) =>
      far.flatMap(({ model, resident, steps }) => {
        const leaving = partOf(resident, part);
        if (leaving.length === 0 || !mayGo(steps, part)) return [];
        const bytes = leaving.reduce((sum, taken) => sum + taken.bytes + pictures_bytes(taken.pictures), 0);
        return { model, part, bytes };
      });
    return [...parts("detail"), ...parts("base")];
  }

  /** 0 for what is visible, and for nothing else. */
  private stepsFrom(model: number): number {
    return this.needed.has(model) ? 0 : Math.max(1, Math.min(this.stepsTo(model), Number.MAX_SAFE_INTEGER));
  }

  /** What is near takes, with all that is on its way. */
  private near_bytes(): number {
    const near = [...this.residents].filter(([model]) => this.isNear(model));
    const taken = near.flatMap(([, resident]) => [...meshesOf(resident), resident.beside]);
    const pictures = new Map(taken.flatMap((one) => [...one.pictures]));
    const shared_bytes = [...pictures.values()].reduce((sum, bytes) => sum + bytes, 0);
    return taken.reduce((sum, { bytes }) => sum + bytes, this.promised + shared_bytes);
  }

  /** What comes free when these go. */
  private freedWith(taken: readonly Taken[]): number {
    const pictures_bytes = this.pictures.ifReleased();
    return taken.reduce((sum, { bytes, pictures }) => sum + bytes + pictures_bytes(pictures), 0);
  }

  private count({ bytes, pictures }: Taken): void {
    this.total += bytes;
    this.pictures.use(pictures);
  }

  private discount({ bytes, pictures }: Taken): void {
    this.total -= bytes;
    this.pictures.release(pictures);
  }

  /** Whether the cell or one next door sees a model. */
  private isNear(model: number): boolean {
    return this.stepsFrom(model) <= 1;
  }

  private drop({ model, part }: Leaving): void {
    const resident = this.residents.get(model);
    if (!resident) return;
    for (const taken of partOf(resident, part)) this.discount(taken);
    if (resident.detail) {
      this.blunted.add(model);
      if (this.isNear(model)) this.bluntedNear.add(model);
    }
    if (part === "detail") resident.detail = undefined;
    else this.residents.delete(model);
  }
}

function meshesOf({ base, detail }: Resident): readonly Taken[] {
  return detail ? [base, detail] : [base];
}

/** What goes with a part; what is beside its meshes goes with the base. */
function partOf(resident: Resident, part: Part): readonly Taken[] {
  if (part === "base") return [resident.base, resident.beside];
  return resident.detail ? [resident.detail] : [];
}
