/**
 * How do downloaded levels come into the picture? Keeps of each model what came first, its base, and at most one finer template, and
 * draws all shown objects of the model with the finer one (`modelbatch.ts`). One replaces another in one step, so that there is never a
 * frame without either. Far objects are drawn by impostors (`impostors.ts`). What is evicted leaves the GPU.
 */
import { Group, Matrix4, type Object3D, type Raycaster } from "three";
import type { Vec3 } from "../core/basics/geometry.ts";
import type { Impostor } from "../core/documents/impostordocument.ts";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import type { Decoded, ModelHost } from "../core/models/modelloads.ts";
import type { Part } from "../core/strategy/residency.ts";
import { ImpostorCrowd, standingAt } from "./impostors.ts";
import { batchedAt, type ModelBatch } from "./modelbatch.ts";
import { ModelTemplates, type Template } from "./modeltemplates.ts";
import type { Casting } from "./shadowmap.ts";
import { TextureCache } from "./textures.ts";
import type { ViewVolume } from "./viewvolume.ts";

/**
 * So many models that are out of view are given to the graphics card with each picture: else who turns round for the first time waits
 * until it has all of them.
 */
const INTRODUCED = 3;

export class ThreeModelHost implements ModelHost {
  /** Everything that is shown; add it to a scene. */
  readonly root = new Group();
  private readonly templates: Readonly<Record<Part, Map<number, Template>>> = { base: new Map(), detail: new Map() };
  private readonly textures = new TextureCache();
  private readonly decoder = new ModelTemplates(this.textures);
  /** Shown objects by id and, for swapping, by model. */
  private shown = new Map<number, PlacedObject>();
  private byModel = new Map<number, PlacedObject[]>();
  /** What draws each object by a mesh. */
  private readonly batches = new Map<number, ModelBatch>();
  /** Pictures of models, and which objects are drawn by them. */
  private readonly crowds = new Map<number, ImpostorCrowd>();
  private far: ReadonlySet<number> = new Set();
  /** Shown objects whose models are here, and which wait for their turn to be placed. */
  private readonly unplaced = new Set<number>();
  /** What may be new to the graphics card. */
  private readonly unknown = new Set<ModelBatch>();
  private readonly moved = new Map<number, Matrix4>();

  /** `changed` is called whenever a new picture should be drawn; `prepare` answers when what is below a node can be. */
  constructor(
    private readonly changed: () => void,
    private readonly prepare: (root: Object3D) => Promise<void>,
  ) {
    this.root.matrixAutoUpdate = false;
  }

  async decode(
    model: number,
    glb: ArrayBuffer,
    textures: ReadonlyMap<string, ArrayBuffer>,
  ): Promise<Decoded<[part: Part]>> {
    const template = await this.decoder.decode(glb, textures);
    return {
      bytes: template.bytes,
      pictures: template.pictures,
      ready: this.prepare(template.batch.sample()),
      draw: (part) => this.replace(model, part, template),
      release: () => this.dispose(template),
    };
  }

  needsTexture(url: string): boolean {
    return isDrawable(url) && !this.textures.holds(url);
  }

  async decodeImpostor(
    model: number,
    impostor: Impostor,
    pictures: ReadonlyMap<string, ArrayBuffer>,
  ): Promise<Decoded> {
    const crowd = await ImpostorCrowd.open(impostor, pictures, this.textures);
    const draw = () => {
      this.crowds.get(model)?.close();
      this.crowds.set(model, crowd);
      this.gather(model);
      this.changed();
    };
    return { bytes: 0, pictures: crowd.bytes, ready: this.prepare(crowd.sample()), draw, release: () => crowd.close() };
  }

  blunt(model: number): void {
    const detail = this.take(model, "detail");
    for (const object of this.byModel.get(model) ?? []) this.refresh(object);
    this.dispose(detail);
    this.changed();
  }

  evict(model: number): void {
    this.crowds.get(model)?.close();
    this.crowds.delete(model);
    const templates = this.takeAll(model);
    for (const { entry } of this.byModel.get(model) ?? []) this.remove(entry.object);
    for (const template of templates) this.dispose(template);
  }

  drawFar(objects: ReadonlySet<number>): void {
    const before = this.far;
    this.far = objects;
    const models = new Set<number>();
    for (const id of new Set([...before, ...objects])) {
      const placed = this.shown.get(id);
      if (before.has(id) === objects.has(id) || !placed) continue;
      models.add(placed.model.model);
      // Now: what was drawn by pictures is not any more.
      this.refresh(placed, "now");
    }
    for (const model of models) this.gather(model);
    this.changed();
  }

  /** Turns what is drawn by impostors to the eye, and leaves out what is not in view; to be called before each picture. */
  look(eye: Vec3, view: ViewVolume): void {
    for (const crowd of this.crowds.values()) crowd.look(eye);
    for (const templates of Object.values(this.templates)) {
      for (const { batch } of templates.values()) batch.look(view);
    }
    this.introduce();
  }

  /** What casts shadows. */
  *casting(): Generator<Casting> {
    for (const templates of Object.values(this.templates)) for (const { batch } of templates.values()) yield batch;
    yield* this.crowds.values();
  }

