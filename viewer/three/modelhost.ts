/**
 * How do downloaded levels come into the picture? Decodes GLBs with three.js, keeps for each model what came first, its base,
 * and at most one finer template, and a clone of the finer, sharing geometry and materials, for each shown object. One
 * replaces another in one step, so that there is never a frame without either. Far objects are drawn by impostors (`impostors.ts`). What is evicted leaves the GPU.
 */
import {
  type BufferGeometry,
  Group,
  Line,
  type Material,
  Matrix4,
  Mesh,
  type Object3D,
  Points,
  PointsMaterial,
  type Raycaster,
  Texture,
} from "three";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { Vec3 } from "../core/geometry.ts";
import type { Impostor } from "../core/impostordocument.ts";
import type { ModelHost } from "../core/modelloads.ts";
import type { PlacedObject } from "../core/objects.ts";
import type { Part } from "../core/residency.ts";
import { ImpostorCrowd, standingAt } from "./impostors.ts";
import { Materials } from "./materials.ts";
import { TextureCache } from "./textures.ts";

interface Template {
  readonly root: Object3D;
  /** What is drawn of it. */
  readonly parts: readonly Drawn[];
  readonly materials: ReadonlySet<Material>;
  readonly textures: readonly string[];
}

type Drawn = Mesh | Points | Line;

/** What a GLB says of its textures. */
interface TextureTable {
  readonly textures: readonly { readonly extensions?: Readonly<Record<string, unknown>> }[];
}

const POINT_SIZE_PX = 2;
const FEW = 8;

export class ThreeModelHost implements ModelHost {
  /** Everything that is shown; add it to a scene. */
  readonly root = new Group();
  private readonly templates: Readonly<Record<Part, Map<number, Template>>> = { base: new Map(), detail: new Map() };
  private readonly textures = new TextureCache();
  private readonly materials = new Materials();
  private readonly loader: GLTFLoader;
  /** Shown objects by id and, for swapping, by model. */
  private shown = new Map<number, PlacedObject>();
  private byModel = new Map<number, PlacedObject[]>();
  private readonly nodes = new Map<number, Object3D>();
  /** Pictures of models, and which objects are drawn by them. */
  private readonly crowds = new Map<number, ImpostorCrowd>();
  private far: ReadonlySet<number> = new Set();
  /** Shown objects whose models are here, and which wait for their turn to be placed. */
  private readonly unplaced = new Set<number>();
  private readonly moved = new Map<number, Matrix4>();

  /** `changed` is called whenever a new picture should be drawn. */
  constructor(private readonly changed: () => void) {
    this.root.matrixAutoUpdate = false;
    this.loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
    const textureLoader = this.textures.loader();
    this.loader.register((parser) => {
      parser.textureLoader = textureLoader;
      return { name: "BELVEDERE_cached_textures" };
    });
    // GPU-compressed pictures would need a transcoder of half a megabyte; such a model is drawn without them.
    this.loader.register((parser) => ({
      name: "KHR_texture_basisu",
      loadTexture: (index) => {
        const texture = (parser.json as TextureTable).textures[index];
        return texture?.extensions?.KHR_texture_basisu ? Promise.resolve(null as unknown as Texture) : null;
      },
    }));
  }

  async upload(
    model: number,
    part: Part,
    glb: ArrayBuffer,
    textures: ReadonlyMap<string, ArrayBuffer>,
  ): Promise<number> {
    const used = textureUrls(glb).filter((url) => textures.has(url) || this.textures.holds(url));
    const acquired: string[] = [];
    let bytes = 0;
    try {
      for (const url of used) {
        try {
          bytes += await this.textures.acquire(url, textures.get(url));
          acquired.push(url);
        } catch (error) {
          console.warn(`the picture ${url} cannot be decoded; its model is drawn without it`, error);
        }
      }
      const { scene, parser } = await this.loader.parseAsync(glb, "");
      scene.traverse(prepare);
      const materials = this.materials.share(scene, parser);
      bytes += geometryBytes(scene);
      const before = part === "detail" ? [this.take(model, "detail")] : this.takeAll(model);
      this.templates[part].set(model, { root: scene, parts: drawnOf(scene), materials, textures: acquired });
      for (const object of this.byModel.get(model) ?? []) this.refresh(object);
      for (const template of before) this.dispose(template);
    } catch (error) {
      for (const url of acquired) this.textures.release(url);
      throw error;
    }
    this.changed();
    return bytes;
  }

