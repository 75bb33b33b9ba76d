/**
 * How do far objects come into the picture? All objects of a model that are drawn by its impostor are one draw call: an
 * instanced square, which for each of them is told from where the eye looks and which views that takes.
 */
import {
  Box3,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedMesh,
  type Intersection,
  LinearFilter,
  LinearMipmapLinearFilter,
  type Material,
  type Matrix4,
  NoColorSpace,
  PlaneGeometry,
  type Raycaster,
  SRGBColorSpace,
  Texture,
  Vector3,
} from "three";
import type { Vec3 } from "../core/geometry.ts";
import type { Impostor } from "../core/impostordocument.ts";
import { directionOf, viewsAround } from "../core/impostors.ts";
import type { PlacedObject } from "../core/objects.ts";
import { impostorMaterial } from "./impostormaterial.ts";
import type { TextureCache } from "./textures.ts";

/** Numbers for each object: where the eye is, three views with their numbers, and their weights. */
const ATTRIBUTES = { towards: 3, viewA: 4, viewB: 4, viewC: 4, viewWeights: 3 } as const;
const VIEWS = ["viewA", "viewB", "viewC"] as const;

/** An object, and where it stands now. */
export interface Standing {
  readonly placed: PlacedObject;
  readonly worldFromObject: Matrix4;
}

/** The far objects of one model. */
export class ImpostorCrowd {
  private mesh: Squares | undefined;
  private directions: Vec3[];
  private objectsFromWorld: Matrix4[] = [];
  private readonly material: Material;
  private readonly textures: readonly Texture[];

  private constructor(
    private readonly impostor: Impostor,
    private readonly cache: TextureCache,
    readonly bytes: number,
  ) {
    const { colour, shape, mapping, views } = impostor;
    this.textures = [atlas(cache, colour.url, SRGBColorSpace), atlas(cache, shape.url, NoColorSpace)];
    this.material = impostorMaterial(impostor, this.textures[0] as Texture, this.textures[1] as Texture);
    this.directions = Array.from({ length: views * views }, (_, number) =>
      directionOf(mapping, (number % views) / (views - 1), Math.floor(number / views) / (views - 1)),
    );
  }

  /** Decodes what is not decoded yet. */
  static async open(
    impostor: Impostor,
    pictures: ReadonlyMap<string, ArrayBuffer>,
    cache: TextureCache,
  ): Promise<ImpostorCrowd> {
    const { colour, shape } = impostor;
    let bytes = await cache.acquire(colour.url, pictures.get(colour.url));
    try {
      bytes += await cache.acquire(shape.url, pictures.get(shape.url));
    } catch (error) {
      cache.release(colour.url);
      throw error;
    }
    return new ImpostorCrowd(impostor, cache, bytes);
  }

  /** Draws these objects and no others; answers what is to be added to the picture when that has changed. */
  draw(crowd: readonly Standing[]): InstancedMesh | undefined {
    if (crowd.length > (this.mesh?.capacity ?? 0)) {
      this.removeMesh();
      this.mesh = new Squares(this.material, 2 * crowd.length);
    }
    const { mesh } = this;
    if (!mesh) return undefined;
    mesh.standing = crowd;
    mesh.count = crowd.length;
    crowd.forEach(({ worldFromObject }, i) => {
      mesh.setMatrixAt(i, worldFromObject);
    });
    mesh.instanceMatrix.needsUpdate = true;
    this.objectsFromWorld = crowd.map(({ worldFromObject }) => worldFromObject.clone().invert());
    return mesh;
  }

  /** Turns all squares to an eye. */
  look(eye: Vec3): void {
    const { mesh, impostor, directions } = this;
    if (!mesh || mesh.count === 0) return;
    const at = new Vector3();
    const { towards, viewWeights } = mesh.numbers;
    this.objectsFromWorld.forEach((objectFromWorld, i) => {
      at.set(...eye)
        .applyMatrix4(objectFromWorld)
        .sub(new Vector3(...impostor.centre))
        .normalize();
      towards.setXYZ(i, at.x, at.y, at.z);
      const around = viewsAround(impostor.mapping, [at.x, at.y, at.z], impostor.views);
      around.forEach(({ column, row }, k) => {
        const number = row * impostor.views + column;
        const [x, y, z] = directions[number] ?? [0, 1, 0];
        mesh.numbers[VIEWS[k] ?? "viewA"].setXYZW(i, x, y, z, number);
      });
      viewWeights.setXYZ(i, around[0].weight, around[1].weight, around[2].weight);
    });
    for (const attribute of Object.values(mesh.numbers)) attribute.needsUpdate = true;
  }

  close(): void {
    this.removeMesh();
    this.material.dispose();
    for (const texture of this.textures) texture.dispose();
    this.cache.release(this.impostor.colour.url);
    this.cache.release(this.impostor.shape.url);
  }

  private removeMesh(): void {
    this.mesh?.removeFromParent();
    this.mesh?.geometry.dispose();
    this.mesh?.dispose();
    this.mesh = undefined;
  }
}

/** Squares with what each is told. Rays meet the boxes of their objects. */
class Squares extends InstancedMesh {
  standing: readonly Standing[] = [];
  readonly numbers: Record<keyof typeof ATTRIBUTES, InstancedBufferAttribute>;

  constructor(
    material: Material,
    readonly capacity: number,
  ) {
    const geometry = new PlaneGeometry(2, 2);
    super(geometry, material, capacity);
    this.frustumCulled = false;
    this.matrixAutoUpdate = false;
    const attribute = (size: number) =>
      new InstancedBufferAttribute(new Float32Array(size * capacity), size).setUsage(DynamicDrawUsage);
    this.numbers = {
      towards: attribute(ATTRIBUTES.towards),
      viewA: attribute(ATTRIBUTES.viewA),
      viewB: attribute(ATTRIBUTES.viewB),
      viewC: attribute(ATTRIBUTES.viewC),
      viewWeights: attribute(ATTRIBUTES.viewWeights),
    };
    for (const [name, numbers] of Object.entries(this.numbers)) geometry.setAttribute(name, numbers);
  }

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
  return object instanceof Squares && instanceId !== undefined ? object.standing[instanceId]?.placed : undefined;
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
