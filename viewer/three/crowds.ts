/** How are many people drawn at once? Each of these is one draw call, with room for more than there were before. */
import {
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  type Color,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedMesh,
  type Material,
  type Matrix4,
  MeshBasicMaterial,
  type Object3D,
  type Texture,
} from "three";
import type { Vec3 } from "../core/basics/geometry.ts";
import { nearestFrame, type Pose } from "../core/live/crowd.ts";
import { bodyMaterial } from "./bodymaterial.ts";
import { type Drawable, impostorMaterial } from "./impostormaterial.ts";
import type { Person } from "./person.ts";
import { release, withRoom } from "./room.ts";
import { Squares } from "./squares.ts";

/** Somebody, as they are to be drawn. */
export interface Somebody {
  /** From a space with the ground at 0, in which they look along −z. */
  readonly world: Matrix4;
  readonly pose: Pose;
  readonly colour: Color;
}

/** Discs, and how high above the ground they lie. */
const RATES = { radius_m: 0.5, above_m: 0.03 };
const SHADES = { radius_m: 0.55, above_m: 0.02 };
/** How dark the ground is under somebody's feet. */
const SHADE = 0.5;
const SIDES = 32;

/** People who are drawn by their bodies. */
export class NearCrowd {
  private mesh: InstancedMesh | undefined;
  private readonly material: Material;

  constructor(
    private readonly person: Person,
    private readonly root: Object3D,
  ) {
    this.material = bodyMaterial(person);
  }

  /** One of what it draws. */
  sample(): Object3D {
    return this.make(0);
  }

  draw(people: readonly Somebody[]): void {
    this.mesh = withRoom(this.mesh, people.length, (capacity) => {
      const made = this.make(capacity);
      this.root.add(made);
      return made;
    });
    const { mesh } = this;
    if (!mesh) return;
    const { pose, tint } = mesh.geometry.attributes as Record<"pose" | "tint", InstancedBufferAttribute>;
    mesh.count = people.length;
    people.forEach((somebody, i) => {
      mesh.setMatrixAt(i, somebody.world);
      pose.setXYZ(i, somebody.pose.from, somebody.pose.to, somebody.pose.share);
      tint.setXYZ(i, somebody.colour.r, somebody.colour.g, somebody.colour.b);
    });
    for (const attribute of [mesh.instanceMatrix, pose, tint]) attribute.needsUpdate = true;
  }

  private make(capacity: number): InstancedMesh {
    return new InstancedMesh(bodyGeometry(this.person, capacity), this.material, capacity);
  }
}

/** People who are drawn by pictures of one model. */
export class FarCrowd {
  private squares: Squares | undefined;
  private readonly material: Material;

  constructor(
    private readonly impostor: Drawable,
    [colour, shape]: readonly [Texture, Texture],
    private readonly root: Object3D,
  ) {
    this.material = impostorMaterial(impostor, colour, shape);
  }

  /** One of what it draws. */
  sample(): Object3D {
    return new Squares(this.material, this.impostor, 0);
  }

  draw(people: readonly Somebody[]): void {
    this.squares = withRoom(this.squares, people.length, (capacity) => {
      const made = new Squares(this.material, this.impostor, capacity);
      this.root.add(made);
      return made;
    });
    const { squares } = this;
    if (!squares) return;
    squares.count = people.length;
    people.forEach(({ world, pose, colour }, i) => {
      squares.stand(i, world, { frame: nearestFrame(pose), tint: [colour.r, colour.g, colour.b] });
    });
  }

  look(eye: Vec3): void {
    this.squares?.look(eye);
  }

  /** Frees what it takes but its pictures, which are another's. */
  close(): void {
    if (this.squares) release(this.squares);
    this.material.dispose();
  }
}

/** Discs on the ground, of one kind. */
export class Discs {
  private mesh: InstancedMesh | undefined;

  private constructor(
    private readonly root: Object3D,
    private readonly geometry: BufferGeometry,
    private readonly material: Material,
  ) {}

  /** That tell something by their colour. */
  static coloured(root: Object3D): Discs {
    return new Discs(root, disc(RATES), new MeshBasicMaterial({ transparent: true, opacity: 0.7, toneMapped: false }));
  }

  /** That are as dark as the ground is on which somebody stands, and have no edge: people walk on too soon for the shadow map. */
  static shades(root: Object3D): Discs {
    const geometry = disc(SHADES);
    const colours = new Float32Array(4 * geometry.getAttribute("position").count);
    // The middle comes first; the rim is not seen.
    colours[3] = SHADE;
    geometry.setAttribute("color", new BufferAttribute(colours, 4));
    const material = new MeshBasicMaterial({ transparent: true, vertexColors: true, depthWrite: false, fog: false });
    return new Discs(root, geometry, material);
  }

  /** One of what it draws. */
  sample(): Object3D {
    return this.make(0);
  }

  draw(discs: readonly { readonly world: Matrix4; readonly colour: Color }[]): void {
    this.mesh = withRoom(this.mesh, discs.length, (capacity) => {
      const made = this.make(capacity);
      this.root.add(made);
      return made;
    });
    const { mesh } = this;
    if (!mesh) return;
    mesh.count = discs.length;
    discs.forEach(({ world, colour }, i) => {
      mesh.setMatrixAt(i, world);
      mesh.setColorAt(i, colour);
    });
    mesh.instanceMatrix.needsUpdate = true;
    if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
  }

  private make(capacity: number): InstancedMesh {
    const made = new InstancedMesh(this.geometry.clone(), this.material, capacity);
    made.instanceColor = new InstancedBufferAttribute(new Float32Array(3 * capacity), 3);
    return made;
  }
}

function disc({ radius_m, above_m }: typeof RATES): BufferGeometry {
  return new CircleGeometry(radius_m, SIDES).rotateX(-Math.PI / 2).translate(0, above_m, 0);
}

function bodyGeometry({ vertices, indices, colours, own }: Person, capacity: number): BufferGeometry {
  const geometry = new BufferGeometry();
  // Where corners are and how they face, the material finds itself; without normals faces would be drawn flat.
  const nothing = new BufferAttribute(new Float32Array(3 * vertices), 3);
  geometry.setAttribute("position", nothing);
  geometry.setAttribute("normal", nothing);
  geometry.setAttribute("color", new BufferAttribute(colours, 3));
  geometry.setAttribute("own", new BufferAttribute(own, 1));
  geometry.setIndex(new BufferAttribute(indices, 1));
  for (const name of ["pose", "tint"]) {
    const numbers = new InstancedBufferAttribute(new Float32Array(3 * capacity), 3).setUsage(DynamicDrawUsage);
    geometry.setAttribute(name, numbers);
  }
  return geometry;
}