  needsTexture(url: string): boolean {
    return isDrawable(url) && !this.textures.holds(url);
  }

  async uploadImpostor(model: number, impostor: Impostor, pictures: ReadonlyMap<string, ArrayBuffer>): Promise<number> {
    const crowd = await ImpostorCrowd.open(impostor, pictures, this.textures);
    this.crowds.get(model)?.close();
    this.crowds.set(model, crowd);
    this.gather(model);
    this.changed();
    return crowd.bytes;
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

  /** Turns what is drawn by impostors to the eye; to be called before each picture. */
  look(eye: Vec3): void {
    for (const crowd of this.crowds.values()) crowd.look(eye);
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
    this.removeAll([...this.nodes.keys()].filter((id) => !this.shown.has(id)));
    this.unplaced.clear();
    for (const object of objects) {
      const node = this.nodes.get(object.entry.object);
      if (!node) this.refresh(object);
      // What stood for it stood roughly there.
      else if (before.get(object.entry.object) !== object) this.stand(node, object);
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
    return this.nodes.get(object)?.parent === this.root;
  }

  /** Moves an object from where it was published, in world space: a door that is open. */
  move(object: number, motion: Matrix4): void {
    this.moved.set(object, motion);
    const node = this.nodes.get(object);
    const placed = this.shown.get(object);
    if (node && placed) this.stand(node, placed);
    if (placed && this.far.has(object)) this.gather(placed.model.model);
    this.changed();
  }

  /** The object that a ray meets first, below a height. */
  pick(ray: Raycaster, below_m = Number.POSITIVE_INFINITY): PlacedObject | undefined {
    const hits = ray.intersectObject(this.root, true);
    const first = hits.find(({ point }) => point.y <= below_m);
    const far = first && standingAt(first);
    if (far) return far;
    let hit: Object3D | null | undefined = first?.object;
    while (hit && hit.userData.object === undefined) hit = hit.parent;
    return hit ? this.shown.get(Number(hit.userData.object)) : undefined;
  }

  /** Frees everything. */
  clear(): void {
    this.unplaced.clear();
    this.removeAll([...this.nodes.keys()]);
    for (const templates of Object.values(this.templates)) {
      for (const template of templates.values()) this.dispose(template);
      templates.clear();
    }
    for (const crowd of this.crowds.values()) crowd.close();
    this.crowds.clear();
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
    else if (when === "now" || this.nodes.has(id)) this.draw(object, template);
    else this.unplaced.add(id);
  }

  /** Draws the far objects of a model by its impostor. */
  private gather(model: number): void {
    const far = (this.byModel.get(model) ?? []).filter(({ entry }) => this.far.has(entry.object));
    const standing = far.map((placed) => ({ placed, worldFromObject: this.worldFromObject(placed) }));
    const mesh = this.crowds.get(model)?.draw(standing);
    if (mesh) this.root.add(mesh);
  }

  /** Everything that is drawn of an object is one node, without those between that a GLB has. */
  private draw(object: PlacedObject, { parts }: Template): void {
    this.remove(object.entry.object);
    const [only] = parts;
    const node = only && parts.length === 1 ? copyOf(only) : new Group();
    if (node instanceof Group) for (const part of parts) node.add(copyOf(part));
    node.userData.object = object.entry.object;
    node.matrixAutoUpdate = false;
    this.nodes.set(object.entry.object, node);
    this.root.add(node);
    this.stand(node, object);
  }

  private stand(node: Object3D, placed: PlacedObject): void {
    const { objectFromPart } = node.userData;
    node.name = placed.entry.sourceNode;
    node.matrix.copy(this.worldFromObject(placed));
    if (objectFromPart) node.matrix.multiply(objectFromPart);
    node.updateMatrixWorld(true);
  }

  private worldFromObject({ entry }: PlacedObject): Matrix4 {
    const matrix = new Matrix4().fromArray(entry.worldFromObject);
    const motion = this.moved.get(entry.object);
    return motion ? matrix.premultiply(motion) : matrix;
  }

  private remove(object: number): void {
    this.unplaced.delete(object);
    this.nodes.get(object)?.removeFromParent();
    this.nodes.delete(object);
  }

  /** The same of many, for each of which three.js would look through all that are shown. */
  private removeAll(objects: readonly number[]): void {
    if (objects.length <= FEW) {
      for (const object of objects) this.remove(object);
      return;
    }
    const leaving = new Set<Object3D | undefined>(objects.map((object) => this.nodes.get(object)));
    this.root.children = this.root.children.filter((node) => !leaving.has(node));
    for (const node of leaving) if (node) node.parent = null;
    for (const object of objects) this.nodes.delete(object);
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
    template?.root.traverse((node) => (node as Partial<Mesh>).geometry?.dispose());
    for (const material of template?.materials ?? []) if (this.materials.release(material)) disposeMaterial(material);
    for (const url of template?.textures ?? []) this.textures.release(url);
  }
}

function isDrawable(url: string): boolean {
  return !url.endsWith(".ktx2");
}

/** The published textures that a GLB refers to, as their URLs in the tree. */
export function textureUrls(glb: ArrayBuffer): string[] {
  const view = new DataView(glb);
  if (view.byteLength < 20 || view.getUint32(0, true) !== 0x46546c67) throw new Error("not a GLB");
  const length = view.getUint32(12, true);
  if (length > view.byteLength - 20) throw new Error("a GLB ends before its JSON does");
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(glb, 20, length))) as {
    images?: { uri?: unknown }[];
  };
  const names = (json.images ?? []).map(({ uri }) => (typeof uri === "string" ? uri : ""));
  const published = names.map((name) => name.slice(name.lastIndexOf("/") + 1));
  return [
    ...new Set(published.filter((name) => /^[0-9a-f]{64}\.[a-z0-9]{1,8}$/.test(name)).map((name) => `/o/${name}`)),
  ];
}

