/**
 * How does what is invisible get into the picture? Boxes, hulls, openings and circles over the world, in named layers
 * that can be replaced one by one. Lines are drawn where things stand; fills never hide what is behind them.
 */
import {
  BoxGeometry,
  BufferGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  type Object3D,
  Quaternion,
  Vector3,
} from "three";
import type { Bounds, Vec3 } from "../core/basics/geometry.ts";

export interface Ink {
  readonly color: number;
  /** Opacity of lines and of what they enclose. */
  readonly line: number;
  readonly fill: number;
  /** Whether walls do not hide it. */
  readonly through?: boolean;
}

export class Overlay {
  readonly root = new Group();
  private readonly layers = new Map<string, Object3D>();
  /** What each layer is to be, which is in the picture as soon as it can be drawn. */
  private readonly newest = new Map<string, Object3D>();

  /** `prepare` answers when what is below a node can be drawn; `changed` is called when a layer has come into the picture. */
  constructor(
    private readonly prepare: (root: Object3D) => Promise<void>,
    private readonly changed: () => void,
  ) {}

  /** Draws a layer instead of what was drawn under its name; none takes it away. */
  set(name: string, shapes: readonly Object3D[]): void {
    this.newest.delete(name);
    if (shapes.length === 0) {
      this.remove(name);
      return;
    }
    const layer = new Group().add(...shapes);
    this.newest.set(name, layer);
    void this.bring(name, layer);
  }

  clear(): void {
    this.newest.clear();
    for (const name of [...this.layers.keys()]) this.remove(name);
  }

  /** Puts a layer into the picture in one step, unless there is a newer one by then. */
  private async bring(name: string, layer: Object3D): Promise<void> {
    try {
      await this.prepare(layer);
    } catch (error) {
      console.warn(`the layer ${name} cannot be prepared`, error);
    }
    if (this.newest.get(name) !== layer) {
      layer.traverse(dispose);
      return;
    }
    this.remove(name);
    this.layers.set(name, layer);
    this.root.add(layer);
    this.changed();
  }

  private remove(name: string): void {
    const layer = this.layers.get(name);
    layer?.removeFromParent();
    layer?.traverse(dispose);
    this.layers.delete(name);
  }
}

/** Edges of a box, as pairs of corners; bit i of a corner chooses the larger end of axis i. */
const EDGES = [0, 1, 2].flatMap((axis) =>
  [0, 1, 2, 3, 4, 5, 6, 7]
    .filter((corner) => !(corner & (1 << axis)))
    .flatMap((corner) => [corner, corner | (1 << axis)]),
);

const cornerOf = ({ min, max }: Bounds, corner: number): Vec3 => [
  (corner & 1 ? max : min)[0],
  (corner & 2 ? max : min)[1],
  (corner & 4 ? max : min)[2],
];

export function boxes(bounds: readonly Bounds[], ink: Ink): Object3D[] {
  if (bounds.length === 0) return [];
  const shapes: Object3D[] = [];
  if (ink.line > 0) {
    shapes.push(
      lines(
        bounds.flatMap((box) => EDGES.map((corner) => cornerOf(box, corner))),
        ink,
      ),
    );
  }
  if (ink.fill > 0) shapes.push(filledBoxes(bounds, ink));
  return shapes;
}

function filledBoxes(bounds: readonly Bounds[], ink: Ink): Object3D {
  const filled = new InstancedMesh(new BoxGeometry(1, 1, 1), fill(ink), bounds.length);
  const [place, size, turn] = [new Vector3(), new Vector3(), new Quaternion()];
  bounds.forEach(({ min, max }, i) => {
    place.set((min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2);
    size.set(max[0] - min[0], max[1] - min[1], max[2] - min[2]).addScalar(0.01);
    filled.setMatrixAt(i, new Matrix4().compose(place, turn, size));
  });
  filled.frustumCulled = false;
  return filled;
}

/** A convex polyhedron. */
export function hull(points: readonly Vec3[], faces: readonly (readonly number[])[], ink: Ink): Object3D[] {
  const polygons = faces.map((face) => face.map((i) => points[i]).filter((point) => point !== undefined));
  return polygons.flatMap((polygon) => outlined(polygon, ink));
}

/** A convex polygon. */
export function outlined(polygon: readonly Vec3[], ink: Ink): Object3D[] {
  const shapes: Object3D[] = [
    lines(
      polygon.flatMap((point, i) => [point, polygon[(i + 1) % polygon.length] ?? point]),
      ink,
    ),
  ];
  const [first] = polygon;
  if (ink.fill > 0 && first) {
    const triangles = polygon.slice(1, -1).flatMap((point, i) => [first, point, polygon[i + 2] ?? point]);
    shapes.push(new Mesh(geometry(triangles), fill(ink)));
  }
  return shapes;
}

/** The edges of a pyramid from an eye to the corners of what it sees. */
export function pyramid(eye: Vec3, corners: readonly Vec3[], ink: Ink): Object3D[] {
  return [lines([...corners.flatMap((corner) => [eye, corner]), ...ring(corners)], ink)];
}

/** A level circle. */
export function circle([x, y, z]: Vec3, radius_m: number, ink: Ink): Object3D[] {
  const points = Array.from({ length: 96 }, (_, i): Vec3 => {
    const angle = (i / 96) * 2 * Math.PI;
    return [x + radius_m * Math.cos(angle), y, z + radius_m * Math.sin(angle)];
  });
  return [lines(ring(points), ink)];
}

function ring(points: readonly Vec3[]): Vec3[] {
  return points.flatMap((point, i) => [point, points[(i + 1) % points.length] ?? point]);
}

function lines(ends: readonly Vec3[], { color, line, through }: Ink): LineSegments {
  const material = new LineBasicMaterial({ color, opacity: line, transparent: true, depthWrite: false });
  material.depthTest = !through;
  const drawn = new LineSegments(geometry(ends), material);
  drawn.renderOrder = 2;
  return drawn;
}

function fill({ color, fill: opacity, through }: Ink): MeshBasicMaterial {
  const material = new MeshBasicMaterial({ color, opacity, transparent: true, depthWrite: false, side: DoubleSide });
  material.depthTest = !through;
  return material;
}

function geometry(points: readonly Vec3[]): BufferGeometry {
  return new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points.flat(), 3));
}

function dispose(node: Object3D): void {
  const { geometry: shape, material } = node as Partial<Mesh>;
  shape?.dispose();
  for (const one of material ? [material].flat() : []) one.dispose();
  if (node instanceof InstancedMesh) node.dispose();
}
