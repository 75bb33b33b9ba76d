/**
 * How are people drawn who wear a model of the scene? By its impostor, from near by too: what is published of a model besides is
 * one pose. Pictures are fetched when the first of them comes into sight; until then they look like everybody else.
 */
import type { Object3D } from "three";
import type { Vec3 } from "../core/basics/geometry.ts";
import type { FileRef } from "../core/documents/documents.ts";
import type { Impostor } from "../core/documents/impostordocument.ts";
import { FarCrowd, type Somebody } from "./crowds.ts";
import { openPictures, type Pictures } from "./impostors.ts";
import type { Painting } from "./stage.ts";
import { TextureCache } from "./textures.ts";

/** What drawing people takes. */
export interface Studio {
  /** Waits until what is below a node can be drawn without waiting. */
  prepare(root: Object3D): Promise<void>;
  /** Has pictures drawn. */
  paint(painting: Painting): void;
  /** Brings a published file. */
  fetch(file: FileRef): Promise<ArrayBuffer>;
}

/** Models that are worn at once; who wears another one looks like everybody else. */
const MOST_MODELS = 16;

/** A model that is worn, or was. */
class Costume {
  isReady = false;
  private crowd: FarCrowd | undefined;
  private pictures: Pictures | undefined;

  /** Makes it of its pictures. */
  make(impostor: Impostor, pictures: Pictures, root: Object3D): FarCrowd {
    this.pictures = pictures;
    this.crowd = new FarCrowd(impostor, pictures.textures, root);
    return this.crowd;
  }

  draw(people: readonly Somebody[]): void {
    if (this.isReady) this.crowd?.draw(people);
  }

  look(eye: Vec3): void {
    this.crowd?.look(eye);
  }

  close(): void {
    this.crowd?.close();
    this.pictures?.close();
    [this.crowd, this.pictures] = [undefined, undefined];
  }
}

/** What a model is known by: its pictures. */
export function keyOf({ colour }: Impostor): string {
  return colour.url;
}

export class Wardrobe {
  private readonly cache = new TextureCache();
  private readonly costumes = new Map<string, Costume>();
  private worn: ReadonlySet<string> = new Set();
  /** Worn ones that could not be had. */
  private readonly failed = new Set<string>();

  /** `changed` is called when somebody can be drawn who could not before. */
  constructor(
    private readonly root: Object3D,
    private readonly studio: Pick<Studio, "prepare" | "fetch">,
    private readonly changed: () => void,
  ) {}

  /** These are worn now. Others stay as long as nobody needs their places. What failed is tried again for who comes into sight later. */
  wear(worn: ReadonlySet<string>): void {
    this.worn = worn;
    for (const key of this.failed) if (!worn.has(key)) this.failed.delete(key);
  }

  /** Whether this can be drawn; fetches what is missing. */
  has(impostor: Impostor): boolean {
    const key = keyOf(impostor);
    const costume = this.costumes.get(key);
    if (!costume && !this.failed.has(key) && this.hasPlace()) void this.bring(key, impostor);
    return costume?.isReady ?? false;
  }

  /** Draws these people, by the pictures that they wear, and no others. */
  draw(people: ReadonlyMap<string, readonly Somebody[]>): void {
    for (const [key, costume] of this.costumes) costume.draw(people.get(key) ?? []);
  }

  look(eye: Vec3): void {
    for (const costume of this.costumes.values()) costume.look(eye);
  }

  /** Whether there is a place for one more, that of one that nobody wears at worst. */
  private hasPlace(): boolean {
    if (this.costumes.size < MOST_MODELS) return true;
    const unworn = [...this.costumes].find(([key]) => !this.worn.has(key));
    if (!unworn) return false;
    const [key, costume] = unworn;
    this.costumes.delete(key);
    costume.close();
    return true;
  }

  private async bring(key: string, impostor: Impostor): Promise<void> {
    const costume = new Costume();
    this.costumes.set(key, costume);
    const isKept = () => this.costumes.get(key) === costume;
    try {
      const files = [impostor.colour, impostor.shape];
      const fetched = files.map(async (file) => [file.url, await this.studio.fetch(file)] as const);
      const pictures = await openPictures(impostor, new Map(await Promise.all(fetched)), this.cache);
      await this.studio.prepare(costume.make(impostor, pictures, this.root).sample());
      costume.isReady = isKept();
      if (costume.isReady) this.changed();
      else costume.close();
    } catch (error) {
      costume.close();
      if (!isKept()) return;
      // Without pictures they look like everybody else.
      console.warn("a model that is worn cannot be drawn", error);
      this.costumes.delete(key);
      this.failed.add(key);
    }
  }
}
