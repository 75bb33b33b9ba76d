/**
 * How do all objects come into the picture that are drawn with the same meshes? Together, by one call for each mesh. What has to be drawn
 * by itself is: what is seen through, which is drawn from far to near; points and lines; and what is sheared, since shaders take
 * instances' normals for those of scaled and turned ones.
 */
import {
  Group,
  InstancedMesh,
  type Intersection,
  type Line,
  type Material,
  Matrix4,
  Mesh,
  type Object3D,
  type Points,
  Vector3,
} from "three";
import { InstanceMesh } from "./instancemesh.ts";
import { Instances } from "./instances.ts";
import type { ViewVolume } from "./viewvolume.ts";

export type Drawn = Mesh | Points | Line;

/** Axes that are as far from being at right angles count as sheared: the cosine. */
const SHEARED = 1e-3;

export class ModelBatch {
  /** All that is drawn. */
  readonly root = new Group();
  private readonly shared: readonly Mesh[];
  private readonly single: readonly Drawn[];
  private readonly instances = new Map<boolean, Instances>();
  /** What is drawn by itself, by object. */
  private readonly alone = new Map<number, readonly Drawn[]>();

  /** Parts carry in `matrixWorld` where they are in an object. */
  constructor(private readonly parts: readonly Drawn[]) {
    this.root.matrixAutoUpdate = false;
    this.shared = parts.filter(isInstanced);
    this.single = parts.filter((part) => !isInstanced(part));
  }

  /** One of each that it draws, as it draws them. */
  sample(): Object3D {
    const root = new Group();
    for (const { geometry, material } of this.shared) root.add(new InstancedMesh(geometry, material, 0));
    for (const part of this.single) root.add(copyOf(part, 0));
    return root;
  }

  /** Draws an object here from now on. */
  stand(object: number, worldFromObject: Matrix4): void {
    const isSheared = this.shared.some(({ matrixWorld }) => isShearing(worldFromObject, matrixWorld));
    const isMirrored = worldFromObject.determinant() < 0;
    for (const [areMirrored, instances] of this.instances) {
      if (isSheared || areMirrored !== isMirrored) instances.remove(object);
    }
    if (!isSheared && this.shared.length > 0) this.instancesOf(isMirrored).stand(object, worldFromObject);
    this.standAlone(object, worldFromObject, isSheared ? this.parts : this.single);
  }

  remove(object: number): void {
    for (const instances of this.instances.values()) instances.remove(object);
    for (const node of this.alone.get(object) ?? []) leave(node);
    this.alone.delete(object);
  }

  /** Draws what is in view, and nothing else; to be called before each picture. */
  look(view: ViewVolume): void {
    for (const instances of this.instances.values()) instances.look(view);
  }

  /** Turns to the sun what stands in a volume, and answers what draws that; to be turned to the eye again by `look`. */
  castInto(volume: ViewVolume): Mesh[] {
    const alone = [...this.alone.values()].flat().filter((node) => node instanceof InstancedMesh);
    return [...[...this.instances.values()].flatMap((instances) => instances.castInto(volume)), ...alone];
  }

  /** Has the next picture give the graphics card what it takes, in view or not; answers whether something of that was new. */
  introduce(): boolean {
    return [...this.instances.values()].map((instances) => instances.introduce()).includes(true);
  }

  /** Frees what it takes, but neither geometry nor materials. */
  release(): void {
    this.root.removeFromParent();
    for (const instances of this.instances.values()) instances.release();
    for (const nodes of this.alone.values()) for (const node of nodes) leave(node);
  }

  private instancesOf(areMirrored: boolean): Instances {
    const instances = this.instances.get(areMirrored) ?? new Instances(this.shared, areMirrored, this.root);
    this.instances.set(areMirrored, instances);
    return instances;
  }

  private standAlone(object: number, worldFromObject: Matrix4, parts: readonly Drawn[]): void {
    const before = this.alone.get(object) ?? [];
    const isSame = before.length === parts.length;
    if (!isSame) for (const node of before) leave(node);
    if (parts.length === 0) this.alone.delete(object);
    if (parts.length === 0) return;
    const nodes = isSame ? before : parts.map((part) => copyOf(part, object));
    this.alone.set(object, nodes);
    nodes.forEach((node, i) => {
      if (!isSame) this.root.add(node);
      const part = parts[i];
      if (part) node.matrix.multiplyMatrices(worldFromObject, part.matrixWorld);
      node.updateMatrixWorld(true);
    });
  }
}

/** The object that a ray has met in a batch. */
export function batchedAt({ object, instanceId }: Intersection): number | undefined {
  if (object instanceof InstanceMesh) return instanceId === undefined ? undefined : object.objectIn(instanceId);
  return object.userData.object as number | undefined;
}

function isInstanced(part: Drawn): part is Mesh {
  return part instanceof Mesh && [part.material].flat().every(isOpaque);
}

function isOpaque(material: Material & { readonly transmission?: number }): boolean {
  return !material.transparent && !material.transmission;
}

/** Whether right angles do not stay right angles. */
function isShearing(worldFromObject: Matrix4, objectFromPart: Matrix4): boolean {
  const [x, y, z] = [new Vector3(), new Vector3(), new Vector3()];
  new Matrix4().multiplyMatrices(worldFromObject, objectFromPart).extractBasis(x, y, z);
  for (const axis of [x, y, z]) axis.normalize();
  return [x.dot(y), y.dot(z), z.dot(x)].some((cosine) => Math.abs(cosine) > SHEARED);
}

/**
 * Draws the same geometry once more. What is sheared is an instance of its own, which stands at the origin of a mesh that is: so it takes
 * the program that draws the others, and its normals are those of the mesh.
 */
function copyOf(part: Drawn, object: number): Drawn {
  const copy = isInstanced(part)
    ? new InstancedMesh(part.geometry, part.material, 1)
    : new (part.constructor as new (geometry: Drawn["geometry"], material: Drawn["material"]) => Drawn)(
        part.geometry,
        part.material,
      );
  copy.matrixAutoUpdate = false;
  copy.receiveShadow = true;
  copy.userData.object = object;
  return copy;
}

/** Takes a node out of the picture, with what it alone takes of the graphics card. */
function leave(node: Drawn): void {
  node.removeFromParent();
  if (node instanceof InstancedMesh) node.dispose();
}
