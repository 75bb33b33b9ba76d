/**
 * How does a picture never wait for the graphics card to learn to draw? Programs are compiled beside the page; whoever draws with one, or
 * only asks what it takes, waits until that is done. So they are asked for ahead, those that most models need before the first
 * picture, and what needs another one comes into the picture when that is there.
 */
import {
  BufferAttribute,
  BufferGeometry,
  type Camera,
  DoubleSide,
  FrontSide,
  Group,
  InstancedMesh,
  Line,
  LineBasicMaterial,
  type Material,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  type Scene,
  Texture,
  type WebGLRenderer,
} from "three";
import { type Drawable, impostorMaterial } from "./impostormaterial.ts";
import { paintMaterial } from "./paintmaterial.ts";
import { Palette } from "./palette.ts";
import { Squares } from "./squares.ts";

type Program = NonNullable<WebGLRenderer["info"]["programs"]>[number];

/** What of a renderer is asked for. */
export type Preparing = Pick<WebGLRenderer, "compile" | "getContext" | "properties">;

/** What three.js keeps of a material that it has compiled. */
interface Compiled {
  readonly programs?: ReadonlyMap<string, Program>;
}

/** So often one looks whether the graphics card has come so far. */
const LOOK_AGAIN_MS = 8;
/** Who is not told for so long draws and waits. */
const PATIENCE_MS = 10_000;

export class Programs {
  private readonly ready = new WeakMap<Program, Promise<void>>();
  /** What materials were prepared for already. */
  private readonly prepared = new WeakMap<Material, Set<string>>();

  /** Of what is drawn in a scene. */
  constructor(
    private readonly renderer: Preparing,
    private readonly scene: Scene,
    private readonly camera: Camera,
  ) {}

  /** Waits until what is below a node can be drawn without waiting, and for nothing else that is compiled meanwhile. */
  async prepare(root: Object3D): Promise<void> {
    const drawn = materialsOf(root);
    if (!drawn.every((one) => this.knows(one))) {
      this.renderer.compile(root, this.camera, this.scene);
      for (const one of drawn) this.remember(one);
    }
    const programs = drawn.flatMap(({ material }) => this.programsOf(material));
    await Promise.all([...new Set(programs)].map((program) => this.whenReady(program)));
  }

  /** Prepares what nobody waits for. What is wrong with it is said, and met again by whoever draws it. */
  async prepareAhead(root: Object3D): Promise<void> {
    try {
      await this.prepare(root);
    } catch (error) {
      console.error("what is drawn later cannot be prepared", error);
    }
  }

  /** Whether a material was prepared for such a mesh. */
  private knows({ material, kind }: DrawnMaterial): boolean {
    return this.prepared.get(material)?.has(kind) ?? false;
  }

  private remember({ material, kind }: DrawnMaterial): void {
    this.prepared.set(material, (this.prepared.get(material) ?? new Set()).add(kind));
  }

  private programsOf(material: Material): Program[] {
    const { programs } = this.renderer.properties.get(material) as Compiled;
    return [...(programs?.values() ?? [])];
  }

  private whenReady(program: Program): Promise<void> {
    const ready = this.ready.get(program) ?? this.finish(program);
    this.ready.set(program, ready);
    return ready;
  }

  private async finish(program: Program): Promise<void> {
    // They are few, and dear: each stays when the last that was drawn with it goes.
    program.usedTimes += 1;
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    await compiled(gl, program.program as WebGLProgram);
    if (gl.isContextLost()) return;
    const isLinked = gl.getProgramParameter(program.program as WebGLProgram, gl.LINK_STATUS);
    if (!isLinked)
      console.error(`${program.name} cannot be drawn`, gl.getProgramInfoLog(program.program as WebGLProgram));
    // From now on three.js knows what it takes.
    program.getUniforms();
  }
}

/** A material, and on what kind of mesh. */
interface DrawnMaterial {
  readonly material: Material;
  readonly kind: string;
}

function materialsOf(root: Object3D): DrawnMaterial[] {
  const drawn: DrawnMaterial[] = [];
  root.traverse((node) => {
    const { material, geometry } = node as Partial<Mesh>;
    const attributes = Object.entries(geometry?.attributes ?? {}).map(([name, { itemSize }]) => name + itemSize);
    const kind = `${node.type} ${node instanceof InstancedMesh} ${attributes.sort()}`;
    for (const one of material ? [material].flat() : []) drawn.push({ material: one, kind });
  });
  return drawn;
}

/** What most models need: what is painted by its vertices, seen from one side or from both, and what is seen through. */
export function usualMeshes(): Object3D {
  const geometry = corners();
  const palette = new Palette().uniform;
  const painted = [FrontSide, DoubleSide].map((side) =>
    paintMaterial(palette, { side, vertexColors: false, flatShading: false }),
  );
  return new Group().add(
    ...painted.map((material) => new InstancedMesh(geometry, material, 0)),
    new Mesh(geometry, new MeshStandardMaterial({ transparent: true })),
  );
}

/** What many worlds have, and seldom in their first picture: lines, and what is drawn by its pictures. */
export function rarerMeshes(): Object3D {
  const impostor: Drawable = { mapping: "octahedral", views: 2, size_px: 1, frames: 1, centre: [0, 0, 0], radius: 1 };
  return new Group().add(
    new Line(corners(), new LineBasicMaterial()),
    new Squares(impostorMaterial(impostor, new Texture(), new Texture()), impostor, 0),
  );
}

function corners(): BufferGeometry {
  const geometry = new BufferGeometry();
  for (const name of ["position", "normal"]) geometry.setAttribute(name, new BufferAttribute(new Float32Array(9), 3));
  return geometry;
}

/** Waits until a program is compiled, without asking anything that the browser would have to wait for. */
async function compiled(gl: WebGL2RenderingContext, program: WebGLProgram): Promise<void> {
  const parallel = gl.getExtension("KHR_parallel_shader_compile");
  const fence = parallel ? null : gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  const end_ms = performance.now() + PATIENCE_MS;
  const isDone = () => {
    if (gl.isContextLost() || performance.now() > end_ms) return true;
    if (parallel) return gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR) as boolean;
    // Without the extension: what was begun before this is done then.
    return !fence || gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED;
  };
  do await new Promise((look) => setTimeout(look, LOOK_AGAIN_MS));
  while (!isDone());
  gl.deleteSync(fence);
}
