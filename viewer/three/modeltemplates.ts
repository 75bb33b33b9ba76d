/** What is a downloaded level once it is decoded? Meshes that draw any number of objects, with what they take of the graphics card. */
import { type BufferGeometry, Line, type Material, Mesh, type Object3D, Points, Texture } from "three";
import { GlbLoader, textureUrls } from "./glbloader.ts";
import { Materials } from "./materials.ts";
import { type Drawn, ModelBatch } from "./modelbatch.ts";
import { Painter } from "./painter.ts";
import type { TextureCache } from "./textures.ts";

export interface Template {
  /** Draws objects with it. */
  readonly batch: ModelBatch;
  /** Of its meshes. */
  readonly bytes: number;
  /** What each of its pictures takes; others may use them, too. */
  readonly pictures: ReadonlyMap<string, number>;
  readonly parts: readonly Drawn[];
  readonly paints: readonly number[];
  /** Of parts that are not painted by their vertices. */
  readonly materials: ReadonlySet<Material>;
}

export class ModelTemplates {
  private readonly loader: GlbLoader;
  private readonly painter = new Painter();
  private readonly materials = new Materials();

  constructor(private readonly textures: TextureCache) {
    this.loader = new GlbLoader(textures);
  }

  /** Decodes a level; `textures` are those that came with it. */
  async decode(glb: ArrayBuffer, textures: ReadonlyMap<string, ArrayBuffer>): Promise<Template> {
    const used = textureUrls(glb).filter((url) => textures.has(url) || this.textures.holds(url));
    const { pictures, failed } = await this.textures.acquire(used, textures);
    for (const [url, error] of failed) {
      console.warn(`the picture ${url} cannot be decoded; its model is drawn without it`, error);
    }
    let taken: readonly number[] = [];
    try {
      const { scene, parser } = await this.loader.parse(glb);
      const { painted, others, paints } = this.painter.paint(drawnOf(scene));
      taken = paints;
      const materials = this.materials.share(others, parser);
      const parts = [...painted, ...others];
      return { batch: new ModelBatch(parts), bytes: geometryBytes(parts), pictures, parts, paints, materials };
    } catch (error) {
      for (const url of pictures.keys()) this.textures.release(url);
      this.painter.release(taken);
      throw error;
    }
  }

  /** Frees what a template takes. */
  dispose({ batch, parts, paints, materials, pictures }: Template): void {
    batch.release();
    for (const { geometry } of parts) geometry.dispose();
    this.painter.release(paints);
    for (const material of materials) if (this.materials.release(material)) disposeMaterial(material);
    for (const url of pictures.keys()) this.textures.release(url);
  }

  /** Frees what all templates share, when there is none any more. */
  clear(): void {
    this.painter.dispose();
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

function geometryBytes(parts: readonly { readonly geometry: BufferGeometry }[]): number {
  const buffers = new Set<ArrayBufferLike>();
  for (const { geometry } of parts) {
    for (const attribute of Object.values(geometry.attributes)) buffers.add(attribute.array.buffer);
    if (geometry.index) buffers.add(geometry.index.array.buffer);
  }
  return [...buffers].reduce((total, buffer) => total + buffer.byteLength, 0);
}

function disposeMaterial(material: Material): void {
  for (const value of Object.values(material)) if (value instanceof Texture) value.dispose();
  material.dispose();
}