  show(objects: readonly PlacedObject[]): void {
    const before = this.shown;
    this.shown = new Map(objects.map((object) => [object.entry.object, object]));
    this.byModel = new Map();
    for (const object of objects) {
      const siblings = this.byModel.get(object.model.model);
      if (siblings) siblings.push(object);
      else this.byModel.set(object.model.model, [object]);
    }
    for (const id of this.batches.keys()) if (!this.shown.has(id)) this.remove(id);
    this.unplaced.clear();
    for (const object of objects) {
      const batch = this.batches.get(object.entry.object);
      if (!batch) this.refresh(object);
      // What stood for it stood roughly there.
      else if (before.get(object.entry.object) !== object)
        batch.stand(object.entry.object, this.worldFromObject(object));
    }
    for (const model of this.crowds.keys()) this.gather(model);
    this.changed();
  }

  /** Shown objects whose models are here and that are not in the picture yet. */
  get waiting(): number {
    return this.unplaced.size;
  }

  /** Places objects that wait for it, the most important first, for so long; to be called in each frame. */
  place(ms: number): void {
    if (this.unplaced.size === 0) return;
    const end_ms = performance.now() + ms;
    for (const id of this.unplaced) {
      const placed = this.shown.get(id);
      if (placed) this.refresh(placed, "now");
      if (performance.now() > end_ms) break;
    }
    this.changed();
  }

  draws(object: number): boolean {
    if (this.unplaced.has(object)) return true;
    const placed = this.shown.get(object);
    if (placed && this.far.has(object)) return this.crowds.has(placed.model.model);
    return this.batches.has(object);
  }

  /** Moves an object from where it was published, in world space: a door that is open. */
  move(object: number, motion: Matrix4): void {
    this.moved.set(object, motion);
    const placed = this.shown.get(object);
    if (placed) this.batches.get(object)?.stand(object, this.worldFromObject(placed));
    if (placed && this.far.has(object)) this.gather(placed.model.model);
    this.changed();
  }

  /** The object that a ray meets first, below a height. */
  pick(ray: Raycaster, below_m = Number.POSITIVE_INFINITY): PlacedObject | undefined {
    const hits = ray.intersectObject(this.root, true);
    const first = hits.find(({ point }) => point.y <= below_m);
    const far = first && standingAt(first);
    if (far) return far;
    const object = first && batchedAt(first);
    return object === undefined ? undefined : this.shown.get(object);
  }

  /** Frees everything. */
  clear(): void {
    this.unplaced.clear();
    this.batches.clear();
    for (const templates of Object.values(this.templates)) {
      for (const template of templates.values()) this.dispose(template);
      templates.clear();
    }
    for (const crowd of this.crowds.values()) crowd.close();
    this.crowds.clear();
    this.decoder.clear();
  }

  /**
   * Draws an object by its model's mesh, unless it is far or there is none. What is in the picture is replaced in one step, and what is
   * not waits for its turn: after a jump these are thousands.
   */
  private refresh(object: PlacedObject, when: "now" | "in turn" = "in turn"): void {
    const { model } = object.model;
    const id = object.entry.object;
    const template = this.templates.detail.get(model) ?? this.templates.base.get(model);
    if (!template || this.far.has(id)) this.remove(id);
    else if (when === "now" || this.batches.has(id)) this.draw(object, template);
    else this.unplaced.add(id);
  }

  /** Has the next picture give some of what is new to the graphics card. Pictures are drawn as long as anything comes. */
  private introduce(): void {
    let introduced = 0;
    for (const batch of this.unknown) {
      this.unknown.delete(batch);
      if (batch.introduce()) introduced += 1;
      if (introduced === INTRODUCED) break;
    }
  }

  /** Draws the far objects of a model by its impostor. */
  private gather(model: number): void {
    const far = (this.byModel.get(model) ?? []).filter(({ entry }) => this.far.has(entry.object));
    const standing = far.map((placed) => ({ placed, worldFromObject: this.worldFromObject(placed) }));
    const mesh = this.crowds.get(model)?.draw(standing);
    if (mesh) this.root.add(mesh);
  }

  private draw(object: PlacedObject, { batch }: Template): void {
    const id = object.entry.object;
    this.remove(id);
    this.batches.set(id, batch);
    this.unknown.add(batch);
    batch.stand(id, this.worldFromObject(object));
  }

  private worldFromObject({ entry }: PlacedObject): Matrix4 {
    const matrix = new Matrix4().fromArray(entry.worldFromObject);
    const motion = this.moved.get(entry.object);
    return motion ? matrix.premultiply(motion) : matrix;
  }

  private remove(object: number): void {
    this.unplaced.delete(object);
    this.batches.get(object)?.remove(object);
    this.batches.delete(object);
  }

  /** Draws a model by a template instead of those whose place it takes. */
  private replace(model: number, part: Part, template: Template): void {
    const before = part === "detail" ? [this.take(model, "detail")] : this.takeAll(model);
    this.root.add(template.batch.root);
    this.templates[part].set(model, template);
    for (const object of this.byModel.get(model) ?? []) this.refresh(object);
    for (const one of before) this.dispose(one);
    this.changed();
  }

  /** Takes a template away, which is still to be disposed of. */
  private take(model: number, part: Part): Template | undefined {
    const template = this.templates[part].get(model);
    this.templates[part].delete(model);
    return template;
  }

  private takeAll(model: number): (Template | undefined)[] {
    return [this.take(model, "base"), this.take(model, "detail")];
  }

  private dispose(template: Template | undefined): void {
    if (!template) return;
    this.unknown.delete(template.batch);
    this.decoder.dispose(template);
  }
}

function isDrawable(url: string): boolean {
  return !url.endsWith(".ktx2");
}