function prepare(node: Object3D): void {
  const { material } = node as Partial<Mesh>;
  for (const one of material ? [material].flat() : []) {
    if (one instanceof PointsMaterial) one.size = POINT_SIZE_PX * globalThis.devicePixelRatio;
  }
}

/** What is drawn below a node. */
function drawnOf(root: Object3D): Drawn[] {
  const drawn: Drawn[] = [];
  root.updateMatrixWorld(true);
  root.traverse((node) => {
    if (node instanceof Mesh || node instanceof Points || node instanceof Line) drawn.push(node);
  });
  return drawn;
}

/** Draws the same geometry once more; where it stands in its object is written beside it. */
function copyOf(part: Drawn): Drawn {
  const copy = new (part.constructor as new (geometry: BufferGeometry, material: Drawn["material"]) => Drawn)(
    part.geometry,
    part.material,
  );
  copy.matrixAutoUpdate = false;
  copy.matrix.copy(part.matrixWorld);
  copy.userData.objectFromPart = part.matrixWorld;
  return copy;
}

function geometryBytes(root: Object3D): number {
  const buffers = new Set<ArrayBufferLike>();
  root.traverse((node) => {
    const geometry = (node as Partial<Mesh>).geometry as BufferGeometry | undefined;
    if (!geometry) return;
    for (const attribute of Object.values(geometry.attributes)) buffers.add(attribute.array.buffer);
    if (geometry.index) buffers.add(geometry.index.array.buffer);
  });
  return [...buffers].reduce((total, buffer) => total + buffer.byteLength, 0);
}

function disposeMaterial(material: Material): void {
  for (const value of Object.values(material)) if (value instanceof Texture) value.dispose();
  material.dispose();
}
