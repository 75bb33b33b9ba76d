/**
 * How do far objects come into the picture? All objects of a model that are drawn by its impostor are one draw call: an
 * instanced square, which for each of them is told from where the eye looks and which views that takes.
 */
import {
  Box3,
  type InstancedMesh,
  type Intersection,
  LinearFilter,
  LinearMipmapLinearFilter,
  type Material,
  type Matrix4,
  NoColorSpace,
  type Raycaster,
  SRGBColorSpace,
  Texture,
  Vector3,
} from "three";
import type { Vec3 } from "../core/basics/geometry.ts";
import type { Impostor } from "../core/documents/impostordocument.ts";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import { impostorMaterial } from "./impostormaterial.ts";
import { release, withRoom } from "./room.ts";
import { Squares } from "./squares.ts";
import type { TextureCache } from "./textures.ts";
import type { ViewVolume } from "./viewvolume.ts";

/** From here on rays are as good as parallel. */
const SUN_M = 1e6;

/** The decoded pictures of an impostor. */
export interface Pictures {
  /** Colour, and shape. */
  readonly textures: readonly [Texture, Texture];
  /** What each takes, by its URL. */
  readonly bytes: ReadonlyMap<string, number>;
  close(): void;
}

/** Decodes what is not decoded yet. */
export async function openPictures(
  { colour, shape }: Impostor,
  pictures: ReadonlyMap<string, ArrayBuffer>,
  cache: TextureCache,
): Promise<Pictures> {
  const { pictures: bytes, failed } = await cache.acquire([colour.url, shape.url], pictures);
  for (const error of failed.values()) {
    for (const url of bytes.keys()) cache.release(url);
    throw error;
  }
  const textures = [atlas(cache, colour.url, SRGBColorSpace), atlas(cache, shape.url, NoColorSpace)] as const;
  const close = () => {
    for (const texture of textures) texture.dispose();
    for (const url of bytes.keys()) cache.release(url);
  };
  return { textures, bytes, close };
}

/** An object, and where it stands now. */
export interface Standing {
  readonly placed: PlacedObject;
  readonly worldFromObject: Matrix4;
}

/** The far objects of one model. */
export class ImpostorCrowd {
  private mesh: ObjectSquares | undefined;
  private readonly material: Material;
  private isTurnedToSun = false;

  private constructor(
    private readonly impostor: Impostor,
    private readonly pictures: Pictures,
  ) {
    this.material = impostorMaterial(impostor, ...pictures.textures);
  }

  /** Decodes what is not decoded yet. */
  static async open(
    impostor: Impostor,
    pictures: ReadonlyMap<string, ArrayBuffer>,
    cache: TextureCache,
  ): Promise<ImpostorCrowd> {
    return new ImpostorCrowd(impostor, await openPictures(impostor, pictures, cache));
  }

  /** What each of its pictures takes. */
  get bytes(): ReadonlyMap<string, number> {
    return this.pictures.bytes;
  }

  /** One of what it draws. */
  sample(): InstancedMesh {
    return new ObjectSquares(this.material, this.impostor, 0);
  }

  /** Draws these objects and no others; answers what is to be added to the picture when that has changed. */
  draw(crowd: readonly Standing[]): InstancedMesh | undefined {
    this.mesh = withRoom(
      this.mesh,
      crowd.length,
      (capacity) => new ObjectSquares(this.material, this.impostor, capacity),
    );
    const { mesh } = this;
    if (!mesh) return undefined;
    mesh.standing = crowd;
    mesh.count = crowd.length;
    crowd.forEach(({ worldFromObject }, i) => {
      mesh.stand(i, worldFromObject);
    });
    return mesh;
  }

  /** Turns all squares to an eye. */
  look(eye: Vec3): void {
    this.isTurnedToSun = false;
    this.mesh?.look(eye);
  }

  /** Turns all squares to the sun, wherever they stand, and answers what draws them; to be turned to the eye again by `look`. */
  castInto({ origin, towards }: ViewVolume): InstancedMesh[] {
    if (!this.mesh || this.mesh.count === 0) return [];
    if (!this.isTurnedToSun) this.mesh.look(origin.clone().addScaledVector(towards, SUN_M).toArray());
    this.isTurnedToSun = true;
    return [this.mesh];
  }

  close(): void {
    if (this.mesh) release(this.mesh);
    this.material.dispose();
    this.pictures.close();
  }
}

/** Squares of objects: rays meet the boxes of these. */
class ObjectSquares extends Squares {
  standing: readonly Standing[] = [];

  override raycast({ ray, far }: Raycaster, hits: Intersection[]): void {
    this.standing.forEach(({ placed }, instanceId) => {
      const { min, max } = placed.entry.bounds;
      const point = ray.intersectBox(new Box3(new Vector3(...min), new Vector3(...max)), new Vector3());
      const distance = point?.distanceTo(ray.origin);
      if (point && distance !== undefined && distance <= far) hits.push({ distance, point, object: this, instanceId });
    });
  }
}

/** The object that a ray has met, when it is one that is drawn by an impostor. */
export function standingAt({ object, instanceId }: Intersection): PlacedObject | undefined {
  return object instanceof ObjectSquares && instanceId !== undefined ? object.standing[instanceId]?.placed : undefined;
}

function atlas(cache: TextureCache, url: string, colorSpace: string): Texture {
  const texture = new Texture();
  const source = cache.sourceOf(url);
  if (source) texture.source = source as unknown as typeof texture.source;
  texture.colorSpace = colorSpace;
  texture.flipY = false;
  texture.premultiplyAlpha = false;
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearMipmapLinearFilter;
  texture.needsUpdate = true;
  return texture;
}
