/**
 * How are people drawn who wear a model of the scene? By its impostor, from near by too: what is published of a model besides is
 * one pose. Pictures are fetched when the first of them comes into sight; until then they look like everybody else.
 */
import type { Object3D } from "three";
import type { FileRef } from "../core/documents.ts";
import type { Vec3 } from "../core/geometry.ts";
import type { Impostor } from "../core/impostordocument.ts";
import { FarCrowd, type Somebody } from "./crowds.ts";
import { openPictures } from "./impostors.ts";
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

export class Wardrobe {
  private readonly cache = new TextureCache();
  /** By the pictures of a model; `undefined` while they are not here. */
  private readonly crowds = new Map<string, FarCrowd | undefined>();

  /** `changed` is called when somebody can be drawn who could not before. */
  constructor(
    private readonly root: Object3D,
    private readonly studio: Pick<Studio, "prepare" | "fetch">,
    private readonly changed: () => void,
  ) {}

  /** Whether this can be drawn; fetches what is missing. */
  has(impostor: Impostor): boolean {
    const key = impostor.colour.url;
    if (this.crowds.has(key)) return this.crowds.get(key) !== undefined;
    if (this.crowds.size < MOST_MODELS) {
      this.crowds.set(key, undefined);
      // Without pictures they look like everybody else.
      this.bring(impostor).catch((error: unknown) => console.warn("a model that is worn cannot be drawn", error));
    }
    return false;
  }

  /** Draws these people, by the pictures that they wear, and no others. */
  draw(people: ReadonlyMap<string, readonly Somebody[]>): void {
    for (const [key, crowd] of this.crowds) crowd?.draw(people.get(key) ?? []);
  }

  look(eye: Vec3): void {
    for (const crowd of this.crowds.values()) crowd?.look(eye);
  }

  private async bring(impostor: Impostor): Promise<void> {
    const files = [impostor.colour, impostor.shape];
    const fetched = files.map(async (file) => [file.url, await this.studio.fetch(file)] as const);
    const { textures } = await openPictures(impostor, new Map(await Promise.all(fetched)), this.cache);
    const crowd = new FarCrowd(impostor, textures, this.root);
    await this.studio.prepare(crowd.sample());
    this.crowds.set(impostor.colour.url, crowd);
    this.changed();
  }
}
